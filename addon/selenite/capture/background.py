# SPDX-License-Identifier: GPL-3.0-or-later
"""The background of a photo, by its colour: what joins the border, or all that has a given one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import native

BORDER = "border"
#: Largest difference in a channel, in sRGB code values from 0 to 1.
TOLERANCE = 0.05


@dataclass(frozen=True)
class Background:
    """color: linear Rec. 709; None: that of the photo's border, from which the background spreads
    as far as pixels differ by at most the tolerance from it."""

    color: tuple[float, float, float] | None
    tolerance: float = TOLERANCE

    @staticmethod
    def from_text(text: str) -> Background:
        """Of "border", "R,G,B", "border:0.1" or "R,G,B:0.1". Raises ValueError."""
        front, colon, after = text.partition(":")
        try:
            tolerance = float(after) if colon else TOLERANCE
        except ValueError:
            raise ValueError(f"its tolerance '{after}' is no number") from None
        if not 0 < tolerance <= 1:
            raise ValueError(f"its tolerance {tolerance:g} is not in (0, 1]")
        if front == BORDER:
            return Background(None, tolerance)
        try:
            red, green, blue = (float(part) for part in front.split(","))
        except ValueError:
            raise ValueError(f"it is '{text}', neither {BORDER} nor R,G,B") from None
        color = (red, green, blue)
        if not all(0 <= value <= 1e6 for value in color):
            raise ValueError("its colour has a channel that is below 0 or not finite")
        return Background(color, tolerance)

    def pixels(self, reference: np.ndarray) -> np.ndarray:
        """(h, w) bool of a photo (h, w, 3), linear."""
        code = _encoded(reference)
        if self.color is not None:
            return _near(code, _encoded(np.array(self.color, np.float32)), self.tolerance)
        rim = border(reference.shape[:2])
        near = _near(code, np.median(code[rim], axis=0), self.tolerance)
        return flooded(near & rim, near)


def _encoded(light: np.ndarray) -> np.ndarray:
    code: np.ndarray = native.image().srgb_encode(np.maximum(light, 0).astype(np.float32))
    return code


def _near(code: np.ndarray, color: np.ndarray, tolerance: float) -> np.ndarray:
    near: np.ndarray = (np.abs(code - color) <= tolerance).all(axis=-1)
    return near


def border(shape: tuple[int, ...]) -> np.ndarray:
    """(h, w) bool: the outermost pixels."""
    rim = np.zeros(shape[:2], bool)
    rim[[0, -1], :] = rim[:, [0, -1]] = True
    return rim


def flooded(seeds: np.ndarray, open_pixels: np.ndarray) -> np.ndarray:
    """(h, w) bool: open pixels that a path along sides of open ones joins with a seed."""
    region = seeds & open_pixels
    while True:
        before = int(region.sum())
        region = _along_rows(region, open_pixels)
        region = _along_rows(region.T, open_pixels.T).T
        if int(region.sum()) == before:
            return region


def _along_rows(region: np.ndarray, open_pixels: np.ndarray) -> np.ndarray:
    """Runs of open pixels in a row, of which one is in the region."""
    walled = np.pad(~open_pixels, ((0, 0), (0, 1)), constant_values=True)
    runs = np.cumsum(walled.ravel()).reshape(walled.shape)[:, :-1]
    reached = np.bincount(runs.ravel(), weights=region.ravel()) > 0
    found: np.ndarray = reached[runs] & open_pixels
    return found
