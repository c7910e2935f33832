# SPDX-License-Identifier: GPL-3.0-or-later
"""An image as the native module takes it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class TextureValues:
    """An image: (h, w, 3) float32, or 4 with the alpha that the colours were multiplied by.

    `encoded`: sRGB code values, decoded after interpolation. `extension`, `interpolation`: as the
    native module calls them.
    """

    name: str
    pixels: np.ndarray
    encoded: bool
    extension: str
    interpolation: str
