# SPDX-License-Identifier: GPL-3.0-or-later
"""A stroke font: Blender's Python has no library that draws text, and a native thread no window.

A glyph is a list of polylines, "|" between them; a point is two digits, x and y. y counts upwards:
2 is the baseline, 6 the height of small letters, 8 that of capitals, 0 the lowest point.
"""

from __future__ import annotations

import unicodedata
from functools import lru_cache

import numpy as np

#: Units from the lowest point of a glyph to the highest, with the margins above and below.
LINE = 10
_GAP = 1.7  # units between two glyphs
_SPACE = 2.6

_GLYPHS = {
    "A": "02 28 42|14 34",
    "B": "02 08 38 47 46 35 05|35 44 43 32 02",
    "C": "47 38 18 07 03 12 32 43",
    "D": "02 08 38 47 43 32 02",
    "E": "48 08 02 42|05 35",
    "F": "48 08 02|05 35",
    "G": "47 38 18 07 03 12 32 43 45 25",
    "H": "02 08|42 48|05 45",
    "I": "02 22|08 28|12 18",
    "J": "38 33 22 12 03",
    "K": "02 08|48 05|15 42",
    "L": "08 02 42",
    "M": "02 08 25 48 42",
    "N": "02 08 42 48",
    "O": "12 03 07 18 38 47 43 32 12",
    "P": "02 08 38 47 46 35 05",
    "Q": "12 03 07 18 38 47 43 32 12|24 42",
    "R": "02 08 38 47 46 35 05|25 42",
    "S": "47 38 18 07 06 15 35 44 43 32 12 03",
    "T": "08 48|28 22",
    "U": "08 03 12 32 43 48",
    "V": "08 22 48",
    "W": "08 12 26 32 48",
    "X": "02 48|08 42",
    "Y": "08 25 48|25 22",
    "Z": "08 48 02 42",
    "a": "45 36 16 05 03 12 32 43|46 42",
    "b": "08 02|05 16 36 45 43 32 12 03",
    "c": "45 36 16 05 03 12 32 43",
    "d": "48 42|45 36 16 05 03 12 32 43",
    "e": "04 44 45 36 16 05 03 12 32",
    "f": "38 28 17 12|06 36",
    "g": "46 41 30 10|45 36 16 05 03 12 32 43",
    "h": "08 02|05 16 36 45 42",
    "i": "06 02|08 08",
    "j": "16 11 00|18 18",
    "k": "08 02|36 04|14 42",
    "l": "08 02",
    "m": "02 06|05 16 26 35 32|35 46 56 65 62",
    "n": "02 06|05 16 36 45 42",
    "o": "12 03 05 16 36 45 43 32 12",
    "p": "00 06|05 16 36 45 43 32 12 03",
    "q": "40 46|45 36 16 05 03 12 32 43",
    "r": "02 06|05 16 26",
    "s": "46 16 05 14 34 43 32 02",
    "t": "18 13 22 32|06 36",
    "u": "06 03 12 32 43|46 42",
    "v": "06 22 46",
    "w": "06 12 25 32 46",
    "x": "02 46|06 42",
    "y": "06 22|46 10",
    "z": "06 46 02 42",
    "0": "12 03 07 18 28 37 33 22 12",
    "1": "16 28 22|12 32",
    "2": "07 18 38 47 46 02 42",
    "3": "07 18 38 47 46 35 15|35 44 43 32 12 03",
    "4": "32 38 04 44",
    "5": "48 08 05 35 44 43 32 12 03",
    "6": "38 18 07 03 12 32 43 44 35 05",
    "7": "08 48 12",
    "8": "15 06 07 18 38 47 46 35 15 04 03 12 32 43 44 35",
    "9": "45 15 06 07 18 38 47 43 32 12",
    ".": "02 02",
    ",": "12 01",
    ":": "05 05|02 02",
    ";": "15 15|12 01",
    "-": "05 35",
    "+": "05 45|27 23",
    "=": "06 46|04 44",
    "_": "01 41",
    "/": "02 38",
    "\\": "08 32",
    "|": "00 08",
    "(": "28 16 13 21",
    ")": "08 16 13 01",
    "[": "28 08 01 21",
    "]": "08 28 21 01",
    "%": "02 48|08 18 17 07 08|33 43 42 32 33",
    "#": "12 18|32 38|04 44|06 46",
    "'": "08 07",
    '"': "08 07|28 27",
    "*": "27 23|06 44|46 04",
    "<": "37 04 31",
    ">": "07 34 01",
    "!": "08 04|02 02",
    "?": "07 18 28 37 36 24|22 22",
    "~": "04 15 34 45",
    "^": "06 28 46",
    "&": "42 06 07 18 27 26 04 03 12 22 44",
    "±": "05 45|27 23|02 42",
    "×": "03 36|06 33",
    "·": "05 05",
    "°": "08 18 17 07 08",
}


