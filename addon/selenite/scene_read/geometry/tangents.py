# SPDX-License-Identifier: GPL-3.0-or-later
"""Tangents along a UV map, for normal maps.

Source: Mikkelsen 2008, "Simulation of Wrinkled Surfaces Revisited", in the form that MikkTSpace
gives it: corners with one position, normal and UV share a tangent, unless the map is mirrored.
"""

from __future__ import annotations

import numpy as np

from ..values import MeshValues

_TINY = 1e-20


def of(values: MeshValues, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit tangents and signs of the bitangent at corners, (3m, 3); a sign fills its row."""
    p = values.positions.astype(np.float64)[values.triangles]
    n = values.corner_normals.astype(np.float64).reshape(-1, 3, 3)
    t = uv.astype(np.float64).reshape(-1, 3, 2)
    d1, d2 = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    t1, t2 = t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]
    area = t1[:, 0] * t2[:, 1] - t1[:, 1] * t2[:, 0]
    sign = np.where(area > 0, 1.0, -1.0)
    along = (d1 * t2[:, 1:] - d2 * t1[:, 1:]) * sign[:, None]
    flat = _unit(along)[:, None, :]

    tangent = _unit(flat - n * (n * flat).sum(-1, keepdims=True))
    weighted = tangent * _angles(p, n)[..., None]
    weighted[np.abs(area) <= _TINY] = 0
    keys = np.concatenate(
        [p.reshape(-1, 3), n.reshape(-1, 3), t.reshape(-1, 2), np.repeat(sign, 3)[:, None]], axis=1
    )
    _, group = np.unique(np.ascontiguousarray(keys, np.float32), axis=0, return_inverse=True)
    group = group.reshape(-1)
    sums = np.zeros((group.max(initial=-1) + 1, 3))
    np.add.at(sums, group, weighted.reshape(-1, 3))
    found = _unit(sums)[group]
    missing = ~found.any(axis=1)
    found[missing] = (1, 0, 0)
    signs = np.repeat(np.repeat(sign, 3)[:, None], 3, axis=1)
    return found.astype(np.float32), signs.astype(np.float32)


def _unit(v: np.ndarray) -> np.ndarray:
    size = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.divide(v, size, out=np.zeros_like(v), where=size > _TINY)


def _angles(p: np.ndarray, n: np.ndarray) -> np.ndarray:
    """(m, 3) angles of the triangles at their corners, seen along the corner's normal."""
    angles = np.empty(p.shape[:2])
    for k in range(3):
        edges = [p[:, (k + 1) % 3] - p[:, k], p[:, (k + 2) % 3] - p[:, k]]
        a, b = (_unit(edge - n[:, k] * (n[:, k] * edge).sum(-1, keepdims=True)) for edge in edges)
        angles[:, k] = np.arccos(np.clip((a * b).sum(-1), -1, 1))
    return angles
