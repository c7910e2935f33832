# SPDX-License-Identifier: GPL-3.0-or-later
"""Scale and pose of what was imported, afterwards: all objects of its collection move as one."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import mathutils
import numpy as np

from ..problems import BadInput, Problem
from .placement import plane_rotation, why_no_plane
from .to_blender import TO_FILE

#: Of a collection that another Blender has saved, or a user has typed into.
_NUMBERS = 16


def collection_of(scene: bpy.types.Scene, item: bpy.types.Object | None) -> bpy.types.Collection:
    """The import that holds `item`, or else the scene's only one. Raises BadInput."""
    found = [one for one in scene.collection.children_recursive if is_import(one)]
    holding = [one for one in found if item is not None and item.name in one.all_objects]
    if len(holding or found) == 1:
        return (holding or found)[0]
    cause = "no import is in the scene" if not found else "it is not clear which import is meant"
    cure = "import a reconstruction, or make one of its objects the active one"
    raise BadInput(Problem("Reconstruction", cause, cure))


def is_import(collection: bpy.types.Collection) -> bool:
    """Whether it was made by an import."""
    return collection.get(TO_FILE) is not None


def picked_points(context: bpy.types.Context, count: int) -> list[np.ndarray]:
    """World places of what is selected: vertices in Edit Mode, else objects. Raises BadInput unless
    there are `count`."""
    item = context.active_object
    if item is not None and item.mode == "EDIT" and item.type == "MESH":
        item.update_from_editmode()
        chosen = [item.matrix_world @ one.co for one in item.data.vertices if one.select]
    else:
        chosen = [one.matrix_world.translation for one in context.selected_objects]
    if len(chosen) != count:
        cause = f"{len(chosen)} points are selected"
        cure = (
            f"select {count} vertices in Edit Mode, or {count} objects such as cameras or empties "
            "at the points"
        )
        raise BadInput(Problem("Selection", cause, cure))
    return [np.array(point, np.float64) for point in chosen]


def scale_to(
    collection: bpy.types.Collection, points: Sequence[np.ndarray], length: float
) -> float:
    """Scales about the world's origin so that two points become `length` Blender units apart.
    Returns the factor. Raises BadInput."""
    distance = float(np.linalg.norm(points[0] - points[1]))
    if not distance > 0:
        cure = "select two points that lie apart"
        raise BadInput(Problem("Selection", "both points are at the same place", cure))
    factor = length / distance
    move(collection, factor, np.eye(3), np.zeros(3))
    return factor


def level_to(collection: bpy.types.Collection, points: Sequence[np.ndarray]) -> float:
    """Turns so that three points lie at z = 0, and cameras (or else everything) above. Returns the
    angle in radians. Raises BadInput."""
    if why := why_no_plane(points):
        cure = "select three points that are no line"
        raise BadInput(Problem("Selection", why, cure))
    places = [item.matrix_world.translation for item in _roots(collection)]
    cameras = [item.matrix_world.translation for item in _roots(collection) if _is_camera(item)]
    above = np.mean([np.array(place, np.float64) for place in cameras or places], axis=0)
    rotation = plane_rotation(points, above)
    height = float((rotation @ points[0])[2])
    move(collection, 1.0, rotation, np.array([0.0, 0.0, -height]))
    return float(np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1)))


def move(
    collection: bpy.types.Collection, scale: float, rotation: np.ndarray, shift: np.ndarray
) -> None:
    """World = scale * rotation before + shift, of everything in the collection. Cameras keep the
    scale 1. The collection's matrix to the file follows."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = scale * rotation, shift
    for item in _roots(collection):
        world = matrix @ np.array(item.matrix_world, np.float64)
        if _is_camera(item):
            world[:3, :3] /= np.linalg.norm(world[:3, :3], axis=0)
            data = item.data
            data.clip_start, data.clip_end = data.clip_start * scale, data.clip_end * scale
            data.display_size *= scale
        item.matrix_world = mathutils.Matrix(world.tolist())
    numbers = np.array(collection[TO_FILE], np.float64)
    if numbers.size == _NUMBERS:
        collection[TO_FILE] = (numbers.reshape(4, 4) @ np.linalg.inv(matrix)).ravel().tolist()


def size_of(collection: bpy.types.Collection) -> np.ndarray:
    """(3,) of the box around all that renders, along the world's axes, in Blender units."""
    corners = [
        np.array(item.matrix_world @ mathutils.Vector(corner))
        for item in collection.all_objects
        if item.type == "MESH" and not item.hide_render
        for corner in item.bound_box
    ]
    return np.ptp(corners, axis=0) if corners else np.zeros(3)


def _roots(collection: bpy.types.Collection) -> list[bpy.types.Object]:
    """Objects that no other one of the collection carries along."""
    inside = set(collection.all_objects)
    return [item for item in inside if item.parent not in inside]


def _is_camera(item: bpy.types.Object) -> bool:
    return item.type == "CAMERA"
