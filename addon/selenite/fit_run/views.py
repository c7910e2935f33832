# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos beside their renders, and filters of pictures and masks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class View:
    """A photo and its newest render: (h, w, 3) linear; weight (h, w), 0 where it is masked."""

    id: str
    reference: np.ndarray
    weight: np.ndarray
    picture: np.ndarray


def blurred(picture: np.ndarray) -> np.ndarray:
    """Mean over 3 x 3 pixels; the outermost repeat."""
    padded = np.pad(picture.astype(float), ((1, 1), (1, 1), (0, 0)), mode="edge")
    height, width = picture.shape[:2]
    shifted = [padded[y : y + height, x : x + width] for y in range(3) for x in range(3)]
    return np.mean(shifted, axis=0)


def eroded(mask: np.ndarray, pixels: int) -> np.ndarray:
    """Without what lies within `pixels` of a pixel that is not in it; the picture's border does
    not count as outside."""
    for _ in range(pixels):
        padded = np.pad(mask, 1, mode="edge")
        mask = mask & padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:]
    return mask.copy()
