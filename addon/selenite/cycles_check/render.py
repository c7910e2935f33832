# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures that Cycles renders of the open file. The file is changed: see `render_settings`.

Whoever wants a scene left as it is renders a copy, in a process of its own: see `job`.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np

from .. import native
from ..scene_read.camera import named_cameras
from ..scene_read.reading.render_depsgraph import view_layer_of
from ..scene_read.reading.without_words import without_words
from ..scene_read.values import CameraValues
from .compare import Estimate
from .render_settings import set_comparison


def render(
    scene: bpy.types.Scene,
    camera: str | CameraValues,
    size: tuple[int, int],
    samples: int,
    seed: int,
    path: Path,
    pixel_aspect: float | None = None,
) -> np.ndarray:
    """One render in comparison settings as (h, w, 3) float32, linear; left in `path` (OpenEXR).

    size: (width, height). pixel_aspect: width / height of a pixel; None: the scene's. camera: its
    name, or values whose lens takes the place of its own: that of a photo which is cropped.
    """
    set_comparison(scene, samples, seed)
    for marker in scene.timeline_markers:  # a camera bound to a marker would win
        marker.camera = None
    name = camera if isinstance(camera, str) else camera.name
    scene.camera = named_cameras(scene)[name]
    if not any(layer.use for layer in scene.view_layers):  # without one, Blender ends by a signal
        view_layer_of(scene).use = True
    if not isinstance(camera, str):
        _set_lens(scene.camera.data, camera)  # type: ignore[arg-type]
    scene.render.resolution_x, scene.render.resolution_y = size
    if pixel_aspect is not None:  # both sides are at least 1 in Blender
        scene.render.pixel_aspect_x = max(pixel_aspect, 1)
        scene.render.pixel_aspect_y = max(1 / pixel_aspect, 1)
    image = scene.render.image_settings
    image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "32"
    scene.render.use_file_extension = False
    scene.render.filepath = str(path)
    with without_words():
        bpy.ops.render.render(write_still=True, scene=scene.name)
    pixels: np.ndarray = native.image().read(str(path))[0]
    return pixels


def _set_lens(data: bpy.types.Camera, values: CameraValues) -> None:
    data.animation_data_clear()  # it would win
    data.sensor_fit = values.sensor_fit  # type: ignore[assignment]
    data.sensor_width, data.sensor_height = values.sensor_width, values.sensor_height
    data.lens, data.ortho_scale = values.lens_mm, values.ortho_scale
    data.shift_x, data.shift_y = values.shift_x, values.shift_y


def estimate(
    scene: bpy.types.Scene,
    camera: str | CameraValues,
    size: tuple[int, int],
    samples: int,
    seeds: range,
    path: Path,
    progress: Callable[[float], None] = lambda _fraction: None,
    pixel_aspect: float | None = None,
) -> Estimate:
    """Mean of several seeds with `samples` each, and its variance from their differences."""
    pictures = []
    for index, seed in enumerate(seeds):
        progress(index / len(seeds))
        pictures.append(render(scene, camera, size, samples, seed, path, pixel_aspect))
    path.unlink()
    return Estimate.of_seeds(pictures)
