# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras: position, lens, sensor, shift, clipping; size and pixel aspect of the render."""

from __future__ import annotations

import bpy
import numpy as np

from ..messages import remark, thing
from ..problems import Problem
from .camera_lens import lens_of
from .values import CameraValues, SceneValues


def resolution(scene: bpy.types.Scene) -> tuple[int, int]:
    """(width, height) of the render settings in pixels, percentage applied: whole numbers divided
    as Blender divides them, without the error of a decimal fraction."""
    render = scene.render
    percentage = render.resolution_percentage
    return render.resolution_x * percentage // 100, render.resolution_y * percentage // 100


def named_cameras(scene: bpy.types.Scene) -> dict[str, bpy.types.Object]:
    """Every camera of the scene, hidden ones too, under a name of its own: where a library has one
    of the same name, that one is called "Name (path of the library)"."""
    order = {item: i for i, item in enumerate(scene.objects) if item.type == "CAMERA"}
    found: dict[str, bpy.types.Object] = {}
    for item in sorted(order, key=lambda item: item.library is not None):
        library = f" ({item.library.filepath})" if item.library is not None else ""
        found[f"{item.name}{library}" if item.name in found else item.name] = item
    return dict(sorted(found.items(), key=lambda pair: order[pair[1]]))


def why_unusable(camera: bpy.types.Object) -> str:
    """Why this evaluated camera cannot be rendered; empty if it can."""
    if not camera.is_evaluated or camera.hide_render:
        return "its Disable in Renders is animated, and on at this frame; show it"
    if camera.data.type not in {"PERSP", "ORTHO"}:
        return f"it is {camera.data.type.lower()}; only perspective and orthographic are rendered"
    matrix = np.array(camera.matrix_world, np.float64)
    if not np.isfinite(matrix).all() or abs(np.linalg.det(matrix[:3, :3])) < 1e-30:
        return "its matrix is singular; clear its scale"
    return ""


def read_camera(evaluated: bpy.types.Object, name: str, scene: bpy.types.Scene) -> CameraValues:
    """Reads an evaluated camera that is usable. The object's scale is removed, as Cycles does."""
    data = evaluated.data
    matrix = np.array(evaluated.matrix_world, np.float64)
    matrix[:3, :3] /= np.linalg.norm(matrix[:3, :3], axis=0)
    width, height = resolution(scene)
    return CameraValues(
        name=name,
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
        lens=lens_of(data),
    )


def read_cameras(
    scene: bpy.types.Scene,
    found: dict[str, bpy.types.Object],
    depsgraph: bpy.types.Depsgraph,
    read: SceneValues,
) -> None:
    """Fills `read` with those of `found`, by name, that a fit can use, and says why others not."""
    for name, item in found.items():
        evaluated = item.evaluated_get(depsgraph)
        reason = why_unusable(evaluated)
        if reason:
            read.unusable_cameras[name] = reason
            read.warn(remark(thing("Camera", name), f"is left out: {reason}", " "))
            continue
        read.cameras.append(read_camera(evaluated, name, scene))
    if not found:
        cure = "add a camera that stands where the photo was taken"
        read.camera_problems.append(Problem(thing("Scene", scene.name), "it has no camera", cure))
    elif not read.cameras:
        cure = "make it perspective or orthographic"
        read.camera_problems.extend(
            Problem(thing("Camera", name), reason, cure)
            for name, reason in read.unusable_cameras.items()
        )
    read.problems.extend(read.camera_problems)
