# SPDX-License-Identifier: GPL-3.0-or-later
"""Contact sheet: a row of pictures per photo, each under its title.

Drawn with numpy and Blender's own font, since Blender's Python has no library for it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from .. import native

_HEIGHT = 220  # of a tile, pixels
_GAP = 8
_TEXT = 18  # height of a line of text, pixels
_PAPER, _INK = 0.93, 0.08  # encoded grey
# Dark blue over red to light yellow; encoded colours at equal distances
_HEAT = np.array(
    [(0.0, 0.0, 0.02), (0.24, 0.04, 0.4), (0.6, 0.16, 0.36), (0.93, 0.42, 0.16), (0.99, 1.0, 0.64)]
)


def write(path: Path, rows: Mapping[str, Mapping[str, np.ndarray]], largest_error: float) -> None:
    """rows: photo -> title -> picture. (h, w, 3) is linear and shown as sRGB; (h, w) is an error
    and shown as heat, from 0 to `largest_error`."""
    lines = [_line(photo, tiles, largest_error) for photo, tiles in rows.items()]
    width = max(line.shape[1] for line in lines)
    page = np.concatenate([_framed(line, right=width - line.shape[1] + _GAP) for line in lines])
    linear = native.image().srgb_decode(np.ascontiguousarray(page, np.float32))
    native.image().write_png(str(path), linear)


def _line(photo: str, tiles: Mapping[str, np.ndarray], largest: float) -> np.ndarray:
    pieces = []
    for index, (title, picture) in enumerate(tiles.items()):
        height, width = picture.shape[:2]
        width = max(1, round(_HEIGHT * width / height))
        if picture.ndim == 2:
            title += f"  (0 to {largest:g})"
        tile = _heat(picture / largest) if picture.ndim == 2 else _encoded(picture)
        tile = np.clip(_resized(tile, width), 0, 1)
        heading = _text(title if index else f"{photo}: {title}", width)
        pieces.append(_framed(np.concatenate([heading, tile]), left=_GAP, below=_GAP))
    return np.concatenate(pieces, axis=1)


def _framed(picture: np.ndarray, left: int = 0, right: int = 0, below: int = 0) -> np.ndarray:
    """With paper around it."""
    height, width = picture.shape[:2]
    page = np.full((height + below, left + width + right, 3), _PAPER)
    page[:height, left : left + width] = picture
    return page


def _encoded(picture: np.ndarray) -> np.ndarray:
    encoded: np.ndarray = native.image().srgb_encode(np.ascontiguousarray(picture, np.float32))
    return np.clip(encoded, 0, 1)


def _heat(share: np.ndarray) -> np.ndarray:
    place = np.clip(share, 0, 1) * (len(_HEAT) - 1)
    anchors = np.arange(len(_HEAT))
    return np.stack([np.interp(place, anchors, _HEAT[:, c]) for c in range(3)], axis=-1)


def _resized(picture: np.ndarray, width: int) -> np.ndarray:
    resized: np.ndarray = native.image().resize(
        np.ascontiguousarray(picture, np.float32), width, _HEIGHT
    )
    return resized


def _text(text: str, width: int) -> np.ndarray:
    """(_TEXT, width, 3): the text in Blender's font, dark on paper; cut where it is too long."""
    triangles = _outlines(text)
    fine = 4  # subpixels per pixel and axis
    scale = 0.75 * _TEXT * fine  # Blender's font is about one unit high
    ink = np.zeros((_TEXT * fine, width * fine), bool)
    for corners in triangles:
        x, y = corners[:, 0] * scale, (0.78 * _TEXT * fine) - corners[:, 1] * scale
        left, right = int(max(0, x.min())), int(min(ink.shape[1], x.max() + 2))
        top, bottom = int(max(0, y.min())), int(min(ink.shape[0], y.max() + 2))
        if left >= right or top >= bottom:
            continue
        px, py = np.meshgrid(np.arange(left, right) + 0.5, np.arange(top, bottom) + 0.5)
        sides = [
            (x[j] - x[i]) * (py - y[i]) - (y[j] - y[i]) * (px - x[i])
            for i, j in ((0, 1), (1, 2), (2, 0))
        ]
        inside = np.all([s >= 0 for s in sides], axis=0) | np.all([s <= 0 for s in sides], axis=0)
        ink[top:bottom, left:right] |= inside
    cover = ink.reshape(_TEXT, fine, width, fine).mean(axis=(1, 3))
    grey = _PAPER + (_INK - _PAPER) * cover
    return np.repeat(grey[..., None], 3, axis=-1)


def _outlines(text: str) -> Sequence[np.ndarray]:
    """Triangles (3, 2) of a line of text; leaves nothing behind in the file."""
    fonts = set(bpy.data.fonts)
    curve: Any = bpy.data.curves.new("selenite sheet", "FONT")
    item = bpy.data.objects.new("selenite sheet", curve)
    try:
        curve.body = text
        mesh = item.to_mesh()
        mesh.calc_loop_triangles()
        points = np.array([vertex.co[:2] for vertex in mesh.vertices]).reshape(-1, 2)
        return [points[list(triangle.vertices)] for triangle in mesh.loop_triangles]
    finally:
        item.to_mesh_clear()
        bpy.data.objects.remove(item)
        bpy.data.curves.remove(curve)
        for font in set(bpy.data.fonts) - fonts:  # Blender's own, loaded for this
            bpy.data.fonts.remove(font)
