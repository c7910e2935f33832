# SPDX-License-Identifier: GPL-3.0-or-later
"""Contact sheet: a row of pictures for each photo, each under its title."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from .canvas import FAINT, Canvas, encoded, resized
from .comparison import difference, error_picture, marked, mask_legend
from .glyphs import width_of

_GAP, _TEXT, _LEGEND = 8, 22, 34
#: Height of a tile, and of one where there are many photos.
_TILE, _SMALL_TILE, _MANY = 220, 130, 12
_LEAST_TILE = 60
_LETTERS = 11, 15  # heights of a title's


def small(
    photo: np.ndarray, weight: np.ndarray, start: np.ndarray, final: np.ndarray
) -> dict[str, np.ndarray]:
    """The tiles of one photo for `sheet`, not larger than they are shown: photo and renders
    (h, w, 3), weight (h, w)."""
    tiles = {
        "photo": marked(photo, weight),
        "start": marked(start, weight),
        "fit": marked(final, weight),
        "|start - photo|": difference(start, photo, weight),
        "|fit - photo|": difference(final, photo, weight),
    }
    height, width = weight.shape
    if height <= _TILE:
        return tiles
    columns = max(1, round(width * _TILE / height))
    return {title: resized(picture, columns, _TILE) for title, picture in tiles.items()}


def of_fit(
    rows: Mapping[str, Mapping[str, np.ndarray]], scale: float, width: int | None = None
) -> Canvas:
    """rows: id of a photo -> `small`. width: see `sheet`."""
    errors = [tiles["|fit - photo|"] for tiles in rows.values()]
    masked = any(bool(np.isnan(error).any()) for error in errors)
    return sheet(rows, scale, masked=masked, width=width)


def sheet(
    rows: Mapping[str, Mapping[str, np.ndarray]],
    scale: float,
    *,
    masked: bool = False,
    width: int | None = None,
) -> Canvas:
    """rows: photo -> title -> picture. (h, w, 3) is linear and shown as sRGB; (h, w) is an error,
    shown in colours from 0 to `scale`, and NaN where the photo does not count. width: of the page
    as it is shown, in pixels, so that its words stay readable; None where that is not known."""
    height = _TILE if len(rows) <= _MANY else _SMALL_TILE
    if width is not None:
        height = min(height, *(_height_in(width, tiles) for tiles in rows.values()))
    lines = [
        [
            (title if index else f"{photo}: {title}", _tile(picture, height, scale))
            for index, (title, picture) in enumerate(tiles.items())
        ]
        for photo, tiles in rows.items()
    ]
    size = min(_size(text, tile.shape[1]) for line in lines for text, tile in line)
    widths = [sum(tile.shape[1] + _GAP for _, tile in line) + _GAP for line in lines]
    step = _TEXT + height + _GAP
    page = Canvas(max([*widths, 420]), step * len(lines) + _LEGEND + _GAP)
    for number, line in enumerate(lines):
        x, y = _GAP, number * step
        for text, tile in line:
            page.text(x, y + 20 - size, text, size=size, width=tile.shape[1])
            page.paste(x, y + _TEXT, tile)
            x += tile.shape[1] + _GAP
    bottom = step * len(lines)
    page.legend(_GAP, bottom + 4, 240, scale)
    page.text(_GAP + 256, bottom + 4, "difference, linear light", size=14, colour=FAINT)
    if masked:
        mask_legend(page, _GAP + 256, bottom + 21)
    return page


def write(path: Path, rows: Mapping[str, Mapping[str, np.ndarray]], scale: float) -> None:
    """`sheet` as PNG. Raises OSError."""
    sheet(rows, scale).write(path)


def _size(text: str, width: int) -> int:
    """Height of letters with which a title fits above its tile, if they can still be read."""
    sizes = range(_LETTERS[1], _LETTERS[0], -1)
    return next((size for size in sizes if width_of(text, size) <= width), _LETTERS[0])


def _height_in(width: int, tiles: Mapping[str, np.ndarray]) -> int:
    """Of tiles that stand side by side in so many pixels."""
    shapes = [picture.shape for picture in tiles.values()]
    room = width - _GAP * (len(shapes) + 1)
    return max(_LEAST_TILE, int(room / sum(columns / rows for rows, columns, *_ in shapes)))


def _tile(picture: np.ndarray, height: int, scale: float) -> np.ndarray:
    """Encoded, of that height."""
    shown = error_picture(picture, scale) if picture.ndim == 2 else encoded(picture)
    rows, columns = shown.shape[:2]
    return resized(shown, max(1, round(height * columns / rows)), height)
