# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras: position, lens, sensor, shift, clipping; size and pixel aspect of the render."""

from __future__ import annotations

import bpy
import numpy as np

from .values import CameraValues


def resolution(scene: bpy.types.Scene) -> tuple[int, int]:
    """(width, height) of the render settings in pixels, percentage applied: whole numbers divided
    as Blender divides them, without the error of a decimal fraction."""
    render = scene.render
    percentage = render.resolution_percentage
    return render.resolution_x * percentage // 100, render.resolution_y * percentage // 100


def why_unusable(camera: bpy.types.Object) -> str:
    """Why this camera cannot be rendered; empty if it can."""
    if camera.data.type not in {"PERSP", "ORTHO"}:
        return f"it is {camera.data.type.lower()}; only perspective and orthographic are rendered"
    matrix = np.array(camera.matrix_world, np.float64)
    if not np.isfinite(matrix).all() or abs(np.linalg.det(matrix[:3, :3])) < 1e-30:
        return "its matrix is singular; clear its scale"
    return ""


def read_camera(
    camera: bpy.types.Object, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph
) -> CameraValues:
    """Reads a camera that is usable. The object's scale is removed, as Cycles does."""
    evaluated = camera.evaluated_get(depsgraph)
    data = evaluated.data
    matrix = np.array(evaluated.matrix_world, np.float64)
    matrix[:3, :3] /= np.linalg.norm(matrix[:3, :3], axis=0)
    width, height = resolution(scene)
    return CameraValues(
        name=camera.name,
        matrix=matrix,
        kind=data.type,
        lens_mm=data.lens,
        sensor_width=data.sensor_width,
        sensor_height=data.sensor_height,
        sensor_fit=data.sensor_fit,
        shift_x=data.shift_x,
        shift_y=data.shift_y,
        ortho_scale=data.ortho_scale,
        clip_start=data.clip_start,
        clip_end=data.clip_end,
        pixel_aspect_x=scene.render.pixel_aspect_x,
        pixel_aspect_y=scene.render.pixel_aspect_y,
        width=width,
        height=height,
    )
