# SPDX-License-Identifier: GPL-3.0-or-later
"""Image datablocks that show what was drawn, and the Image Editors that show them.

They are no part of the user's work: `put_away` takes them out of a file that is being saved.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...scene_read.blender_process import DRAWN

if TYPE_CHECKING:
    from ...scene_read.hosts import BpyStruct

COMPARISON, PLOTS, SHEET, CYCLES = (
    "Selenite Comparison", "Selenite Plots", "Selenite All Photos", "Selenite Check in Cycles",
)  # fmt: skip
#: Pixels of an Image Editor that its picture leaves free: headers and tools lie over them.
_AROUND = (24, 64)
NAMES = {"COMPARISON": COMPARISON, "PLOTS": PLOTS, "SHEET": SHEET, "CYCLES": CYCLES}


def editors() -> Iterator[tuple[bpy.types.Window, bpy.types.Area]]:
    """Every Image Editor of every window."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "IMAGE_EDITOR":
                yield window, area


def window_region(area: bpy.types.Area) -> bpy.types.Region | None:
    """The part of an editor that is no header and no sidebar."""
    return next((item for item in area.regions if item.type == "WINDOW"), None)


def image_of(area: bpy.types.Area) -> bpy.types.Image | None:
    """What an Image Editor shows."""
    space: BpyStruct = area.spaces.active
    found: bpy.types.Image | None = space.image
    return found


def shown_names() -> set[str]:
    """Those of our images that some Image Editor shows."""
    found = {image.name for _, area in editors() if (image := image_of(area)) is not None}
    return found & set(NAMES.values())


def show(name: str, picture: np.ndarray, *, is_float: bool = False) -> bpy.types.Image:
    """Puts a picture (h, w, 3), row 0 at the top, into the image of that name. is_float: it is
    linear light, else encoded."""
    image, _ = put(name, picture, is_float=is_float)
    image[DRAWN] = True
    for _, area in editors():
        if image_of(area) == image:
            area.tag_redraw()
    return image


def put(
    name: str, picture: np.ndarray, *, is_float: bool = False
) -> tuple[bpy.types.Image, np.ndarray]:
    """As `show`, without the mark of what was drawn. Also returns all its numbers in Blender's
    order, for a preview."""
    image = _sized(name, picture.shape[1], picture.shape[0], is_float=is_float)
    pixels = np.ones((*picture.shape[:2], 4), np.float32)
    pixels[..., :3] = picture[::-1]
    into: BpyStruct = image.pixels  # a bpy_prop_array, which the stubs call a number
    into.foreach_set(pixels.ravel())
    image.update()
    return image, pixels.ravel()


def _sized(name: str, width: int, height: int, *, is_float: bool = False) -> bpy.types.Image:
    image: bpy.types.Image | None = bpy.data.images.get(name)
    if image is None:
        image = bpy.data.images.new(name, width, height, float_buffer=is_float)
    elif tuple(image.size) != (width, height):
        image.scale(width, height)
    return image


def assign(area: bpy.types.Area, name: str) -> None:
    """Makes an Image Editor show one of the images, as large as fits."""
    image: bpy.types.Image | None = bpy.data.images.get(name)
    if image is None:
        image = _sized(name, 64, 64)
        image[DRAWN] = True
    space: BpyStruct = area.spaces.active
    space.image = image


def room_of(name: str) -> tuple[int, int] | None:
    """Width and height of the picture that the first editor that shows it has room for; None where
    that is not known."""
    scale = bpy.context.preferences.system.pixel_size
    for _, area in editors():
        image = image_of(area)
        if image is not None and image.name == name:
            region = window_region(area)
            if region is not None and min(region.width, region.height) > 80:
                width, height = region.width - _AROUND[0], region.height - _AROUND[1]
                return int(width / scale), int(height / scale)
    return None


def fit(window: bpy.types.Window, area: bpy.types.Area, *, whole: bool) -> None:
    """Zooms an Image Editor to its picture; not whole: to its own pixels, where it fits."""
    region = window_region(area)
    if region is None or region.width < 2:
        return
    with bpy.context.temp_override(window=window, area=area, region=region):
        view_all: BpyStruct = bpy.ops.image.view_all  # the stubs have another signature for `poll`
        if view_all.poll():
            view_all(fit_view=whole)


def put_away() -> None:
    """Removes all of them."""
    for name in NAMES.values():
        image: bpy.types.Image | None = bpy.data.images.get(name)
        if image is not None and image.get(DRAWN):
            bpy.data.images.remove(image)
