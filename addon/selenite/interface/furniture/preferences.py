# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user sets once for all scenes."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty

from .icon import icon_id
from .preset_items import PRESET_ITEMS

#: The add-on as Blender calls it: bl_ext.<repository>.selenite where it is an extension.
ADDON = __package__.rpartition(".interface")[0]


@dataclass(frozen=True)
class Defaults:
    """What holds where Blender does not list the add-on, as in tests and on the command line."""

    threads: int = 0
    output: str = ""
    preset: str = "balanced"
    pictures: bool = True


class SelenitePreferences(bpy.types.AddonPreferences):
    """In Edit > Preferences > Add-ons."""

    bl_idname = ADDON

    threads: IntProperty(
        name="Threads",
        default=0,
        min=0,
        soft_max=64,
        description="Threads of a fit in scenes that do not say otherwise; 0 uses all",
    )
    output: StringProperty(
        name="Output Folder",
        subtype="DIR_PATH",
        description="Where results go; empty: beside the file, or for a file that was never saved "
        "into the folder Selenite of your documents",
    )
    preset: EnumProperty(
        name="Quality",
        items=PRESET_ITEMS,
        default="balanced",
        description="Quality of the first fit in a scene",
    )

    pictures: BoolProperty(
        name="Pictures at Start",
        default=True,
        description="Open photo, render and plots beside the 3D View when a fit starts",
    )

    def draw(self, _context: bpy.types.Context) -> None:
        """One column, and the links."""
        column = self.layout.column()
        column.use_property_split = True
        for name in ("threads", "output", "preset", "pictures"):
            column.prop(self, name)
        row = self.layout.row()
        if icon_id():
            row.label(text="", icon_value=icon_id())
        row.operator("selenite.open_manual", icon="HELP")
        row.operator("selenite.report_bug", icon="URL")


def preferences() -> SelenitePreferences | Defaults:
    """The user's, or the defaults where there are none."""
    addon: bpy.types.Addon | None = bpy.context.preferences.addons.get(ADDON)
    found = addon.preferences if addon is not None else None
    return found if isinstance(found, SelenitePreferences) else Defaults()


CLASSES = (SelenitePreferences,)
