# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the next photo could be taken from: places around what is fitted, and idle cameras."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ... import native
from ...problems import BadInput, Problem, listed
from ...scene_read.values import CameraValues, SceneValues

if TYPE_CHECKING:
    from ..._core import Scene

#: Elevation in degrees and number of places: about as far from each other on every ring.
_RINGS = ((12, 10), (38, 8), (62, 5), (85, 1), (-20, 8), (-50, 6))
#: Of the points of the object that are tested, so many have to be visible.
_SEEN = 5
#: A camera keeps this distance from the centre at least, in radii of what it looks at.
_LEAST_RADII = 1.3
#: Flat, and so no body to walk around: the smallest side of its box over the largest.
_FLAT = 0.01
#: A direction this near to the vertical (sine of the angle) has no azimuth.
_VERTICAL = 0.1


@dataclass(frozen=True)
class Body:
    """What the photos are about: its box in world space, (3,) each, and the objects in it, counted
    as in SceneValues.objects."""

    low: np.ndarray
    high: np.ndarray
    objects: tuple[int, ...]
    names: str  # for a message

    @property
    def centre(self) -> np.ndarray:
        """(3,), of the box."""
        return (self.low + self.high) / 2

    @property
    def radius(self) -> float:
        """Of the sphere around the box."""
        return float(np.linalg.norm(self.high - self.low) / 2)


@dataclass(frozen=True)
class Candidate:
    """A camera that could take a photo. Angles in degrees: `azimuth` to the right of the first
    photo's camera (negative: to the left), `elevation` above the centre of the object.
    `existing`: a camera of the scene, at its own place."""

    camera: CameraValues
    azimuth: float
    elevation: float
    existing: bool

    @property
    def position(self) -> np.ndarray:
        """(3,), world space."""
        return self.camera.matrix[:3, 3]


def body_of(values: SceneValues, owners: Collection[str]) -> Body:
    """The objects with a material among `owners`. Where only lights are fitted: everything that is
    not flat, or everything. Raises BadInput where the owner is on no object."""
    boxes = [_box(values, index) for index in range(len(values.objects))]
    materials = [name for name in owners if name in {item.name for item in values.materials}]
    chosen = [
        index
        for index, item in enumerate(values.objects)
        if set(materials) & set(item.materials) and item.visible_to_camera
    ]
    if materials and not chosen:
        cause = "no object that a camera sees has it"
        cure = "give it to an object, or fit another parameter"
        raise BadInput(Problem(f"Material {listed(materials)}", cause, cure))
    if not chosen:
        seen = [i for i, item in enumerate(values.objects) if item.visible_to_camera]
        chosen = [i for i in seen if not _is_flat(*boxes[i])] or seen
    low = np.min([boxes[index][0] for index in chosen], axis=0)
    high = np.max([boxes[index][1] for index in chosen], axis=0)
    names = dict.fromkeys(values.objects[index].name for index in chosen)
    return Body(low, high, tuple(chosen), listed(names))


def candidates(
    values: SceneValues, scene: Scene, photographed: Sequence[str], body: Body
) -> list[Candidate]:
    """Places from which the body can be seen, and cameras of the scene without a photo.

    A place has the lens of the first photo's camera and the distance of the photos' cameras. It has
    to see the centre of the body and most of its extent, and lie above flat ground that is below
    the body. `scene` is native, `photographed` the cameras of the photos. Raises BadInput where
    every way is blocked.
    """
    first = next(item for item in values.cameras if item.name == photographed[0])
    taken = [item for item in values.cameras if item.name in photographed]
    distances = [np.linalg.norm(item.matrix[:3, 3] - body.centre) for item in taken]
    distance = max(float(np.median(distances)), _LEAST_RADII * body.radius)
    front = _front(first, body.centre)
    ground = _ground(values, body)
    found: list[Candidate] = []
    blockers: set[str] = set()
    for elevation, count in _RINGS:
        for step in range(count):
            # Every other ring half a step on, so that no place stands below another one.
            turn = 2 * math.pi * (step + (0.5 if abs(elevation) in (38, 20) else 0.0)) / count
            up = math.radians(elevation)
            side = math.cos(up) * _turned(front, turn)
            matrix = looking_at(body.centre + distance * (side + [0, 0, math.sin(up)]), body.centre)
            if ground is not None and matrix[2, 3] <= ground:
                continue
            reason = _blocked(values, scene, matrix[:3, 3], body)
            if reason:
                blockers.add(reason)
                continue
            name = _free_name(f"place {len(found) + 1}", values)
            camera = replace(first, name=name, matrix=matrix, shift_x=0.0, shift_y=0.0)
            found.append(Candidate(camera, _degrees(turn), float(elevation), existing=False))
    for item in values.cameras:
        if item.name not in photographed:
            found.append(_existing(item, body.centre, front))
    if not found:
        names = listed(sorted(blockers))
        cause = f"no place at distance {distance:.3g} around it sees it; in the way: {names}"
        cure = "hide what is in the way from camera rays, or put cameras where photos can be taken"
        raise BadInput(Problem(f"Object {body.names}", cause, cure))
    return found


