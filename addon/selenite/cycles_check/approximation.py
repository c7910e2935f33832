# SPDX-License-Identifier: GPL-3.0-or-later
"""How far pictures of a scene with approximated materials are from those of Cycles.

The work of another process: see `scene_read.baking.approximated`, which asks for it.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np

from .. import native
from ..scene_read.blend_file import open_blend
from ..scene_read.build import build
from ..scene_read.options import ReadingOptions
from ..scene_read.scene import read_scene
from .render import render

if TYPE_CHECKING:
    from ..scene_read.baking.approximated import ComparisonRequest, Difference

#: Pixels along the longer side of the picture, and along a side of a block.
SIDE, BLOCK = 128, 8
_SAMPLES = 128


def run(
    folder: Path, request: ComparisonRequest, note: Callable[[float, str], None]
) -> Difference | dict[str, object]:
    """Keys camera, mean and worst: differences relative to the mean of the picture by Cycles."""
    note(0.0, "comparing the approximation with Cycles")
    open_blend(str(folder / "scene.blend"), scripts=request["scripts"])
    scene = bpy.data.scenes[request["scene"]]
    if bpy.context.window is not None:
        bpy.context.window.scene = scene
    options = ReadingOptions.from_json(request["options"])
    read = read_scene(scene, surveys=False, options=options)
    cameras = {camera.name: camera for camera in read.cameras}
    active = scene.camera.name if scene.camera is not None else ""
    if not cameras:
        return {}
    camera = cameras.get(active) or next(iter(cameras.values()))
    aspect = camera.aspect
    size = (SIDE, max(BLOCK, round(SIDE / aspect)))
    if aspect < 1:
        size = (max(BLOCK, round(SIDE * aspect)), SIDE)
    film = native.core().render(build(read), camera.name, *size, _SAMPLES)
    cycles = render(scene, camera.name, size, _SAMPLES, 1, folder / "cycles.exr")
    mean, worst = difference(np.asarray(film.image), cycles)
    return {"camera": camera.name, "mean": mean, "worst": worst}


def difference(ours: np.ndarray, cycles: np.ndarray) -> tuple[float, float]:
    """Mean and worst absolute difference of blocks, relative to the mean of `cycles`."""
    rows, columns = (size // BLOCK * BLOCK for size in cycles.shape[:2])
    shape = (rows // BLOCK, BLOCK, columns // BLOCK, BLOCK, 3)
    blocks = [
        np.asarray(item, np.float64)[:rows, :columns].reshape(shape).mean(axis=(1, 3))
        for item in (ours, cycles)
    ]
    apart = np.abs(blocks[0] - blocks[1]) / max(float(np.mean(cycles)), 1e-30)
    return float(apart.mean()), float(apart.mean(axis=2).max())
