# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a reconstruction stands in Blender's world: unit, upward axis, ground and offset.

Blender keeps single precision, which resolves 0.06 at coordinates of a million: what lies far from
the origin is moved there in double precision, and the offset is kept.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..problems import Problem
from .reconstruction import FLIP, Reconstruction

#: Half diagonals from the origin beyond which a reconstruction is moved. Single precision then
#: errs by 1e-6 of the half diagonal at most: 0.005 pixels at a focal length of 5000.
FAR = 16.0
#: A triangle of points that is flatter has no plane: height / longest side.
_FLAT = 1e-6
#: Takes y to z and z to -y.
Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


@dataclass(frozen=True)
class Placement:
    """Blender's world = scale * rotation (point - offset).

    offset: (3,) in coordinates of the file. rotation: (3, 3). scale: Blender units in one unit of
    the file.
    """

    offset: np.ndarray
    rotation: np.ndarray
    scale: float

    def points(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) of the file -> (n, 3) of Blender's world, double."""
        return self.scale * ((np.asarray(points, np.float64) - self.offset) @ self.rotation.T)

    def directions(self, directions: np.ndarray) -> np.ndarray:
        """(..., 3) of the file -> Blender's world; lengths stay."""
        return np.asarray(directions, np.float64) @ self.rotation.T

    def camera(self, camera_to_world: np.ndarray) -> np.ndarray:
        """4 x 4 of a camera that looks along +z with y down -> of Blender's, along -z with y up."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.rotation @ camera_to_world[:3, :3] @ FLIP
        matrix[:3, 3] = self.points(camera_to_world[None, :3, 3])[0]
        return matrix

    def box(self, matrix: np.ndarray) -> np.ndarray:
        """4 x 4 from a box to the file -> from the box to Blender's world."""
        found = np.eye(4)
        found[:3, :3] = self.scale * self.rotation @ matrix[:3, :3]
        found[:3, 3] = self.points(matrix[None, :3, 3])[0]
        return found

    def to_file(self) -> np.ndarray:
        """4 x 4 from Blender's world to coordinates of the file."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.rotation.T / self.scale
        matrix[:3, 3] = self.offset
        return matrix


def placement_of(
    found: Reconstruction,
    scale: float,
    up: str = "Z",
    ground: Sequence[np.ndarray] | None = None,
) -> Placement:
    """Keeps the file's origin unless the reconstruction lies FAR from it.

    scale: Blender units in one unit of the file. up: which axis of the file points upward, "Z" or
    "Y". ground: three points of the file, not in a line, whose plane becomes z = 0; the side of
    the cameras is above.
    """
    positions = extent_of(found)
    low, high = (positions.min(axis=0), positions.max(axis=0)) if len(positions) else (0.0, 0.0)
    centre = np.zeros(3) + (low + high) / 2
    half = float(np.linalg.norm(np.zeros(3) + high - low)) / 2
    rotation = Y_UP if up == "Y" else np.eye(3)
    if ground is not None:
        rotation = _plane_rotation(ground, _above(found, centre), rotation)
        normal = rotation.T @ np.array([0.0, 0.0, 1.0])
        return Placement(centre - normal * ((centre - ground[0]) @ normal), rotation, scale)
    if np.abs(centre).max() <= FAR * half:
        return Placement(np.zeros(3), rotation, scale)
    step = 10.0 ** math.floor(math.log10(half)) if half > 0 else 1.0
    return Placement(np.round(centre / step) * step, rotation, scale)


def extent_of(found: Reconstruction) -> np.ndarray:
    """(n, 3) of the file that say how far it reaches: cameras and meshes, else points."""
    parts = [np.asarray(mesh.positions, np.float64) for mesh in found.meshes]
    parts += [item.camera_to_world[None, :3, 3] for item in found.cameras]
    parts = [part for part in parts if len(part)] or [np.asarray(found.points, np.float64)]
    return np.concatenate(parts).reshape(-1, 3)


def unit_scale(
    found: Reconstruction, meters: float | None, unit_length: float
) -> tuple[float, str]:
    """(Blender units in one unit of the file, a remark or "").

    meters: in one unit, as the user says. unit_length: metres in one Blender unit.
    """
    known = meters if meters is not None else found.meters_per_unit
    remark = ""
    if known is None:
        remark = (
            "the file does not say how long its unit is: it counts as 1 m; give the metres in "
            "one unit, or two points and their distance"
        )
    return (1.0 if known is None else known) / unit_length, remark


def distance_scale(
    points: Sequence[np.ndarray], meters: float, problems: list[Problem]
) -> float | None:
    """Metres in one unit of the file, from two points of it and their distance in metres."""
    distance = float(np.linalg.norm(points[0] - points[1]))
    if not distance > 0:
        cure = "give two different points"
        problems.append(Problem("Scale", "both points are at the same place", cure))
        return None
    return meters / distance


def why_no_plane(points: Sequence[np.ndarray]) -> str:
    """Why three points have no plane; "" if they have one."""
    a, b, c = (np.asarray(point, np.float64) for point in points)
    longest = max(np.linalg.norm(b - a), np.linalg.norm(c - a), np.linalg.norm(c - b))
    area = np.linalg.norm(np.cross(b - a, c - a))
    flat = not longest > 0 or area / longest**2 < _FLAT
    return "the three points lie in one line" if flat else ""


def plane_rotation(points: Sequence[np.ndarray], above: np.ndarray) -> np.ndarray:
    """(3, 3), the smallest that makes the plane of three points level; `above`: a point on its
    upper side."""
    return _plane_rotation(points, above, np.eye(3))


def _plane_rotation(
    points: Sequence[np.ndarray], above: np.ndarray, first: np.ndarray
) -> np.ndarray:
    """The same after the rotation `first`."""
    a, b, c = (first @ point for point in points)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal)
    if normal @ (first @ above - a) < 0:
        normal = -normal
    return _smallest_rotation(normal) @ first


def _smallest_rotation(normal: np.ndarray) -> np.ndarray:
    """(3, 3) that takes a unit vector to z (Rodrigues' formula)."""
    cosine = normal[2]
    if cosine < -1 + 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    x, y = normal[1], -normal[0]  # normal x z
    cross = np.array([[0, 0, y], [0, 0, -x], [-y, x, 0]])
    return np.eye(3) + cross + cross @ cross / (1 + cosine)


def _above(found: Reconstruction, centre: np.ndarray) -> np.ndarray:
    centres = [item.camera_to_world[:3, 3] for item in found.cameras]
    return np.mean(centres, axis=0) if centres else centre
