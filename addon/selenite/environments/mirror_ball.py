# SPDX-License-Identifier: GPL-3.0-or-later
"""A photo of a mirror ball -> an equirectangular image.

The photo is cropped to the ball, taken from afar, looking along +Y of the world with +Z upwards: as
Blender's own Environment Texture takes a mirror ball.
"""

from __future__ import annotations

import numpy as np

from . import sphere

#: Width over height of a crop that still is square.
_MOST_OBLONG = 1.02
#: Rows of the equirectangular image, at most: a photo of a ball shows no more.
_MOST_ROWS = 512


def why_not(picture: np.ndarray) -> str:
    """Why a picture (h, w, 3) is no crop of a ball; "" if it may be one."""
    height, width = picture.shape[:2]
    if max(height, width) > _MOST_OBLONG * min(height, width):
        return f"its {width} x {height} pixels are no square around the ball"
    return ""


def equirectangular(picture: np.ndarray) -> np.ndarray:
    """(rows, 2 rows, 3) float32 of a picture (h, w, 3), linear, row 0 at the top.

    What lies right behind the ball is on the ball's rim, of which a photo shows little. The middle
    shows the camera itself.
    """
    height, width = picture.shape[:2]
    rows = min(_MOST_ROWS, max(2, height // 2))
    d = sphere.directions(rows, 2 * rows)
    # The normal of the ball lies halfway between the direction and that towards the camera, -Y; a
    # distant camera sees its x and z as the place on the ball.
    half = d - np.array([0.0, 1.0, 0.0])
    length = np.linalg.norm(half, axis=-1)
    normal = half / np.maximum(length, 1e-12)[..., None]
    x = (0.5 + 0.5 * normal[..., 0]) * width - 0.5
    y = (0.5 - 0.5 * normal[..., 2]) * height - 0.5
    return sphere.interpolated(np.asarray(picture, np.float32), x, y, around=False)
