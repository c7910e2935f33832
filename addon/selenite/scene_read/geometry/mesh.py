# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes after modifiers, as triangles with corner normals and UVs; instances share one mesh."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...messages import remark, thing
from ...problems import Problem
from .. import hosts
from ..values import MeshValues, SceneValues
from . import corner_normals, not_rendered

if TYPE_CHECKING:
    from ..hosts import BpyStruct

#: Embree, by which Cycles traces rays, leaves out what is farther.
_FARTHEST = 1.8e18
#: A cube with one vertex 1e4 of its sizes away is 2 % brighter or darker than in Cycles, with 1e5
#: 20 %.
_STRETCHED = 3e4
#: Sizes below this part of others are none.
_FLAT = 1e-6


@dataclass(frozen=True)
class Instance:
    """One object that Cycles would render. `object` is evaluated and valid in this step only.

    `instancer`: the original object that shows it; itself where nothing else does.
    """

    object: bpy.types.Object
    original: bpy.types.Object
    instancer: bpy.types.Object
    matrix: np.ndarray
    is_instance: bool
    random_id: int = 0


def unflattened(instance: Instance, positions: np.ndarray) -> Instance | None:
    """An instance whose scale is 0 across a flat mesh, with another one there: the same picture.
    None if it renders as nothing. Cycles applies such a matrix where no other object has the mesh,
    and cannot invert it elsewhere."""
    left, scales, right = np.linalg.svd(instance.matrix[:3, :3])
    extents = np.ptp(positions @ right.T, axis=0)
    shared = instance.original.data.users > 1 and not instance.original.modifiers
    is_line = scales[1] <= _FLAT * scales[0]
    if is_line or extents[2] > _FLAT * extents.max() or shared or instance.is_instance:
        return None
    scales[2] = np.sqrt(scales[0] * scales[1]) * np.linalg.det(left) * np.linalg.det(right)
    matrix = instance.matrix.copy()
    matrix[:3, :3] = (left * scales) @ right
    return replace(instance, matrix=matrix)


def rendered_instances(depsgraph: bpy.types.Depsgraph, read: SceneValues) -> Iterator[Instance]:
    """Everything that renders, of a graph in render mode, by the rule of Cycles; what is not
    rendered here is noted in `read`."""
    for item in depsgraph.object_instances:
        evaluated = item.object
        original = evaluated.original
        if item.show_particles:
            not_rendered.judge_hair(evaluated, read)
            not_rendered.judge_simulation(evaluated, depsgraph.scene.frame_current, read)
        if not item.show_self or not not_rendered.is_read(evaluated, original, read):
            continue
        instancer = item.parent.original if item.is_instance else original
        matrix = np.array(item.matrix_world, np.float64)
        yield Instance(
            evaluated, original, instancer, matrix, item.is_instance, item.random_id & 0xFFFFFFFF
        )


@contextmanager
def mesh_of(evaluated: bpy.types.Object) -> Iterator[BpyStruct]:
    """The mesh of an evaluated mesh object, None if it has none."""
    mesh: BpyStruct = evaluated.data
    # As Cycles does: a copy, which takes time, only where the mesh itself does not do.
    if not mesh.is_editmode and not getattr(mesh, "use_auto_smooth", False):
        yield mesh
        return
    try:
        yield evaluated.to_mesh()
    finally:
        evaluated.to_mesh_clear()


def read_mesh(
    evaluated: bpy.types.Object, check: Callable[[], None], read: SceneValues
) -> MeshValues | None:
    """Triangles of an evaluated mesh object, None if it has none. check: see GraphRead.

    Triangles with a vertex that is not finite are dropped and counted in `read.warnings`; the
    user's mesh is not touched.
    """
    with mesh_of(evaluated) as mesh:
        return _triangles(mesh, evaluated, check, read) if mesh is not None else None


