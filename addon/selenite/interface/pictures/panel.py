# SPDX-License-Identifier: GPL-3.0-or-later
"""The sub-panel that says what the Image Editor shows of a fit."""

from __future__ import annotations

import bpy

from ...report.pictures.comparison import BEFORE_AFTER, DIFFERENCE, PHOTO, WIPE
from ..state import CHECK, RUN
from .properties import settings
from .view import VIEW
from .view_through import is_through


class SELENITE_PT_pictures(bpy.types.Panel):
    """Pictures of the photos, the render and the fit"""

    bl_idname = "SELENITE_PT_pictures"
    bl_label = "Pictures"
    bl_parent_id = "SELENITE_PT_fit"
    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "Selenite"

    def draw(self, context: bpy.types.Context) -> None:
        """Buttons first; what to show, once it is open."""
        layout, chosen = self.layout, settings(context)
        through = is_through(context.scene)
        layout.operator(
            "selenite.view_through",
            text="Back from Camera" if through else "View through Camera",
            icon="LOOP_BACK" if through else "VIEW_CAMERA",
        )
        if not VIEW.areas:
            layout.operator("selenite.show_pictures", icon="IMAGE_DATA")
            return
        layout.operator("selenite.hide_pictures", icon="X")
        column = layout.column()
        column.use_property_split = True
        column.use_property_decorate = False
        column.prop(chosen, "content")
        if chosen.content == "CYCLES" and CHECK.sheet is None:
            column.label(text="No check yet", icon="INFO")
        if chosen.content == "SHEET" and RUN.fitting is not None:
            column.label(text="After the fit", icon="INFO")
        if chosen.content != "COMPARISON":
            return
        column.prop(chosen, "mode")
        if chosen.mode in (WIPE, BEFORE_AFTER):
            column.prop(chosen, "wipe")
        elif chosen.mode == DIFFERENCE:
            column.prop(chosen, "scale")
        if RUN.done is not None and chosen.mode != PHOTO:
            column.prop(chosen, "moment")
            if chosen.moment == "ITERATION":
                column.prop(chosen, "timeline")
                text = VIEW.moment_text()
                if text:
                    column.label(text=text)


CLASSES = (SELENITE_PT_pictures,)
