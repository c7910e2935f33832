# SPDX-License-Identifier: GPL-3.0-or-later
"""A render beside a photo, as one picture with a title and a legend."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .canvas import FAINT, INK, Canvas, encoded, heat, resized

#: The panel's enum has the same names.
PHOTO, RENDER, WIPE, DIFFERENCE, BEFORE_AFTER = (
    "PHOTO", "RENDER", "WIPE", "DIFFERENCE", "BEFORE_AFTER",
)  # fmt: skip
#: Full scale of a difference, in linear light where white is 1; the same for all pictures, so that
#: the colours of two of them can be compared.
ERROR_SCALE = 0.2
#: What does not count has this colour (linear), and so much of the picture.
OUTSIDE, SHOWN_OUTSIDE = (0.5, 0.0, 0.0), 0.25
#: Rows that a picture has at least and at most: small ones are enlarged by whole numbers.
_LEAST, _MOST = 320, 720
_TITLE, _FOOT, _MARGIN = 26, 34, 8


@dataclass(frozen=True)
class Pictures:
    """Of one photo, linear, (h, w, 3): the photo, its weight (h, w), and renders of it, where they
    are there. `render` may have another size, in a stage with its own height."""

    photo: np.ndarray
    weight: np.ndarray
    render: np.ndarray | None = None
    start: np.ndarray | None = None


@dataclass(frozen=True)
class Choice:
    """What is shown: one of the modes, where the wipe line is (share of the width), and what the
    brightest colour of a difference means."""

    mode: str = WIPE
    wipe: float = 0.5
    scale: float = ERROR_SCALE


def marked(picture: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Linear (h, w, 3), in which what does not count is dark red."""
    outside = np.asarray(OUTSIDE, np.float32) + SHOWN_OUTSIDE * picture
    found: np.ndarray = np.where((weight > 0)[..., None], picture, outside)
    return found


def difference(render: np.ndarray, photo: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """(h, w): mean over the channels of |render - photo|, NaN where the photo does not count."""
    error = np.abs(np.asarray(render, np.float32) - photo).mean(axis=-1)
    return np.where(weight > 0, error, np.float32(np.nan))


def error_picture(error: np.ndarray, scale: float) -> np.ndarray:
    """Encoded (h, w, 3): colours from 0 to `scale`, and red where the photo does not count."""
    counts = np.isfinite(error)[..., None]
    found: np.ndarray = np.where(counts, heat(error / scale), _red())
    return found


def mask_legend(page: Canvas, x: float, top: float) -> None:
    """What the red means: a square and words, 14 pixels high."""
    red = _red()[0, 0]
    page.fill(x, top + 1, x + 12, top + 13, (red[0], red[1], red[2]))
    page.text(x + 18, top, "does not count", size=14, colour=FAINT)


def _red() -> np.ndarray:
    """(1, 1, 3): OUTSIDE, encoded."""
    return encoded(np.asarray(OUTSIDE, np.float32).reshape(1, 1, 3))


def compared(
    pictures: Pictures, choice: Choice, title: str, room: tuple[int, int] | None = None
) -> np.ndarray:
    """The whole picture, encoded, row 0 at the top. A render that is not there yet is left out.

    room: width and height that it shall have at most, as far as that is at all readable.
    """
    rows, columns = _size(pictures.weight.shape, room)
    small = min(rows, pictures.weight.shape[0]), min(columns, pictures.weight.shape[1])
    body, sides = _body(pictures, choice, small)
    body = resized(body, columns, rows)  # larger: every pixel of the photo stays visible
    height, width = body.shape[:2]
    page = Canvas(max(width, 300) + 2 * _MARGIN, height + _TITLE + _FOOT)
    columns = page.pixels.shape[1]
    left = (columns - width) // 2
    page.text(_MARGIN, 6, title, size=16, width=columns - 2 * _MARGIN)
    page.paste(left, _TITLE, body)
    if len(sides) == 2:
        x = left + min(max(choice.wipe, 0), 1) * width
        page.fill(x - 1, _TITLE, x + 1, _TITLE + height, (1.0, 1.0, 1.0))
        page.fill(x + 1, _TITLE, x + 2, _TITLE + height, INK)
    bottom = _TITLE + height
    masked = bool((pictures.weight <= 0).any())
    if choice.mode == DIFFERENCE and sides[0] == "difference":
        page.legend(left, bottom + 5, min(200, width // 2), choice.scale)
    else:
        page.text(left, bottom + 8, sides[0], size=14, colour=INK)
        if len(sides) == 2:
            page.text(left + width, bottom + 8, sides[1], size=14, align=1)
    if masked:
        middle = left + (width * 3) // 4 if choice.mode == DIFFERENCE else columns // 2
        mask_legend(page, middle - 60, bottom + 8)
    return page.pixels


def _size(shape: tuple[int, ...], room: tuple[int, int] | None) -> tuple[int, int]:
    """Rows and columns that the photo has on the page."""
    rows, columns = shape
    if room is None:
        scale = max(1, -(-_LEAST // rows)) if rows <= _MOST else _MOST / rows
    else:
        high, wide = max(60, room[1] - _TITLE - _FOOT), max(80, room[0] - 2 * _MARGIN)
        scale = min(high / rows, wide / columns)
    return max(1, int(rows * scale)), max(1, int(columns * scale))


def _body(
    pictures: Pictures, choice: Choice, size: tuple[int, int]
) -> tuple[np.ndarray, list[str]]:
    """The encoded picture of `size` (rows, columns), and what is on its sides."""
    weight = pictures.weight
    rows, columns = weight.shape

    def fitted(picture: np.ndarray) -> np.ndarray:
        if picture.shape[:2] == (rows, columns):
            return picture
        return resized(picture, columns, rows)

    def plain(picture: np.ndarray, part: slice = slice(None)) -> np.ndarray:
        small = resized(marked(fitted(picture), weight), size[1], size[0])
        return encoded(small[:, part])

    def wiped(first: np.ndarray, second: np.ndarray) -> np.ndarray:
        at = round(min(max(choice.wipe, 0), 1) * size[1])
        return np.concatenate([plain(first, slice(at)), plain(second, slice(at, None))], axis=1)

    photo, render, start = pictures.photo, pictures.render, pictures.start
    if choice.mode == PHOTO:
        return plain(photo), ["photo"]
    if choice.mode == BEFORE_AFTER and start is not None and render is not None:
        return wiped(start, render), ["start", "render"]
    if render is None:
        return plain(photo), ["photo"]
    if choice.mode == RENDER:
        return plain(render), ["render"]
    if choice.mode == DIFFERENCE:
        error = resized(difference(fitted(render), photo, weight), size[1], size[0])
        return error_picture(error, choice.scale), ["difference"]
    return wiped(photo, render), ["photo", "render"]