def _free_name(name: str, values: SceneValues) -> str:
    """That no camera of the scene has."""
    taken = {item.name for item in values.cameras}
    while name in taken:
        name += "'"
    return name


def looking_at(position: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """(4, 4): a camera at `position` that looks at `centre`, upright."""
    back = (position - centre) / np.linalg.norm(position - centre)
    right = np.cross([0.0, 0.0, 1.0], back)
    size = np.linalg.norm(right)
    right = right / size if size > 1e-9 else np.array([1.0, 0.0, 0.0])
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack([right, np.cross(back, right), back])
    matrix[:3, 3] = position
    return matrix


def _existing(camera: CameraValues, centre: np.ndarray, front: np.ndarray) -> Candidate:
    way = camera.matrix[:3, 3] - centre
    size = max(float(np.linalg.norm(way)), 1e-9)
    side = _front(camera, centre)
    turn = math.atan2(front[0] * side[1] - front[1] * side[0], float(front @ side))
    elevation = math.degrees(math.asin(max(-1.0, min(1.0, float(way[2]) / size))))
    return Candidate(camera, _degrees(turn), elevation, existing=True)


def _front(camera: CameraValues, centre: np.ndarray) -> np.ndarray:
    """(3,) horizontal, unit: from the centre to where the camera stands. For one that looks
    straight down, where the lower edge of its picture is."""
    way = camera.matrix[:3, 3] - centre
    flat = way * [1, 1, 0]
    if np.linalg.norm(flat) < _VERTICAL * np.linalg.norm(way):
        flat = -camera.matrix[:3, 1] * [1, 1, 0]
    size = np.linalg.norm(flat)
    return flat / size if size > 1e-9 else np.array([0.0, -1.0, 0.0])


def _turned(front: np.ndarray, angle: float) -> np.ndarray:
    """Counter-clockwise seen from above: to the right of who stands in front."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([c * front[0] - s * front[1], s * front[0] + c * front[1], 0.0])


def _degrees(turn: float) -> float:
    """In (-180, 180]."""
    angle = math.degrees(turn) % 360
    return angle - 360 if angle > 180 else angle


def _blocked(values: SceneValues, scene: Scene, position: np.ndarray, body: Body) -> str:
    """The object in the way, "" for none. Tested are the centre and a point near the end of
    each side of the box; what the body hides of itself does not count."""
    half = 0.4 * (body.high - body.low)
    points = body.centre + np.vstack([np.zeros(3), np.diag(half), -np.diag(half)])
    starts = np.repeat(position[None], len(points), axis=0)
    hits = native.core().first_hits(scene, starts, points)
    others = [int(i) for i in hits if i >= 0 and int(i) not in body.objects]
    if int(hits[0]) not in others and len(points) - len(others) >= _SEEN:
        return ""
    return values.objects[others[0]].name


def _ground(values: SceneValues, body: Body) -> float | None:
    """Height of the flat ground below the body, or None: no photo is taken from under it."""
    found = []
    for index in range(len(values.objects)):
        low, high = _box(values, index)
        level = _is_flat(low, high) and int(np.argmin(high - low)) == 2
        under = (low[:2] <= body.centre[:2]).all() and (body.centre[:2] <= high[:2]).all()
        # A body may reach a little into its ground.
        if level and under and high[2] <= body.centre[2]:
            found.append(float(high[2]))
    return max(found) if found else None


def _is_flat(low: np.ndarray, high: np.ndarray) -> bool:
    return float((high - low).min()) <= _FLAT * float((high - low).max())


def _box(values: SceneValues, index: int) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest corner in world space of one object."""
    item = values.objects[index]
    mesh = values.meshes[item.mesh]
    used = mesh.positions[np.unique(mesh.triangles)].astype(np.float64)
    world = used @ item.matrix[:3, :3].T + item.matrix[:3, 3]
    world = world[np.isfinite(world).all(axis=1)]
    return world.min(axis=0), world.max(axis=0)
