# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets of the fit's settings, kept by Blender in the user's own folder."""

from __future__ import annotations

import bpy
from bl_operators.presets import AddPresetBase

from ..request import FIT_SETTINGS

_FOLDER = "selenite/fit"


class SELENITE_MT_presets(bpy.types.Menu):
    """Saved settings of a fit"""

    bl_idname = "SELENITE_MT_presets"
    bl_label = "Fit Presets"
    preset_subdir = _FOLDER
    preset_operator = "script.execute_preset"

    def draw(self, context: bpy.types.Context) -> None:
        """Blender's own list of files."""
        self.draw_preset(context)


class SELENITE_OT_add_preset(AddPresetBase, bpy.types.Operator):
    """Save the settings of the fit under a name, or remove the chosen preset"""

    bl_idname = "selenite.add_preset"
    bl_label = "Add Fit Preset"
    preset_menu = "SELENITE_MT_presets"
    preset_subdir = _FOLDER
    preset_defines = ("settings = bpy.context.scene.selenite",)
    preset_values = tuple(f"settings.{name}" for name in (*FIT_SETTINGS, "stage_mode"))


def draw(layout: bpy.types.UILayout) -> None:
    """Menu, add, remove: as everywhere in Blender."""
    row = layout.row(align=True)
    row.menu("SELENITE_MT_presets", text=SELENITE_MT_presets.bl_label)
    row.operator("selenite.add_preset", text="", icon="ADD")
    row.operator("selenite.add_preset", text="", icon="REMOVE").remove_active = True


CLASSES = (SELENITE_MT_presets, SELENITE_OT_add_preset)
