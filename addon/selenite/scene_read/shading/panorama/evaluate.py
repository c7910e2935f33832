# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles renders what a world shows in each direction, in a scene of its own."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from .... import native
from ...reading.render_depsgraph import remove_new_pictures, without_handlers
from ...reading.without_words import without_words
from ...values import SunValues
from ..nodes import Output, Source, Unreadable
from . import fingerprint, suns
from .copies import WorldCopy
from .rays import Rays
from .sizes import is_detailed, reduced

_NAME = "Selenite evaluates this world"
#: Width and height of a panorama; of one with details that this leaves out.
SIZE, DETAILED = (2048, 1024), (4096, 2048)
#: Samples of a pixel, anywhere in it, where there are details. Else its middle is enough.
_DETAILED_SAMPLES = 4
_MIDDLE = 0.01  # width of the filter in pixels, the smallest in Cycles
_DISC_PIXELS, _DISC_SAMPLES = 64, 64
_SETTINGS = {
    "use_adaptive_sampling": False,
    "use_denoising": False,
    "pixel_filter_type": "BOX",
    "sample_clamp_direct": 0.0,
    "sample_clamp_indirect": 0.0,
    "device": "CPU",
    "film_exposure": 1.0,
}


@dataclass(frozen=True, eq=False)
class Panorama:
    """What rays see: pixels (h, w, 3) float32, linear, row 0 at the top, centre column +X; and the
    disc of a sun, which adds to it."""

    pixels: np.ndarray
    sun: SunValues | None = None
    #: That Cycles has rendered. `pixels` may be fewer where they hold the same.
    size: tuple[int, int] = SIZE


@dataclass
class _Cache:
    """Of the last world: a panorama takes up to 100 MB."""

    key: str = ""
    found: dict[str, Panorama] = field(default_factory=dict)


_cache = _Cache()


def evaluate(
    scene: bpy.types.Scene,
    world: bpy.types.World,
    wanted: Sequence[tuple[Rays, Source | None]],
    output: Output,
    title: str,
) -> dict[str, Panorama]:
    """A panorama by name of the rays that see it. Raises Unreadable.

    wanted: rays, and the shader whose Strength is 1 in their panorama (or None). Nothing in the
    file changes. Blender must not be busy with a render.
    """
    key = fingerprint.of_world(world, scene)
    if key != _cache.key:
        _cache.key, _cache.found = key, {}
    for rays, background in wanted:
        name = f"{rays.name} {background is not None}"
        if name not in _cache.found:
            disc = suns.find(output, rays, title)
            _cache.found[name] = _evaluate(scene, world, rays, background, disc, title)
    return {
        rays.name: _cache.found[f"{rays.name} {background is not None}"]
        for rays, background in wanted
    }


def _evaluate(
    scene: bpy.types.Scene,
    world: bpy.types.World,
    rays: Rays,
    background: Source | None,
    disc: suns.Disc | None,
    title: str,
) -> Panorama:
    with ExitStack() as stack:
        copied = WorldCopy(world, stack)
        copied.show_as_to(rays)
        if background is not None:
            copied.set_strength(background, 1.0)
        studio = stack.enter_context(_studio(scene, copied.world, title))
        sun = None
        if disc is not None:
            seen = studio.towards(disc)
            copied.set_discs(False)
            picture = np.maximum(seen - studio.towards(disc), 0)
            if picture.any():
                sun = SunValues(disc.axis, disc.up, disc.radius, picture)
        size = SIZE
        pixels = studio.panorama(size, 1, _MIDDLE)
        if is_detailed(pixels):
            size = DETAILED
            pixels = studio.panorama(size, _DETAILED_SAMPLES, 1.0)
    return Panorama(reduced(pixels), sun, size)


class _Studio:
    """A scene with a world, a camera and nothing else."""

    def __init__(self, scene: bpy.types.Scene, camera: bpy.types.Object, path: Path) -> None:
        self._scene, self._camera, self._path = scene, camera, path

    def panorama(self, size: tuple[int, int], samples: int, width: float) -> np.ndarray:
        """The whole sphere; width: that of the pixel filter."""
        data = self._camera.data
        assert isinstance(data, bpy.types.Camera)  # noqa: S101 - as `_studio` gives it
        data.type = "PANO"
        # The property has moved to the camera itself in 5.0.
        holder = data if hasattr(data, "panorama_type") else data.cycles  # type: ignore[attr-defined]
        holder.panorama_type = "EQUIRECTANGULAR"
        self._camera.rotation_euler = (math.pi / 2, 0, -math.pi / 2)
        return self._render(size, samples, width)

    def towards(self, disc: suns.Disc) -> np.ndarray:
        """A square picture of all within the radius of a disc."""
        data = self._camera.data
        assert isinstance(data, bpy.types.Camera)  # noqa: S101 - as `_studio` gives it
        data.type = "PERSP"
        data.sensor_fit, data.sensor_width = "HORIZONTAL", 1.0
        data.lens = 0.5 / math.tan(disc.radius)
        axes = np.stack([np.cross(disc.axis, disc.up), disc.up, -disc.axis], 1)
        self._camera.rotation_euler = Matrix(axes.tolist()).to_euler()
        return self._render((_DISC_PIXELS, _DISC_PIXELS), _DISC_SAMPLES, 1.0)

    def _render(self, size: tuple[int, int], samples: int, width: float) -> np.ndarray:
        render = self._scene.render
        render.resolution_x, render.resolution_y = size
        self._scene.cycles.samples, self._scene.cycles.filter_width = samples, width
        with without_words():
            bpy.ops.render.render(write_still=True, scene=self._scene.name)
        pixels: np.ndarray = native.image().read(str(self._path))[0]
        return pixels


@contextmanager
def _studio(scene: bpy.types.Scene, world: bpy.types.World, title: str) -> Iterator[_Studio]:
    known = {item for item in bpy.data.images if item.type == "RENDER_RESULT"}
    with ExitStack() as stack:
        stack.enter_context(without_handlers())
        stack.callback(remove_new_pictures, known)
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="selenite-world-"))
        path = Path(folder) / "world.exr"
        made = bpy.data.scenes.new(_NAME)
        stack.callback(bpy.data.scenes.remove, made)
        data = bpy.data.cameras.new(_NAME)
        stack.callback(bpy.data.cameras.remove, data)  # and the object that has it
        camera = bpy.data.objects.new(_NAME, data)
        made.collection.objects.link(camera)
        made.camera, made.world = camera, world
        made.frame_set(scene.frame_current, subframe=scene.frame_subframe)
        try:
            made.render.engine = "CYCLES"  # type: ignore[assignment]
        except TypeError as error:
            cause = "its nodes can be evaluated by Cycles alone, which is switched off"
            cure = "switch on the add-on Cycles Render Engine in the preferences"
            raise Unreadable(title, cause, cure) from error
        for name, value in _SETTINGS.items():
            if hasattr(made.cycles, name):
                setattr(made.cycles, name, value)
        made.render.resolution_percentage = 100
        made.render.use_compositing = made.render.use_sequencer = False
        image = made.render.image_settings
        image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "32"
        made.render.use_file_extension = False
        made.render.filepath = str(path)
        yield _Studio(made, camera, path)
