# SPDX-License-Identifier: GPL-3.0-or-later
"""A camera in a copy of the file, shifted and rolled as a fit has aligned a photo.

Source of the signs: native/fit/photo/camera_alignment.cpp, which does the same natively.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import bpy
import mathutils

from ..capture.prepared import UNALIGNED, Capture
from ..scene_read.camera import named_cameras
from ..scene_read.reading.render_depsgraph import view_layer_of

if TYPE_CHECKING:
    from ..scene_read.hosts import BpyStruct


def moved_window(capture: Capture) -> tuple[float, float, float, float]:
    """What the photo shows of what its camera takes (left, top, right, bottom; see Capture), moved
    by its alignment. Some of it may lie outside of [0, 1]."""
    if capture.alignment == UNALIGNED:
        return capture.window
    left, top, right, bottom = capture.window
    height, width = capture.reference.shape[:2]
    across, down, _ = capture.alignment
    x, y = across / width * (right - left), down / height * (bottom - top)
    return (left + x, top + y, right + x, bottom + y)


@contextmanager
def rolled(scene: bpy.types.Scene, camera: str, roll: float) -> Iterator[None]:
    """The camera of that name turned by `roll` radians about its axis; nothing else moves it any
    more. All is as before afterwards, but for that."""
    if roll == 0:
        yield
        return
    item: BpyStruct = named_cameras(scene)[camera]
    before = item.matrix_world.copy()
    item.animation_data_clear()
    item.constraints.clear()
    item.parent = None
    item.matrix_world = before @ mathutils.Matrix.Rotation(roll, 4, "Z")
    view_layer_of(scene).update()
    try:
        yield
    finally:
        item.matrix_world = before
        view_layer_of(scene).update()
