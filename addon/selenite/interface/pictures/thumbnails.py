# SPDX-License-Identifier: GPL-3.0-or-later
"""Photo, fit and difference of the active photo, small, below the verdict of a result."""

from __future__ import annotations

from typing import Any

import bpy
import bpy.utils.previews
import numpy as np

from ...report.pictures.canvas import encoded, resized
from ...report.pictures.comparison import ERROR_SCALE, difference, error_picture, marked
from ..texts import region_width, translated

#: Titles, in the order of the line.
_TITLES = ("Photo", "Fit", "Difference")
_SIZE = 160  # pixels of the longer side
_UNIT = 20  # pixels of an icon at a scale of 1
_MARGIN = 40  # pixels that a panel keeps for itself


class Thumbnails:
    """Three previews, which are no part of any file. `key`: what they show, None for nothing."""

    def __init__(self) -> None:
        self.key: Any = None
        self._previews: Any = None

    def show(self, key: Any, photo: np.ndarray, weight: np.ndarray, fit: np.ndarray) -> None:  # noqa: ANN401
        """photo, fit: (h, w, 3), linear; weight (h, w)."""
        error = error_picture(difference(fit, photo, weight), ERROR_SCALE)
        pictures = (encoded(marked(photo, weight)), encoded(marked(fit, weight)), error)
        if self._previews is None:
            self._previews = bpy.utils.previews.new()
        rows, columns = weight.shape
        scale = _SIZE / max(rows, columns)
        size = max(1, round(columns * scale)), max(1, round(rows * scale))
        for title, picture in zip(_TITLES, pictures, strict=True):
            preview = self._previews.get(title) or self._previews.new(title)
            pixels = np.ones((size[1], size[0], 4), np.float32)
            pixels[..., :3] = resized(picture, *size)[::-1]
            preview.image_size = size
            preview.image_pixels_float.foreach_set(pixels.ravel())
        self.key = key

    def draw(self, layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
        """Side by side, as wide as the region; nothing where there are none."""
        if self.key is None or self._previews is None:
            return
        row = layout.row(align=True)
        scale = (region_width(context) - _MARGIN) / len(_TITLES) / _UNIT
        for title in _TITLES:
            column = row.column(align=True)
            icon = self._previews[title].icon_id
            column.template_icon(icon_value=icon, scale=min(max(scale, 2.0), 9.0))
            column.label(text=translated(title), translate=False)

    def forget(self) -> None:
        """Shows nothing any more."""
        self.key = None

    def end(self) -> None:
        """The add-on goes."""
        self.key = None
        if self._previews is not None:
            bpy.utils.previews.remove(self._previews)
            self._previews = None


THUMBNAILS = Thumbnails()
