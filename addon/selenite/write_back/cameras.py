# SPDX-License-Identifier: GPL-3.0-or-later
"""A camera object where the next photo is to be taken."""

from __future__ import annotations

import bpy
import mathutils

from ..scene_read.camera import named_cameras
from ..scene_read.values import CameraValues


def add_camera(
    scene: bpy.types.Scene, name: str, like: str, values: CameraValues
) -> bpy.types.Object:
    """A new object of that name (or with Blender's number behind it) in the scene's own collection,
    at the place of `values`, with the lens and all other settings of the camera `like`. It has no
    photo, and no animation. The caller makes it one undo step. Raises KeyError: `like` is gone."""
    data = named_cameras(scene)[like].data.copy()
    data.name = name
    data.animation_data_clear()
    data.background_images.clear()
    data.show_background_images = False
    data.shift_x, data.shift_y = values.shift_x, values.shift_y
    camera = bpy.data.objects.new(name, data)
    camera.matrix_world = mathutils.Matrix(values.matrix.tolist())
    scene.collection.objects.link(camera)
    return camera
