# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of render settings in words."""

from __future__ import annotations

import bpy

#: An engine of Blender's own that is neither a class nor among the words of the property.
_WORKBENCH = {"BLENDER_WORKBENCH": "Workbench"}


def setting_text(scene: bpy.types.Scene, path: str, value: object) -> str:
    """As Blender's own panels show it."""
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, (int, float)):
        return f"{value:g}"
    owner_path, _, name = path.rpartition(".")
    kind = scene.path_resolve(owner_path).bl_rna.properties[name]
    words = {item.identifier: item.name for item in getattr(kind, "enum_items", ())}
    if name == "engine":
        words |= _WORKBENCH | _engines()
    return words.get(value, str(value))


def _engines() -> dict[str, str]:
    """Those of add-ons, Cycles among them, are classes."""
    classes = bpy.types.RenderEngine.__subclasses__()
    return {item.bl_idname: item.bl_label for item in classes if hasattr(item, "bl_idname")}
