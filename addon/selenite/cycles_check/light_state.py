# SPDX-License-Identifier: GPL-3.0-or-later
"""The light state of a photo in a Blender scene, as Cycles is to render it. The file is changed:
the check renders a copy."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

import bpy
import mathutils
import numpy as np

from ..scene_read.reading.render_depsgraph import view_layer_of
from ..scene_read.view_layers import world_of

if TYPE_CHECKING:
    from ..capture.light_states import LightState

_BLACK = "Selenite black world"


@contextmanager
def under_lights(scene: bpy.types.Scene, lights: LightState) -> Iterator[None]:
    """Lamps are hidden from renders, stand elsewhere, and the world is black as `lights` says (see
    capture.light_states.light_state). All is as before afterwards, but for what moved
    lamps."""
    with ExitStack() as stack:
        lamps = [item for item in scene.objects if item.type == "LIGHT"]
        lamps += [item for item in bpy.data.objects if item.type == "LIGHT" and item not in lamps]
        if lights["lamps"] is not None:
            for item in lamps:
                if item.name not in lights["lamps"] and not item.hide_render:
                    _free(item, "hide_render")
                    item.hide_render = True
                    stack.callback(setattr, item, "hide_render", False)
        for item in lamps:
            if item.name in lights["places"]:
                before = _move(item, lights["places"][item.name][0])
                stack.callback(setattr, item, "matrix_world", before)
        if not lights["world"]:
            _darken(scene, stack)
        view_layer_of(scene).update()
        yield
    view_layer_of(scene).update()


def _free(item: bpy.types.Object, path: str) -> None:
    """Keyframes and drivers would set the property again at the render."""
    if item.animation_data is None:
        return
    for curve in [curve for curve in item.animation_data.drivers if curve.data_path == path]:
        item.driver_remove(curve.data_path)
    if item.animation_data.action is not None:
        item.animation_data.action = None


def _move(item: bpy.types.Object, matrix: np.ndarray) -> mathutils.Matrix:
    """Puts a lamp somewhere; nothing else moves it any more. Returns where it stood."""
    before = item.matrix_world.copy()
    item.animation_data_clear()
    item.constraints.clear()
    item.parent = None
    item.matrix_world = mathutils.Matrix(matrix.tolist())
    return before


def _darken(scene: bpy.types.Scene, stack: ExitStack) -> None:
    """Takes a black world in place of the one that renders."""
    layer = view_layer_of(scene)
    before = world_of(scene, layer)
    if before is None:
        return
    black = before.copy()  # with its settings
    black.name = _BLACK
    black.use_nodes = False
    black.color = (0.0, 0.0, 0.0)
    owner, name = (scene, "world") if before == scene.world else (layer, "world_override")
    setattr(owner, name, black)
    stack.callback(bpy.data.worlds.remove, black)
    stack.callback(setattr, owner, name, before)
