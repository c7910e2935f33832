# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces of a mesh that lie on each other and share an edge: twice the same, or folded.

Cycles shows them with shadows, or black, as it does two objects in one plane: see `overlaps`.
"""

from __future__ import annotations

import numpy as np

from ...messages import remark, thing
from ...problems import Problem
from ..values import MeshValues, SceneValues
from .overlaps import PARALLEL, ROUNDING, TURNED

#: The part of a mesh's area that is named.
_LEAST = 1e-3
#: The part that is refused: what a fit would take for the light of the body.
_MOST = 0.1
_CURE = "in Edit Mode select all and delete those that are too many"


def warn_of_folds(read: SceneValues) -> None:
    """Adds a warning for each mesh with more than a few, a problem where a tenth of it is. 1.5 s of
    CPU time for a million triangles."""
    used = {item.mesh for item in read.objects}
    for index, mesh in enumerate(read.meshes):
        count, part = folded(mesh) if index in used else (0, 0.0)
        if part > _MOST:
            cause = (
                f"{count} of its triangles lie on each other, which Cycles shows otherwise (with "
                "shadows, or black)"
            )
            read.problems.append(Problem(thing("Mesh", mesh.name), cause, _CURE))
        elif part > _LEAST:
            read.warn(
                remark(
                    thing("Mesh", mesh.name),
                    f"{count} of its triangles lie on each other, which Cycles shows "
                    "otherwise (with shadows, or black): delete those that are too many",
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
