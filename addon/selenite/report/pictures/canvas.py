# SPDX-License-Identifier: GPL-3.0-or-later
"""A page to draw on: rectangles, lines, text, pictures, the colours of an error."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ... import native
from . import glyphs

Colour = tuple[float, float, float]  # encoded sRGB

PAPER: Colour = (0.95, 0.95, 0.94)
INK: Colour = (0.08, 0.08, 0.1)
FAINT: Colour = (0.55, 0.55, 0.57)
GRID: Colour = (0.84, 0.84, 0.83)
#: Dark blue over red to light yellow, at equal distances.
_HEAT = np.array(
    [(0.0, 0.0, 0.02), (0.24, 0.04, 0.4), (0.6, 0.16, 0.36), (0.93, 0.42, 0.16), (0.99, 1.0, 0.64)]
)


class Canvas:
    """Pixels (height, width, 3), encoded sRGB, row 0 at the top."""

    def __init__(self, width: int, height: int, paper: Colour = PAPER) -> None:
        self.pixels = np.empty((height, width, 3), np.float32)
        self.pixels[:] = paper

    def fill(
        self, left: float, top: float, right: float, bottom: float, colour: Colour, share: float = 1
    ) -> None:
        """A rectangle, to whole pixels; `share` of the colour over what is there."""
        height, width = self.pixels.shape[:2]
        x0, x1 = (round(min(max(x, 0), width)) for x in (left, right))
        y0, y1 = (round(min(max(y, 0), height)) for y in (top, bottom))
        part = self.pixels[y0:y1, x0:x1]
        part += share * (np.asarray(colour, np.float32) - part)

    def line(
        self, points: Sequence[tuple[float, float]] | np.ndarray, colour: Colour, width: float = 1
    ) -> None:
        """Through points (x, y). A gap where one is not finite."""
        half = width / 2
        xy = np.asarray(points, float).reshape(-1, 2)
        known = np.isfinite(xy).all(axis=1)
        runs = np.split(np.arange(len(xy)), np.flatnonzero(~known))
        dense = [_samples(xy[run[known[run]]]) for run in runs]
        dots = np.concatenate(dense) if dense else np.empty((0, 2))
        rows, columns = self.pixels.shape[:2]
        reach = int(np.ceil(half + 0.5))
        low = np.maximum(np.floor(dots.min(axis=0)).astype(int) - reach, 0) if len(dots) else [0, 0]
        high = np.floor(dots.max(axis=0)).astype(int) + reach + 1 if len(dots) else [0, 0]
        x1, y1 = min(columns, int(high[0])), min(rows, int(high[1]))
        if low[0] >= x1 or low[1] >= y1:
            return
        # Every sample covers its neighbours; the largest cover of a pixel counts.
        steps = np.arange(-reach, reach + 1)
        across, down = (grid.ravel() for grid in np.meshgrid(steps, steps))
        px = np.floor(dots[:, 0]).astype(int)[:, None] + across
        py = np.floor(dots[:, 1]).astype(int)[:, None] + down
        near = np.hypot(px + 0.5 - dots[:, :1], py + 0.5 - dots[:, 1:])
        share = np.clip(half + 0.5 - near, 0, 1).ravel()
        px, py = px.ravel() - low[0], py.ravel() - low[1]
        cover = np.zeros((y1 - low[1], x1 - low[0]), np.float32)
        inside = (px >= 0) & (py >= 0) & (px < cover.shape[1]) & (py < cover.shape[0]) & (share > 0)
        px, py, share = px[inside], py[inside], share[inside]
        order = np.argsort(share)
        cover[py[order], px[order]] = share[order]  # of equal places the last one stays
        self._blend(int(low[0]), int(low[1]), cover, colour)

    def dot(self, x: float, y: float, colour: Colour, radius: float = 3) -> None:
        """A filled circle."""
        self.line([(x, y), (x, y)], colour, 2 * radius)

    def text(
        self,
        x: float,
        y: float,
        text: str,
        *,
        size: int = 14,
        colour: Colour = INK,
        align: float = 0,
        width: float = np.inf,
    ) -> None:
        """A line of text, `y` its top; `x` its left end (align 0), middle (0.5) or right end (1).
        It is shortened to `width` pixels."""
        text = glyphs.cut(text, size, width)
        self._blend(x - align * glyphs.width_of(text, size), y, glyphs.coverage(text, size), colour)

    def paste(self, x: int, y: int, picture: np.ndarray) -> None:
        """An encoded picture (h, w, 3), as far as it lies on the page."""
        part = self.pixels[y : y + picture.shape[0], x : x + picture.shape[1]]
        part[:] = picture[: part.shape[0], : part.shape[1]]

    def legend(self, x: int, y: int, width: int, largest: float, height: int = 10) -> None:
        """The colours of an error from 0 to `largest`, with numbers below: 14 pixels more."""
        ramp = heat(np.linspace(0, 1, width))[None].repeat(height, axis=0)
        self.paste(x, y, ramp)
        for share, align in ((0.0, 0.0), (0.5, 0.5), (1.0, 1.0)):
            label = f"{share * largest:.3g}"
            self.text(x + share * width, y + height + 2, label, size=12, align=align)

    def write(self, path: Path) -> None:
        """As PNG. Raises OSError."""
        linear = native.image().srgb_decode(np.ascontiguousarray(np.clip(self.pixels, 0, 1)))
        native.image().write_png(str(path), linear)

    def _blend(self, x: float, y: float, cover: np.ndarray, colour: Colour) -> None:
        rows, columns = self.pixels.shape[:2]
        left, top = round(x), round(y)
        cover = cover[max(0, -top) :, max(0, -left) :]
        left, top = max(0, left), max(0, top)
        part = self.pixels[top : top + cover.shape[0], left : left + cover.shape[1]]
        share = cover[: max(0, rows - top), : max(0, columns - left), None]
        part += share * (np.asarray(colour, np.float32) - part)


def _samples(xy: np.ndarray, step: float = 0.5) -> np.ndarray:
    """Points of a polyline, no farther apart than `step` pixels."""
    if len(xy) < 2:
        return xy
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])
    places = np.linspace(0.0, length[-1], max(1, int(np.ceil(length[-1] / step))) + 1)
    return np.stack([np.interp(places, length, xy[:, k]) for k in (0, 1)], axis=-1)


def heat(share: np.ndarray) -> np.ndarray:
    """(..., 3) encoded colours of numbers from 0 to 1."""
    place = np.clip(np.nan_to_num(share), 0, 1) * (len(_HEAT) - 1)
    anchors = np.arange(len(_HEAT))
    bands = [np.interp(place, anchors, _HEAT[:, c]) for c in range(3)]
    return np.stack(bands, axis=-1).astype(np.float32)


def encoded(picture: np.ndarray) -> np.ndarray:
    """Linear light (h, w, 3) as the screen shows it, cut to [0, 1]."""
    contiguous = np.ascontiguousarray(picture, np.float32)
    found: np.ndarray = native.image().srgb_encode(contiguous)
    return np.clip(np.nan_to_num(found), 0, 1)


def resized(picture: np.ndarray, width: int, height: int) -> np.ndarray:
    """Each new pixel is the mean over what it covers. Where numbers are NaN, the mean over the
    others; NaN where there are none."""
    if picture.shape[:2] == (height, width):
        return picture
    known = np.isfinite(picture)
    if known.all():
        return _mean(picture, width, height)
    total = _mean(np.where(known, picture, 0), width, height)
    share = _mean(known, width, height)
    with np.errstate(divide="ignore", invalid="ignore"):
        found: np.ndarray = np.where(share > 0, total / share, np.float32(np.nan))
    return found


def _mean(picture: np.ndarray, width: int, height: int) -> np.ndarray:
    found: np.ndarray = native.image().resize(
        np.ascontiguousarray(picture, np.float32), width, height
    )
    return found
