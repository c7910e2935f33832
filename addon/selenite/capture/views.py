# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos beside their renders, and filters of pictures and masks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view


@dataclass(frozen=True)
class View:
    """A photo and its newest render: (h, w, 3) linear; weight (h, w), 0 where it is masked."""

    id: str
    reference: np.ndarray
    weight: np.ndarray
    picture: np.ndarray


def blurred(picture: np.ndarray, reach: int = 1) -> np.ndarray:
    """Mean over squares of 2 `reach` + 1 pixels, of (h, w) or (h, w, channels); the outermost
    repeat."""
    found = picture.astype(float)
    for axis in (0, 1):
        width = [(reach, reach) if at == axis else (0, 0) for at in range(found.ndim)]
        windows = sliding_window_view(np.pad(found, width, mode="edge"), 2 * reach + 1, axis)
        found = windows.mean(axis=-1)
    return found


def eroded(mask: np.ndarray, pixels: int) -> np.ndarray:
    """Without what lies within `pixels` of a pixel that is not in it; the picture's border does
    not count as outside."""
    for _ in range(pixels):
        padded = np.pad(mask, 1, mode="edge")
        mask = mask & padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:]
    return mask.copy()
