# SPDX-License-Identifier: GPL-3.0-or-later
"""Parameters in the sidebar, and those of one material in the Properties editor."""

from __future__ import annotations

import bpy

from .. import state, warning_rows
from ..chosen import chosen
from ..furniture.icon import icon_id
from ..texts import paragraph, translated
from . import details

_FEWEST_OWNERS, _MOST_OWNERS, _ROWS = 2, 4, 8


class SELENITE_PT_parameters(bpy.types.Panel):
    """What is fitted, where it starts, and its bounds"""

    bl_idname = "SELENITE_PT_parameters"
    bl_label = "Parameters"
    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "Selenite"

    def draw(self, context: bpy.types.Context) -> None:
        """Owners, the parameters of the active one, and the active parameter."""
        settings, layout = context.scene.selenite, self.layout
        row = layout.row(align=True)
        row.operator("selenite.refresh_rows", text="Refresh")
        row.operator("selenite.reset_rows", text="Reset")
        column = layout.column(align=True)
        column.prop(settings, "bake")
        column.prop(settings, "approximate")
        in_head = {item.line() for item in state.PROBLEMS.get(context.scene.name, ())}
        for text in state.SHAPES.get(context.scene.name, ()):
            if text in in_head:
                continue
            paragraph(layout.box(), context, text, "ERROR")
        warning_rows.draw(layout, context, warning_rows.others(context.scene))
        if not len(settings.rows):
            return
        layout.template_list(
            "SELENITE_UL_owners", "", settings, "owners", settings, "active_owner",
            item_dyntip_propname="tip",
            rows=min(max(len(settings.owners), _FEWEST_OWNERS), _MOST_OWNERS),
        )  # fmt: skip
        owner = chosen(settings.owners, settings.active_owner)
        if owner is not None:
            subjects = warning_rows.of_owner(context.scene, owner)
            warning_rows.draw(layout, context, warning_rows.about(context.scene, subjects))
        row = layout.row(align=True)
        row.operator("selenite.tick_usual", text="Usual", icon="CHECKBOX_HLT")
        row.operator("selenite.untick", text="None", icon="CHECKBOX_DEHLT")
        row.prop(
            settings, "show_locked", text="", icon="LOCKED" if settings.show_locked else "UNLOCKED"
        )
        layout.template_list(
            "SELENITE_UL_rows", "", settings, "rows", settings, "active_row",
            item_dyntip_propname="tip", rows=_ROWS,
        )  # fmt: skip
        details.draw(layout, context, chosen(settings.rows, settings.active_row))


class SELENITE_PT_material(bpy.types.Panel):
    """What a fit may change of this material"""

    bl_idname = "SELENITE_PT_material"
    bl_label = "Selenite"
    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "material"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a material."""
        return getattr(context, "material", None) is not None

    def draw_header(self, _context: bpy.types.Context) -> None:
        """The icon."""
        if icon_id():
            self.layout.label(text="", icon_value=icon_id())

    def draw(self, context: bpy.types.Context) -> None:
        """Its parameters that can be fitted, with ticks."""
        settings, layout = context.scene.selenite, self.layout
        rows = [row for row in settings.rows if row.material == context.material]
        if not rows:
            paragraph(layout, context, translated("Its parameters are not listed yet"))
            layout.operator("selenite.refresh_rows", icon="FILE_REFRESH")
            return
        column = layout.column(align=True)
        for row in rows:
            if row.reason:
                continue
            line = column.row(align=True)
            line.prop(row, "enabled", text=row.label, translate=False)
            if row.is_colour:
                value = line.row()
                value.enabled = False
                value.prop(row, "current", text="")
            else:
                line.label(text=row.value, translate=False)
