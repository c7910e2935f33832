# SPDX-License-Identifier: GPL-3.0-or-later
"""What the view layer puts into a render."""

from __future__ import annotations

import bpy


def world_of(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> bpy.types.World | None:
    """The world that a view layer renders: its override, or none where it leaves the sky out."""
    if not layer.use_sky:
        return None
    return getattr(layer, "world_override", None) or scene.world


def worlds(scene: bpy.types.Scene) -> list[bpy.types.World]:
    """Those that a view layer of the scene may render."""
    found = [getattr(layer, "world_override", None) for layer in scene.view_layers]
    return [item for item in (scene.world, *found) if item is not None]
