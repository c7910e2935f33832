# SPDX-License-Identifier: GPL-3.0-or-later
"""Result in the sidebar, and as a pop-up at the end of a fit."""

from __future__ import annotations

import bpy

from .. import state
from ..pictures.thumbnails import THUMBNAILS
from ..progress.background import draw_next_camera, draw_work
from ..texts import paragraph
from . import drawing

_WIDTH = 420  # of the pop-up, in pixels at a scale of 1


class SELENITE_PT_result(bpy.types.Panel):
    """What the last fit has found"""

    bl_idname = "SELENITE_PT_result"
    bl_label = "Result"
    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "Selenite"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a result."""
        return len(context.scene.selenite.results) > 0

    def draw(self, context: bpy.types.Context) -> None:
        """Verdict, buttons, values, and the whole report on demand."""
        settings, layout = context.scene.selenite, self.layout
        drawing.draw_verdict(layout, context, settings)
        THUMBNAILS.draw(layout, context)
        buttons = layout.row(align=True)
        buttons.operator("selenite.apply", icon="CHECKMARK")
        buttons.operator("selenite.restore", text="Restore", icon="LOOP_BACK")
        drawing.draw_values(layout, context, settings)
        drawing.draw_report(layout, context, settings)
        draw_next_camera(layout, context)
        column = layout.column(align=True)
        column.label(text="Folder")  # beside the path it would cut it
        column.prop(settings, "output", text="")
        if not draw_work(layout, state.SAVE):
            layout.operator("selenite.save_result", icon="FILE_TICK")
            for line in state.SAVE.lines:
                paragraph(layout, context, line)


class SELENITE_OT_show_result(bpy.types.Operator):
    """Show the result: verdict, values with their 90 % intervals, and Apply. The bar lies between
    the bounds of the fit"""

    bl_idname = "selenite.show_result"
    bl_label = "Selenite: Result"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a result."""
        return len(context.scene.selenite.results) > 0

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """A pop-up that goes when the pointer leaves it."""
        return set(context.window_manager.invoke_popup(self, width=_WIDTH))

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Nothing is left to do."""
        return {"FINISHED"}

    def draw(self, context: bpy.types.Context) -> None:
        """As in the sidebar, without what is for later."""
        settings, layout = context.scene.selenite, self.layout
        layout.label(text=self.bl_label)
        drawing.draw_verdict(layout, context, settings)
        drawing.draw_values(layout, context, settings)
        buttons = layout.row(align=True)
        buttons.operator("selenite.apply", icon="CHECKMARK")
        buttons.operator("selenite.restore", text="Restore", icon="LOOP_BACK")


CLASSES = (SELENITE_OT_show_result,)