def plain(text: str) -> str:
    """The text in characters of the font: without accents, "?" for what has no glyph."""
    parts = unicodedata.normalize("NFKD", text)
    kept = (char for char in parts if not unicodedata.combining(char))
    return "".join(char if char in _GLYPHS or char == " " else "?" for char in kept)


def width_of(text: str, size: float) -> float:
    """Pixels of a line of text whose height is `size`."""
    return sum(_advance(char) for char in plain(text)) * size / LINE


def coverage(text: str, size: int) -> np.ndarray:
    """(size, width) in [0, 1]: how much of each pixel the strokes of a line of text cover."""
    unit = size / LINE
    text = plain(text)
    page = np.zeros((size, max(1, int(np.ceil(width_of(text, size))) + 2)), np.float32)
    x = 0.0
    for char in text:
        left = int(x)
        glyph = _glyph(char, size, round(4 * (x - left)) / 4)
        if glyph is not None:
            right = min(page.shape[1], left + glyph.shape[1])
            part = page[:, left:right]
            np.maximum(part, glyph[:, : right - left], out=part)
        x += _advance(char) * unit
    return page


def cut(text: str, size: float, width: float) -> str:
    """The text, shortened to `width` pixels where it is longer."""
    if width_of(text, size) <= width:
        return text
    while text and width_of(f"{text}..", size) > width:
        text = text[:-1]
    return f"{text}.."


def _strokes(char: str) -> list[np.ndarray]:
    lines = _GLYPHS[char].split("|")
    return [np.array([(int(p[0]), int(p[1])) for p in line.split()], float) for line in lines]


def _advance(char: str) -> float:
    if char == " ":
        return _SPACE
    return max(float(line[:, 0].max()) for line in _strokes(char)) + _GAP


@lru_cache(maxsize=2048)
def _glyph(char: str, size: int, shift: float) -> np.ndarray | None:
    """Coverage of one glyph, its left margin included; None of a space."""
    if char == " ":
        return None
    unit = size / LINE
    half = max(0.55, 0.5 * unit)  # of a stroke, pixels
    columns = int(np.ceil(_advance(char) * unit + shift)) + 2
    px, py = np.meshgrid(np.arange(columns) + 0.5, np.arange(size) + 0.5)
    nearest = np.full(px.shape, np.inf)
    for line in _strokes(char):
        x = (line[:, 0] + 0.5 * _GAP) * unit + shift
        y = (LINE - 1 - line[:, 1]) * unit
        for a, b in zip(range(len(line) - 1), range(1, len(line)), strict=True):
            nearest = np.minimum(nearest, distance(px, py, (x[a], y[a]), (x[b], y[b])))
    return np.clip(half + 0.5 - nearest, 0, 1).astype(np.float32)


def distance(
    px: np.ndarray, py: np.ndarray, a: tuple[float, float], b: tuple[float, float]
) -> np.ndarray:
    """Of each point from the segment from a to b."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    length = dx * dx + dy * dy
    t = np.clip(((px - a[0]) * dx + (py - a[1]) * dy) / length, 0, 1) if length else 0.0
    found: np.ndarray = np.hypot(px - a[0] - t * dx, py - a[1] - t * dy)
    return found
