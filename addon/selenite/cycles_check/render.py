# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures that Cycles renders of the open file. The file is changed: see `render_settings`.

Whoever wants a scene left as it is renders a copy, in a process of its own: see `job`.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np

from .. import native
from .compare import Estimate
from .render_settings import set_comparison


@contextmanager
def without_words() -> Iterator[None]:
    """Keeps from the terminal the lines that Blender prints at each step of a render: it writes
    them past Python's sys.stdout."""
    sys.stdout.flush()
    kept, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)


def render(
    scene: bpy.types.Scene, camera: str, size: tuple[int, int], samples: int, seed: int, path: Path
) -> np.ndarray:
    """One render in comparison settings as (h, w, 3) float32, linear; left in `path` (OpenEXR).

    size: (width, height).
    """
    set_comparison(scene, samples, seed)
    for marker in scene.timeline_markers:  # a camera bound to a marker would win
        marker.camera = None
    scene.camera = scene.objects[camera]
    scene.render.resolution_x, scene.render.resolution_y = size
    image = scene.render.image_settings
    image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "32"
    scene.render.use_file_extension = False
    scene.render.filepath = str(path)
    with without_words():
        bpy.ops.render.render(write_still=True, scene=scene.name)
    pixels: np.ndarray = native.image().read(str(path))[0]
    return pixels


def estimate(
    scene: bpy.types.Scene,
    camera: str,
    size: tuple[int, int],
    samples: int,
    seeds: range,
    path: Path,
    progress: Callable[[float], None] = lambda _fraction: None,
) -> Estimate:
    """Mean of several seeds with `samples` each, and its variance from their differences."""
    pictures = []
    for index, seed in enumerate(seeds):
        progress(index / len(seeds))
        pictures.append(render(scene, camera, size, samples, seed, path))
    path.unlink()
    return Estimate.of_seeds(pictures)
