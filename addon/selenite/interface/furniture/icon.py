# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's icon: a crystal, drawn by computation."""

from __future__ import annotations

import bpy.utils.previews
import numpy as np

_SIZE = 32
_NAME = "selenite"
_FACES = ((0.62, 0.78, 0.95), (0.36, 0.55, 0.84), (0.86, 0.93, 1.0))
_PREVIEWS: list[bpy.utils.previews.ImagePreviewCollection] = []


def register() -> None:
    """Makes the icon; without a window Blender has no use for it."""
    if bpy.app.background:
        return
    previews = bpy.utils.previews.new()
    picture = previews.new(_NAME)
    picture.icon_size = picture.image_size = (_SIZE, _SIZE)
    pixels = drawn().ravel()
    picture.icon_pixels_float = picture.image_pixels_float = pixels.tolist()
    _PREVIEWS.append(previews)


def unregister() -> None:
    """The inverse."""
    while _PREVIEWS:
        bpy.utils.previews.remove(_PREVIEWS.pop())


def icon_id() -> int:
    """For `icon_value`; 0 for none."""
    return int(_PREVIEWS[0][_NAME].icon_id) if _PREVIEWS else 0


def drawn() -> np.ndarray:
    """(32, 32, 4), the lowest row first: a hexagonal prism with a slanted top."""
    y, x = np.mgrid[0:_SIZE, 0:_SIZE] / (_SIZE - 1) * 2 - 1
    inside = (np.abs(x) < 0.62) & (y > -0.85 + 0.5 * np.abs(x)) & (y < 0.92 - 0.55 * np.abs(x))
    top = y > 0.38 + 0.3 * np.abs(x)
    face = np.where(top, 2, np.where(x < -0.08, 0, 1))
    found = np.zeros((_SIZE, _SIZE, 4), np.float32)
    found[..., :3] = np.array(_FACES)[face]
    found[..., 3] = inside
    return found
