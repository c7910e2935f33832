# SPDX-License-Identifier: GPL-3.0-or-later
"""The bright spots of an environment as suns, and the image without them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from . import sphere

#: A spot is what is brighter than so many means over the sphere and joins.
_BRIGHT = 3.0
#: Rows of the grid on which an interpolated spot is integrated, at least.
_FINE_ROWS = 256
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@dataclass(frozen=True)
class Sun:
    """A far lamp. direction: unit vector towards it, in the frame of the image. irradiance: of a
    surface that faces it, per channel, at strength 1. angle: its diameter in radians, never less
    than that of a texel shows."""

    direction: tuple[float, float, float]
    irradiance: tuple[float, float, float]
    angle: float


def suns(image: np.ndarray, most: int) -> tuple[list[Sun], np.ndarray]:
    """Up to `most` suns, the strongest first, and the image (h, w, 3) without their light.

    A surface that faces a sun gets as much light from it as it got from what is taken out of the
    image: the part of a spot above what is around it.
    """
    rest = image.astype(np.float64)
    average = float(np.dot(sphere.mean(image), _LUMINANCE))
    found: list[Sun] = []
    while len(found) < most:
        luminance = rest @ _LUMINANCE
        if not luminance.max() > _BRIGHT * average:
            break
        place = np.unravel_index(int(luminance.argmax()), luminance.shape)
        inside = _grown(luminance > _BRIGHT * average, place)
        around = _grown(inside, place, rings=1) & ~inside
        level = np.median(rest[around], axis=0) if around.any() else np.zeros(3)
        taken = np.where(inside[..., None], np.maximum(rest - level, 0), 0)
        found.append(_sun(taken))
        rest = rest - taken
    found.sort(key=lambda item: -float(np.dot(item.irradiance, _LUMINANCE)))
    return found, rest.astype(np.float32)


def _grown(mask: np.ndarray, place: tuple[np.intp, ...], rings: int = 0) -> np.ndarray:
    """(h, w) bool: what joins `place` in the mask, over the seam too; or the mask and so many
    rings around it."""
    found = mask.copy() if rings else np.zeros_like(mask)
    found[place] = True
    while True:
        wide = found.copy()
        wide[1:] |= found[:-1]
        wide[:-1] |= found[1:]
        wide |= np.roll(wide, 1, axis=1) | np.roll(wide, -1, axis=1)
        if rings:
            found, rings = wide, rings - 1
            if not rings:
                return found
            continue
        wide &= mask
        wide[place] = True
        if (wide == found).all():
            return found
        found = wide


def _sun(taken: np.ndarray) -> Sun:
    """Of an image that is black but for one spot, interpolated as in a render."""
    rows = max(_FINE_ROWS, taken.shape[0])
    d = sphere.directions(rows, 2 * rows)
    light = sphere.looked_up(taken, d) * sphere.solid_angles(rows, 2 * rows)[:, None, None]
    power = light @ _LUMINANCE
    vector = np.einsum("rc,rcx->x", power, d)
    direction = vector / np.linalg.norm(vector)
    cosine = np.clip(d @ direction, -1, 1)
    irradiance = np.einsum("rcx,rc->x", light, np.maximum(cosine, 0))
    # Of an even disc the mean square of the distance to its middle is half that of its radius.
    spread = float((power * np.arccos(cosine) ** 2).sum() / power.sum())
    angle = min(2 * math.sqrt(2 * spread), math.pi)
    x, y, z = (float(value) for value in direction)
    red, green, blue = (float(value) for value in irradiance)
    return Sun((x, y, z), (red, green, blue), angle)
