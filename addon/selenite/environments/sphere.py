# SPDX-License-Identifier: GPL-3.0-or-later
"""Equirectangular images as Blender looks them up: row 0 at the top, columns clockwise from above.

Column i of w has its centre at the azimuth pi - 2 pi (i + 1/2) / w from +X towards +Y, row j of h
at the elevation pi/2 - pi (j + 1/2) / h. Images are (h, w, 3), linear.
"""

from __future__ import annotations

import math

import numpy as np

#: Source rows in a row of the result, at least: pixels belong to the texel of their centre.
_FINE = 32
#: Source pixels that are turned at a time.
_BLOCK = 1 << 20


def grid_of(count: int) -> tuple[int, int]:
    """(rows, columns), twice as many columns as rows, of the image nearest to `count` pixels."""
    rows = max(1, round(math.sqrt(count / 2)))
    return rows, 2 * rows


def directions(rows: int, columns: int, first: int = 0, last: int | None = None) -> np.ndarray:
    """(last - first, columns, 3) unit vectors to the centres of the pixels of some rows."""
    elevation = np.pi / 2 - np.pi * (np.arange(first, rows if last is None else last) + 0.5) / rows
    azimuth = np.pi - 2 * np.pi * (np.arange(columns) + 0.5) / columns
    cosine = np.cos(elevation)[:, None]
    x, y = cosine * np.cos(azimuth), cosine * np.sin(azimuth)
    z = np.broadcast_to(np.sin(elevation)[:, None], x.shape)
    return np.stack([x, y, z], axis=-1)


def places(vectors: np.ndarray, rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """(row, column), integers, of the pixels in which unit vectors (..., 3) lie."""
    v = 0.5 - np.arcsin(np.clip(vectors[..., 2], -1, 1)) / np.pi
    u = 0.5 - np.arctan2(vectors[..., 1], vectors[..., 0]) / (2 * np.pi)
    row = np.clip((v * rows).astype(int), 0, rows - 1)
    return row, np.floor(u * columns).astype(int) % columns


def solid_angles(rows: int, columns: int) -> np.ndarray:
    """(rows,) steradians of one pixel of each row; all pixels together have 4 pi."""
    edges = np.sin(np.pi / 2 - np.pi * np.arange(rows + 1) / rows)
    return 2 * np.pi / columns * (edges[:-1] - edges[1:])


def mean(image: np.ndarray) -> tuple[float, float, float]:
    """Over the sphere, channel by channel."""
    weight = solid_angles(*image.shape[:2])
    total = np.einsum("r,rcx->x", weight, image.astype(np.float64)) / (4 * np.pi)
    return float(total[0]), float(total[1]), float(total[2])


def continued(image: np.ndarray, known: np.ndarray) -> np.ndarray:
    """The image with those pixels that are not known, (h, w) bool, as smooth as can be: they
    minimise the integral of the squared gradient over the sphere beside the known ones. Unchanged
    where none is known."""
    if known.all() or not known.any():
        return image
    rows, columns = known.shape
    places = np.arange(rows * columns).reshape(rows, columns)
    down, across = np.pi / rows, 2 * np.pi / columns
    middles = np.sin(np.pi * (np.arange(rows) + 0.5) / rows)
    edges = np.sin(np.pi * np.arange(1, rows) / rows)
    horizontal = np.broadcast_to((down / (across * middles))[:, None], places.shape)
    vertical = np.broadcast_to((across * edges / down)[:, None], (rows - 1, columns))
    first = np.concatenate([places.ravel(), places[:-1].ravel()])
    second = np.concatenate([np.roll(places, -1, axis=1).ravel(), places[1:].ravel()])
    weight = np.concatenate([horizontal.ravel(), vertical.ravel()])
    matrix = np.zeros((places.size, places.size))
    for a, b in ((first, second), (second, first)):
        np.add.at(matrix, (a, a), weight)
        np.add.at(matrix, (a, b), -weight)
    is_known = known.ravel()
    flat = image.reshape(-1, image.shape[-1]).astype(np.float64)
    open_ones = matrix[~is_known]
    right = -open_ones[:, is_known] @ flat[is_known]
    flat[~is_known] = np.linalg.solve(open_ones[:, ~is_known], right)
    return flat.reshape(image.shape).astype(image.dtype)


def resampled(image: np.ndarray, to_map: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """(rows, columns, 3) float32 in the frame of the world: the mean over each pixel of what the
    image shows there, so that no small bright light is missed.

    to_map: (3, 3), direction in the image's frame = to_map @ direction in the world.
    """
    height, width = image.shape[:2]
    # A pixel of a coarse image is spread over those of the result as many small ones.
    down, across = max(1, -(-_FINE * rows // height)), max(1, -(-_FINE * columns // width))
    height, width = height * down, width * across
    weights = solid_angles(height, width)
    sums, total = np.zeros((rows * columns, 3)), np.zeros(rows * columns)
    step = max(1, _BLOCK // width)
    for first in range(0, height, step):
        last = min(height, first + step)
        row, column = places(directions(height, width, first, last) @ to_map, rows, columns)
        place = (row * columns + column).ravel()
        weight = np.repeat(weights[first:last], width)
        block = image[np.arange(first, last) // down].repeat(across, axis=1).reshape(-1, 3)
        total += np.bincount(place, weight, rows * columns)
        for channel in range(3):
            sums[:, channel] += np.bincount(place, weight * block[:, channel], rows * columns)
    return (sums / total[:, None]).reshape(rows, columns, 3).astype(np.float32)


def looked_up(image: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """(..., 3): the image in the directions `vectors` (..., 3), interpolated as in a render."""
    rows, columns = image.shape[:2]
    y = (0.5 - np.arcsin(np.clip(vectors[..., 2], -1, 1)) / np.pi) * rows - 0.5
    x = (0.5 - np.arctan2(vectors[..., 1], vectors[..., 0]) / (2 * np.pi)) * columns - 0.5
    return interpolated(image, x, y, around=True)


def interpolated(image: np.ndarray, x: np.ndarray, y: np.ndarray, around: bool) -> np.ndarray:
    """(..., 3): the image between its pixels, whose centres are whole numbers. around: its last
    column is beside its first one; else it goes on beyond its edges as it ends there."""
    rows, columns = image.shape[:2]
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    a, b = (x - i)[..., None], (y - j)[..., None]
    above, below = np.clip(j, 0, rows - 1), np.clip(j + 1, 0, rows - 1)
    left, right = (
        column % columns if around else np.clip(column, 0, columns - 1) for column in (i, i + 1)
    )
    upper = image[above, left] * (1 - a) + image[above, right] * a
    lower = image[below, left] * (1 - a) + image[below, right] * a
    return np.asarray(upper * (1 - b) + lower * b, image.dtype)
