# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces of a mesh that lie on each other: twice the same, folded, or in one plane by chance.

Cycles shows them with shadows, or black, as it does two objects in one plane: see `overlaps`.
"""

from __future__ import annotations

import numpy as np

from ...messages import remark, thing
from ...problems import Problem
from ..values import MeshValues, SceneValues
from .overlaps import PARALLEL, ROUNDING, TURNED, glass_of, planes_of

#: The part of a mesh's area that is named.
_LEAST = 1e-3
#: The part of glass that is refused: light enters such a body twice, or not at all.
_MOST = 0.1
#: Points of a mesh that are looked at, pairs of a point and a triangle, and the pairs at a time.
_POINTS, _MOST_PAIRS, _PAIRS_AT_ONCE = 4096, 10_000_000, 300_000
#: A point this part of a triangle off its rim lies in it.
_INSIDE = 1e-4
_CURE = "in Edit Mode select all and delete those that are too many"


def warn_of_folds(read: SceneValues) -> None:
    """Adds a warning for each mesh with more than a few, a problem where a tenth of a body of glass
    is. An opaque one is rendered as if they were there once, which photos of a real body show. 1.5
    s of CPU time for a million triangles."""
    used = {item.mesh for item in read.objects}
    glass = glass_of(read)
    of_glass = {item.mesh for item in read.objects if not glass.isdisjoint(item.materials)}
    for index, mesh in enumerate(read.meshes):
        if index not in used:
            continue
        count, part = folded(mesh)
        faces = f"{count} of its triangles lie on each other"
        if part <= _LEAST:
            part = covered(mesh)
            faces = f"{100 * part:.2g} % of its area lies on other faces of its own"
        if part > _MOST and index in of_glass:
            cause = f"{faces}, which Cycles shows otherwise (with shadows, or black)"
            read.refuse(Problem(thing("Mesh", mesh.name), cause, _CURE))
        elif part > _LEAST:
            read.warn(
                remark(
                    thing("Mesh", mesh.name),
                    f"{faces}, which Cycles shows otherwise (with shadows, or black): "
                    "delete those that are too many",
                )
            )


def folded(mesh: MeshValues) -> tuple[int, float]:
    """How many triangles lie on another one with which they share an edge, and their part of the
    area: faces that are there twice, whatever their diagonals, and folded ones."""
    triangles, points = mesh.triangles, mesh.positions.astype(np.float64)
    place = _places(mesh.positions)
    first = place[triangles]
    edge = (first + np.roll(first, -1, axis=1)).ravel()  # of corners k and k + 1
    order = np.argsort(edge)
    key, number = edge[order], order // 3
    corners = points[triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1)
    size = np.abs(corners[:, 1:] - corners[:, :1]).max(axis=(1, 2), initial=0)
    real = area > 1e-12 * size**2
    normal = across / np.where(real, area, 1)[:, None]
    found = np.zeros(len(triangles), bool)
    for step in (1, 2, 3):  # two bodies at one place have four triangles at an edge
        at = np.flatnonzero(key[step:] == key[:-step])
        i, j = number[at], number[at + step]
        flat = real[i] & real[j] & (i != j)
        flat &= np.abs(np.einsum("ij,ij->i", normal[i], normal[j])) > PARALLEL
        at, i, j = at[flat], i[flat], j[flat]
        # The corners across the edge, from where it begins, without what is along it.
        begin, end = (corners[i, (order[at] + k) % 3] for k in (0, 1))
        along = end - begin
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        ours = corners[i, (order[at] + 2) % 3] - begin
        other = corners[j, (order[at + step] + 2) % 3]
        theirs = other - begin
        ours, theirs = (
            item - along * np.einsum("ij,ij->i", item, along)[:, None] for item in (ours, theirs)
        )
        same_side = np.einsum("ij,ij->i", ours, theirs) > 0
        off = np.abs(np.einsum("ij,ij->i", other - begin, normal[i]))
        limit = np.einsum("ij,ij->i", np.abs(other), np.abs(normal[i]))
        limit = ROUNDING * limit + TURNED * np.minimum(size[i], size[j])
        on = same_side & (off <= limit)
        found[i[on]] = found[j[on]] = True
    whole = float(area.sum())
    return int(found.sum()), float(area[found].sum()) / whole if whole > 0 else 0.0


def covered(mesh: MeshValues) -> float:
    """The part of a mesh's area that lies on other triangles, whether they share an edge or not:
    estimated from points at random, the same ones each time."""
    corners = mesh.positions.astype(np.float64)[mesh.triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1)
    size = np.abs(corners[:, 1:] - corners[:, :1]).max(axis=(1, 2), initial=0)
    real = area > 1e-12 * size**2
    corners, area, size = corners[real], area[real], size[real]
    if len(area) < 2:
        return 0.0
    normals = across[real] / area[:, None]
    planes = planes_of(corners, normals)
    order = np.argsort(planes, kind="stable")
    first = np.searchsorted(planes[order], planes)
    counts = np.searchsorted(planes[order], planes, side="right") - first
    random = np.random.default_rng(0)
    chosen = random.choice(len(area), _POINTS, p=area / area.sum())
    u, v = random.random((2, _POINTS))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    shares = np.stack([1 - u - v, u, v], axis=1)
    points = np.einsum("ij,ijk->ik", shares, corners[chosen])
    # Where planes have many triangles, the first points say enough.
    sums = np.cumsum(counts[chosen])
    last = max(int(np.searchsorted(sums, _MOST_PAIRS, side="right")), 1)
    found = np.zeros(last, bool)
    begin = 0
    while begin < last:
        before = sums[begin - 1] if begin else 0
        end = int(np.searchsorted(sums[:last], before + _PAIRS_AT_ONCE, side="right"))
        end = max(end, begin + 1)
        many = counts[chosen[begin:end]]
        i = np.repeat(np.arange(begin, end), many)
        offset = np.arange(len(i)) - np.repeat(np.cumsum(many) - many, many)
        j = order[first[chosen[i]] + offset]
        i, j = i[j != chosen[i]], j[j != chosen[i]]
        # Most often a point is not in the triangle, and no more has to be asked.
        inside = _holds(points[i], corners[j], normals[j])
        i, j = i[inside], j[inside]
        own = chosen[i]
        apart = np.einsum("ikj,ij->ik", corners[j] - corners[own][:, :1], normals[own])
        limit = np.einsum("ikj,ij->ik", np.abs(corners[j]), np.abs(normals[own]))
        limit = ROUNDING * limit + TURNED * np.minimum(size[j], size[own])[:, None]
        flat = np.abs(np.einsum("ij,ij->i", normals[j], normals[own])) > PARALLEL
        found[i[flat & (np.abs(apart) <= limit).all(axis=1)]] = True
        begin = end
    return float(found.mean())


def _holds(points: np.ndarray, corners: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(k,) whether a point (k, 3), seen along the normal, lies in a triangle, off its rim."""
    edges = np.roll(corners, -1, axis=1) - corners
    whole = np.einsum("ij,ij->i", np.cross(edges[:, 0], edges[:, 1]), normals)
    inside = np.ones(len(points), bool)
    for corner in range(3):
        part = np.cross(edges[:, corner], points - corners[:, corner])
        inside &= np.einsum("ij,ij->i", part, normals) > _INSIDE * whole
    return inside


def _places(positions: np.ndarray) -> np.ndarray:
    """(n,) uint64: equal positions have equal numbers, others do not, as good as always."""
    points = np.ascontiguousarray(positions, np.float32) + np.float32(0)  # -0 and 0 are one place
    x, y, z = points.view(np.uint32).astype(np.uint64).T
    return _mixed(_mixed(_mixed(x) + y) + z)


def _mixed(numbers: np.ndarray) -> np.ndarray:
    """The finaliser of SplitMix64."""
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        numbers = (numbers ^ (numbers >> np.uint64(shift))) * np.uint64(factor)
    mixed: np.ndarray = numbers ^ (numbers >> np.uint64(31))
    return mixed