def _triangles(
    mesh: bpy.types.Mesh,
    evaluated: bpy.types.Object,
    check: Callable[[], None],
    read: SceneValues,
) -> MeshValues | None:
    corner_vertices = hosts.corner_vertices(mesh)
    if not _is_sound(mesh, corner_vertices):
        cause = "its faces name corners or vertices that it does not have"
        cure = "repair it (bpy.data.meshes[...].validate()) or delete it"
        read.problems.append(Problem(thing("Mesh", evaluated.data.name), cause, cure))
        return None
    check()
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    if count == 0:
        return None
    positions = hosts.floats(mesh.vertices, "co", 3)
    corners = hosts.whole_numbers(mesh.loop_triangles, "loops", 3).astype(np.intp)
    check()
    vertices = np.take(corner_vertices, corners)
    normals = corner_normals.of(mesh, positions, corners, vertices).reshape(-1, 3, 3)
    if hosts.has_free_normals(mesh) and _differ_in_length(normals):
        cause = "its custom normals differ in length, by which Cycles weights them"
        cure = "normalize them before the node Set Mesh Normal"
        read.problems.append(Problem(thing("Object", evaluated.name), cause, cure))
    check()
    uv_maps = hosts.corner_uv_maps(mesh, corners)
    stored = hosts.stored_colors(mesh, corners, vertices)
    colors = tuple((name, np.take(values, where, axis=0)) for name, values, where in stored)
    check()
    triangles, slots = vertices.reshape(-1, 3), _slots(mesh, evaluated)
    known = {name for name, _ in (*uv_maps, *colors)}
    others = tuple(item.name for item in mesh.attributes if item.name not in known)

    finite = is_placed(positions)
    if not finite.all():
        good = finite[triangles].all(axis=1)
        read.warn(
            remark(
                thing("Object", evaluated.name),
                f"{int((~good).sum())} triangles with vertices that are not finite are "
                "left out, as in Cycles",
            )
        )
        positions = np.where(finite[:, None], positions, np.float32(0))
        triangles, slots, normals = triangles[good], slots[good], normals[good]
        kept = np.repeat(good, 3)
        uv_maps = tuple((name, values[kept]) for name, values in uv_maps)
        colors = tuple((name, values[kept]) for name, values in colors)
        stored = tuple((name, values, where[kept]) for name, values, where in stored)
        if not len(triangles):
            return None
    if count := _stretched(positions, triangles):
        cause = (
            f"{count} of its triangles are {_STRETCHED:.0f} times as long as others: Cycles shows "
            "them with rounding errors; delete or move the vertices that are so far away"
        )
        read.warn(remark(thing("Object", evaluated.name), cause))
    return MeshValues(
        name=evaluated.data.name,
        positions=positions,
        triangles=np.ascontiguousarray(triangles),
        corner_normals=np.ascontiguousarray(normals.reshape(-1, 3)),
        material_slots=slots,
        uv_maps=uv_maps,
        colors=colors,
        stored_colors=stored if _is_own_mesh(mesh, evaluated) else (),
        own_vertices=_is_own_mesh(mesh, evaluated) and not _is_modified(evaluated),
        other_attributes=others,
    )


def _is_own_mesh(mesh: bpy.types.Mesh, evaluated: bpy.types.Object) -> bool:
    """Whether its vertices and corners are those of the user's mesh."""
    own = evaluated.original.data
    return isinstance(own, bpy.types.Mesh) and (
        (len(mesh.vertices), len(mesh.loops)) == (len(own.vertices), len(own.loops))
    )


def _is_modified(evaluated: bpy.types.Object) -> bool:
    """Whether modifiers may move its vertices."""
    return any(item.show_render for item in evaluated.original.modifiers)


def is_placed(positions: np.ndarray) -> np.ndarray:
    """(n,) bool of vertices (n, 3): those of which Cycles' ray tracing takes the faces. Blender
    makes the largest number of what is infinite."""
    with np.errstate(invalid="ignore"):
        placed: np.ndarray = (np.abs(positions) < _FARTHEST).all(axis=1)
    return placed


def _stretched(positions: np.ndarray, triangles: np.ndarray) -> int:
    """How many triangles are far longer than wide, and than the others."""

    def edges(some: np.ndarray) -> np.ndarray:
        corners = positions[some].astype(np.float64)
        return np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)

    few = triangles[:: -(-len(triangles) // 10_000)]
    least = _STRETCHED * np.quantile(edges(few).max(axis=1), 0.25)
    if least == 0 or np.ptp(positions, axis=0).max() <= least:
        return 0
    lengths = edges(triangles)
    longest = lengths.max(axis=1)
    return int(((longest > least) & (longest > _STRETCHED * lengths.min(axis=1))).sum())


def _differ_in_length(normals: np.ndarray) -> bool:
    """Whether those of a triangle (m, 3, 3) do, by more than rounding; not where one is missing."""
    lengths = np.linalg.norm(normals, axis=2)
    return bool((lengths.max(axis=1) > 1.001 * lengths.min(axis=1)).any())


def _slots(mesh: bpy.types.Mesh, evaluated: bpy.types.Object) -> np.ndarray:
    """The material slot of each triangle, as Cycles takes those that are not there."""
    last = len(evaluated.material_slots) - 1
    if last < 1:
        return np.zeros(len(mesh.loop_triangles), np.int32)
    of_face = hosts.whole_numbers(mesh.polygons, "material_index")
    return np.clip(np.take(of_face, hosts.triangle_faces(mesh)), 0, last)


def _is_sound(mesh: bpy.types.Mesh, corner_vertices: np.ndarray) -> bool:
    """Whether Blender can go through its faces: those of a damaged file would end the process."""
    starts = hosts.whole_numbers(mesh.polygons, "loop_start")
    counts = hosts.whole_numbers(mesh.polygons, "loop_total")
    ends = starts.astype(np.int64) + counts
    return bool(
        ((corner_vertices >= 0) & (corner_vertices < len(mesh.vertices))).all()
        and ((starts >= 0) & (counts >= 0) & (ends <= len(corner_vertices))).all()
    )
