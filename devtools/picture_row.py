# SPDX-License-Identifier: GPL-3.0-or-later
"""A row of pictures with titles, for the guide."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import matplotlib as mpl
import numpy as np


def write(
    path: Path, pictures: Mapping[str, np.ndarray], size: tuple[float, float], dpi: int
) -> None:
    """pictures: title -> (h, w, 3), from 0 to 1. size: of the whole, inches."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, len(pictures), figsize=size)
    for panel, (title, pixels) in zip(axes, pictures.items(), strict=True):
        panel.imshow(pixels, interpolation="nearest")
        panel.set_title(title, fontsize=9, color="#333333")
        panel.axis("off")
    figure.tight_layout()
    figure.savefig(path, dpi=dpi)
