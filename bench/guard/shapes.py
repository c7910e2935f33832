# SPDX-License-Identifier: GPL-3.0-or-later
"""Closed bodies as arrays: positions (n, 3), triangles (m, 3) with outward normals, z up."""

from __future__ import annotations

import numpy as np
from synthetic.stage import icosphere

Shape = tuple[np.ndarray, np.ndarray]
_AROUND = 64


def standing(shape: Shape) -> Shape:
    """At most 2 units in each direction, around the z axis, just clear of the floor z = 0."""
    positions, triangles = shape
    low, high = positions.min(axis=0), positions.max(axis=0)
    positions = (positions - (low + high) / 2) * (2 / (high - low).max())
    positions[:, 2] -= positions[:, 2].min() - 1e-3
    return positions, triangles


def _turned(radius: np.ndarray, height: np.ndarray) -> Shape:
    """A solid of revolution: its outline from the axis around the outside back to the axis, in
    counter-clockwise order of (radius, height); the first and the last radius are 0."""
    angle = 2 * np.pi * np.arange(_AROUND) / _AROUND
    rings = np.stack([
        np.outer(radius[1:-1], np.cos(angle)), np.outer(radius[1:-1], np.sin(angle)),
        np.repeat(height[1:-1, None], _AROUND, axis=1),
    ], axis=2)  # fmt: skip
    ends = np.array([(0, 0, height[0]), (0, 0, height[-1])])
    count = len(rings)
    index = np.arange(count * _AROUND).reshape(count, _AROUND)
    following = np.roll(index, -1, axis=1)
    first, last = count * _AROUND, count * _AROUND + 1
    a, b, c, d = index[:-1], following[:-1], following[1:], index[1:]
    parts = [
        np.stack([a, b, c], axis=2).reshape(-1, 3),
        np.stack([a, c, d], axis=2).reshape(-1, 3),
        np.stack([np.full(_AROUND, first), following[0], index[0]], axis=1),
        np.stack([index[-1], following[-1], np.full(_AROUND, last)], axis=1),
    ]
    return np.vstack([rings.reshape(-1, 3), ends]), np.vstack(parts)


def _outline(points: list[tuple[float, float]], count: int = 80) -> Shape:
    """Turned from a polyline with rounded corners."""
    corners = np.array(points, float)
    for _ in range(3):  # Chaikin's corner cutting; the ends stay
        kept = 0.75 * corners[:-1] + 0.25 * corners[1:], 0.25 * corners[:-1] + 0.75 * corners[1:]
        cut = np.stack(kept, axis=1).reshape(-1, 2)
        corners = np.vstack([corners[:1], cut, corners[-1:]])
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    at = np.linspace(0, length[-1], count)
    radius, height = (np.interp(at, length, corners[:, axis]) for axis in (0, 1))
    radius[0] = radius[-1] = 0
    return _turned(radius, height)


def vase() -> Shape:
    """With a belly, a neck and an inside."""
    outside = [(0, 0), (0.5, 0), (0.62, 0.15), (0.85, 0.7), (0.8, 1.1), (0.4, 1.55), (0.38, 1.75)]
    inside = [(0.55, 2.0), (0.45, 2.02), (0.26, 1.75), (0.28, 1.5), (0.66, 1.05), (0.7, 0.7)]
    return _outline([*outside, *inside, (0.45, 0.16), (0, 0.15)])


def bowl() -> Shape:
    """With a thick wall."""
    outside = [(0, 0), (0.45, 0), (0.85, 0.3), (1.05, 0.8), (1.0, 0.95)]
    return _outline([*outside, (0.85, 0.85), (0.7, 0.45), (0.4, 0.25), (0, 0.22)])


def pawn() -> Shape:
    """Solid, with a thin neck."""
    lower = [(0, 0), (0.7, 0), (0.72, 0.25), (0.45, 0.4), (0.25, 0.9), (0.45, 1.15)]
    return _outline([*lower, (0.24, 1.25), (0.5, 1.5), (0.42, 1.9), (0, 2.0)])


def ring() -> Shape:
    """A torus with lobes, half upright."""
    turn, around = np.meshgrid(*(2 * np.pi * np.arange(n) / n for n in (96, 48)), indexing="ij")
    tube = 0.36 + 0.05 * np.cos(5 * turn + around)
    out = 0.75 + tube * np.cos(around)
    flat = np.stack([out * np.cos(turn), out * np.sin(turn), tube * np.sin(around)], axis=2)
    index = np.arange(96 * 48).reshape(96, 48)
    right, up = np.roll(index, -1, axis=0), np.roll(index, -1, axis=1)
    both = np.roll(right, -1, axis=1)
    triangles = [np.stack([index, right, both], axis=2), np.stack([index, both, up], axis=2)]
    sine, cosine = np.sin(0.9), np.cos(0.9)
    tilt = np.array([(1, 0, 0), (0, cosine, -sine), (0, sine, cosine)])
    return flat.reshape(-1, 3) @ tilt.T, np.vstack([part.reshape(-1, 3) for part in triangles])


def soap() -> Shape:
    """A cube with round edges, turned."""
    positions, triangles = icosphere(5)
    positions = positions / (np.abs(positions) ** 6).sum(axis=1, keepdims=True) ** (1 / 6)
    positions = positions * (1.0, 0.75, 0.55)
    sine, cosine = np.sin(0.5), np.cos(0.5)
    return positions @ np.array([(cosine, -sine, 0), (sine, cosine, 0), (0, 0, 1)]).T, triangles


def pebble() -> Shape:
    """A ball with smooth bumps."""
    positions, triangles = icosphere(5)
    x, y, z = positions.T
    bumps = np.sin(3 * x + 1) * np.sin(4 * y) + np.sin(5 * z + 2 * x)
    return positions * (1 + 0.07 * bumps)[:, None] * (1.0, 0.85, 0.75), triangles


SHAPES = {one.__name__: one for one in (vase, bowl, pawn, ring, soap, pebble)}
