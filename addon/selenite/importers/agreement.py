# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a mesh lies where the cameras look: files of two programs may have other coordinates."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .placement import Y_UP
from .reconstruction import ReconstructedCamera, ReconstructedMesh, Reconstruction

#: Vertices and points that are looked at, evenly over all; up to twice as many.
_SAMPLE = 1000
#: Points of a reconstruction that say where its mesh is.
_ENOUGH = 20
#: Widths of a photo around it that count as in it: a lens may distort that much.
_MARGIN = 0.1
#: How a mesh has to lie in other axes than those of its format: so many times better, seen by the
#: cameras in so large a part, and so near to the points, as a share of its size.
_CLEARLY, _MOSTLY, _NEAR = 1.5, 0.5, 0.05
#: From Blender's axes, in which a glTF's y points to z, to those of the file.
_FILE_AXES = Y_UP.T


def remarks_on(found: Reconstruction) -> list[str]:
    """What is to be known of a mesh before a fit, a line each."""
    if not found.meshes:
        cause = "there is no mesh, which a fit needs"
        return [f"{cause}: import its file, with this one as that of the cameras"]
    remarks = [
        f"mesh '{mesh.name}' has vertex colours: they are its attribute 'Color'; its base colour "
        "is white, so that it can be fitted"
        for mesh in found.meshes
        if mesh.colors is not None and not mesh.textured
    ]
    points = _sample([mesh.positions for mesh in found.meshes])
    blind = sum(not _seen(camera, points).any() for camera in found.cameras)
    if 2 * blind > len(found.cameras):
        remarks.append(
            f"{blind} of {len(found.cameras)} cameras see nothing of the mesh: it seems to have "
            "other coordinates than they; export both with the same settings"
        )
    return remarks


def with_axes_of_cameras(
    meshes: Sequence[ReconstructedMesh], found: Reconstruction, file: str
) -> tuple[tuple[ReconstructedMesh, ...], str]:
    """Meshes of a glTF as Blender turns them, or in the file's own axes where they lie better so
    in the cameras' file; and a remark. The format says that y points upward, but some programs
    write the axes of their cameras."""
    points = _sample([mesh.positions for mesh in meshes])
    if not _is_better(points @ _FILE_AXES.T, points, found):
        return tuple(meshes), f"mesh file '{file}' is turned: y points upward in glTF, z here"
    turned = tuple(
        replace(
            mesh,
            positions=mesh.positions @ _FILE_AXES.T,
            normals=None if mesh.normals is None else mesh.normals @ _FILE_AXES.T,
        )
        for mesh in meshes
    )
    return turned, f"mesh file '{file}' is not turned: its axes are those of the cameras"


def _is_better(other: np.ndarray, usual: np.ndarray, found: Reconstruction) -> bool:
    """Whether vertices lie better at other places, by the points of the reconstruction, or by the
    share of them that cameras see."""
    if len(found.points) < _ENOUGH:
        shares = [
            np.mean([_seen(camera, vertices).mean() for camera in found.cameras])
            for vertices in (other, usual)
        ]
        return bool(shares[0] >= _MOSTLY and shares[0] > _CLEARLY * shares[1])
    points = _sample([found.points])
    distances = [_distance(points, vertices) for vertices in (other, usual)]
    size = float(np.linalg.norm(np.ptp(usual, axis=0)))
    return distances[0] < _NEAR * size and _CLEARLY * distances[0] < distances[1]


def _distance(points: np.ndarray, vertices: np.ndarray) -> float:
    """Of the points from the vertices that are nearest, the middle one."""
    square = (points**2).sum(axis=1)[:, None] + (vertices**2).sum(axis=1)
    nearest = np.maximum(square - 2 * points @ vertices.T, 0).min(axis=1)
    return float(np.sqrt(np.median(nearest)))


def _sample(parts: Sequence[np.ndarray]) -> np.ndarray:
    points = np.concatenate([np.asarray(part, np.float64).reshape(-1, 3) for part in parts])
    return points[:: max(1, len(points) // _SAMPLE)]


def _seen(camera: ReconstructedCamera, points: np.ndarray) -> np.ndarray:
    """(n,) whether each lies before a camera and in its photo, or near."""
    matrix = camera.camera_to_world
    x, y, z = matrix[:3, :3].T @ (points - matrix[:3, 3]).T
    if camera.intrinsics is None:  # the whole photo is inside of this cone
        return z > np.hypot(x, y) * math.tan(max(math.pi / 2 - camera.field_of_view, 0.0))
    lens, margin = camera.intrinsics.lens, _MARGIN * camera.intrinsics.width
    u, v = x * lens.fx + z * lens.cx, y * lens.fy + z * lens.cy
    inside = (u > -margin * z) & (u < (camera.intrinsics.width + margin) * z)
    return (z > 0) & inside & (v > -margin * z) & (v < (camera.intrinsics.height + margin) * z)
