# SPDX-License-Identifier: GPL-3.0-or-later
"""A medium inside meshes -> dense voxels. Arrays only; no Blender here.

A Volume object has no faces: its medium ends where its voxels are 0. So a grid that lies inside a
mesh is sampled finer, and each voxel is taken by the share of it that the mesh fills.
"""

from __future__ import annotations

import numpy as np

from ..scene_read.values import GridValues, SceneValues

#: Fine voxels along the longest side: at least, and at most where the grid itself is fine.
LEAST, MOST = 128, 256
#: Vertical lines per fine voxel along x and along y, and where the first one stands in its part:
#: not in the middle, for edges of meshes like to stand there, and a line must not meet an edge.
_LINES = 2
_FIRST = (0.4871, 0.5113)


def fine_sizes(low: np.ndarray, high: np.ndarray, coarse: int) -> np.ndarray:
    """(nx, ny, nz) for a box with these corners and a grid of `coarse` voxels along its longest
    side."""
    longest = min(max(2 * coarse, LEAST), MOST)
    extent = high - low
    return np.maximum(1, np.round(longest * extent / extent.max())).astype(int)


def filled(
    scene: SceneValues, material: str, low: np.ndarray, high: np.ndarray, sizes: np.ndarray
) -> np.ndarray:
    """How often each voxel of the box from `low` to `high` lies inside bodies of the material,
    (nz, ny, nx) float32: 1 inside of one, a share at its surface. The bodies have to be closed."""
    nx, ny, nz = (int(n) for n in sizes)
    step = (high - low) / sizes
    part = np.zeros((ny, nx, nz + 2))
    above = np.zeros((ny, nx, nz + 2))
    for item in scene.objects:
        if material not in item.materials:
            continue
        mesh = scene.meshes[item.mesh]
        slots = np.array([name == material for name in item.materials])
        points = mesh.positions.astype(np.float64) @ item.matrix[:3, :3].T + item.matrix[:3, 3]
        points = (points - low) / step
        turned = np.linalg.det(item.matrix[:3, :3]) < 0
        for triangle in mesh.triangles[slots[mesh.material_slots]]:
            corners = points[triangle[::-1] if turned else triangle]
            _cross(corners, part, above, nz)
    inside = part[:, :, :nz] + np.cumsum(above, axis=2)[:, :, :nz]
    return np.maximum(inside, 0).transpose(2, 0, 1).astype(np.float32)


def _cross(corners: np.ndarray, part: np.ndarray, above: np.ndarray, nz: int) -> None:
    """Adds what the vertical lines through a triangle (3, 3), in voxels, enter or leave there: to
    `part` the share of the voxel that is met, to `above` one for all that lie higher."""
    ny, nx = part.shape[:2]
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = corners
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    if area == 0:  # it stands upright
        return
    lines = []
    for axis, count in ((0, nx), (1, ny)):
        ends = corners[:, axis].min(), corners[:, axis].max()
        first, last = (int(np.clip(np.floor(x * _LINES), 0, count * _LINES - 1)) for x in ends)
        lines.append(np.arange(first, last + 1))
    x = (lines[0] + _FIRST[0])[None, :] / _LINES
    y = (lines[1] + _FIRST[1])[:, None] / _LINES
    b = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area
    c = ((y - ay) * (bx - ax) - (x - ax) * (by - ay)) / area
    rows, columns = np.nonzero((b >= 0) & (c >= 0) & (b + c <= 1))
    if not len(rows):
        return
    b, c = b[rows, columns], c[rows, columns]
    height = np.clip(az + b * (bz - az) + c * (cz - az), 0, nz)
    voxel = height.astype(int)
    # Upwards through a face that looks down is in.
    sign = (-1.0 if area > 0 else 1.0) / _LINES**2
    iy, ix = lines[1][rows] // _LINES, lines[0][columns] // _LINES
    np.add.at(part, (iy, ix, voxel), sign * (voxel + 1 - height))
    np.add.at(above, (iy, ix, voxel + 1), sign)


def sampled(grid: GridValues, low: np.ndarray, high: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """The grid at the centres of other voxels, (nz, ny, nx, channels) float32, interpolated as in
    the renderer. Its box and that from `low` to `high` have to be parallel to the axes."""
    values = grid.values
    for axis, count in enumerate(sizes):
        centres = low[axis] + (np.arange(count) + 0.5) / count * (high[axis] - low[axis])
        unit = grid.to_unit[axis, axis] * centres + grid.to_unit[axis, 3]
        along = 2 - axis
        n = values.shape[along]
        place = np.clip(unit * n - 0.5, 0, n - 1)
        lower = np.minimum(place.astype(int), max(n - 2, 0))
        share = (place - lower).astype(np.float32)
        share = share.reshape([-1 if i == along else 1 for i in range(4)])
        first = np.take(values, lower, axis=along)
        second = np.take(values, np.minimum(lower + 1, n - 1), axis=along)
        values = first + (second - first) * share
    return np.ascontiguousarray(values, np.float32)
