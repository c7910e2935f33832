# SPDX-License-Identifier: GPL-3.0-or-later
"""How many pixels a panorama needs."""

from __future__ import annotations

import numpy as np

#: Mean error of a pixel that is taken for the mean of its neighbours, in units of the mean: above
#: it a panorama has details between its pixels.
DETAIL = 0.02
#: Largest error of a panorama with half as many columns and rows, in units of the mean, at which
#: the half is enough.
SMOOTH = 0.005
_SMALLEST = 64  # columns


def is_detailed(pixels: np.ndarray) -> bool:
    """Whether neighbours tell little of the pixel between them; pixels (h, w, 3)."""
    mean = float(np.abs(pixels).mean())
    between = (np.roll(pixels, 1, axis=1) + np.roll(pixels, -1, axis=1)) / 2
    return mean > 0 and float(np.abs(pixels - between).mean()) > DETAIL * mean


def reduced(pixels: np.ndarray) -> np.ndarray:
    """The smallest panorama that shows the same, one pixel if it is even."""
    if (pixels == pixels[:1, :1]).all():
        return np.ascontiguousarray(pixels[:1, :1])
    limit = SMOOTH * float(np.abs(pixels).mean())
    while pixels.shape[1] >= 2 * _SMALLEST:
        h, w = pixels.shape[:2]
        half = pixels.reshape(h // 2, 2, w // 2, 2, 3).mean((1, 3), dtype=np.float64)
        half = half.astype(np.float32)
        if np.abs(_doubled(half) - pixels).max() > limit:
            break
        pixels = half
    return np.ascontiguousarray(pixels)


def _doubled(half: np.ndarray) -> np.ndarray:
    """As a lookup between pixels shows it: columns repeat, rows end."""
    above = np.concatenate([half[:1], half[:-1]])
    below = np.concatenate([half[1:], half[-1:]])
    rows = np.stack([0.75 * half + 0.25 * above, 0.75 * half + 0.25 * below], 1)
    rows = rows.reshape(2 * half.shape[0], *half.shape[1:])
    left, right = np.roll(rows, 1, axis=1), np.roll(rows, -1, axis=1)
    both = np.stack([0.75 * rows + 0.25 * left, 0.75 * rows + 0.25 * right], 2)
    return both.reshape(rows.shape[0], 2 * rows.shape[1], 3)
