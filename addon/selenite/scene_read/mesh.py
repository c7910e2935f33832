# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes after modifiers, as triangles with corner normals and UVs; instances share one mesh."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import bpy
import numpy as np

from . import hosts, not_rendered
from .values import MeshValues, SceneValues


@dataclass(frozen=True)
class Instance:
    """One object that Cycles would render. `object` is evaluated and valid in this step only.

    `instancer`: the original object that shows it, itself where nothing else does.
    """

    object: bpy.types.Object
    original: bpy.types.Object
    instancer: bpy.types.Object
    matrix: np.ndarray
    is_instance: bool


def rendered_instances(depsgraph: bpy.types.Depsgraph, read: SceneValues) -> Iterator[Instance]:
    """Everything that renders, of a graph in render mode, by the rule of Cycles; what is not
    rendered here is noted in `read`."""
    for item in depsgraph.object_instances:
        evaluated = item.object
        original = evaluated.original
        if item.show_particles:
            not_rendered.judge_hair(evaluated, read)
        if not item.show_self or not not_rendered.is_read(evaluated, original, read):
            continue
        instancer = item.parent.original if item.is_instance else original
        matrix = np.array(item.matrix_world, np.float64)
        yield Instance(evaluated, original, instancer, matrix, item.is_instance)


def warn_of_object(original: bpy.types.Object, read: SceneValues) -> None:
    """Notes what Selenite renders differently from Cycles for this object."""
    title = f"Object '{original.name}'"
    for flag in ("diffuse", "glossy", "transmission", "volume_scatter", "shadow"):
        if not getattr(original, f"visible_{flag}", True):
            read.warn(f"{title}: its ray visibility '{flag}' is not modelled; rendered as visible")
    if original.is_holdout or original.is_shadow_catcher:
        read.warn(f"{title}: holdout and shadow catcher are not modelled")


def read_mesh(evaluated: bpy.types.Object, read: SceneValues) -> MeshValues | None:
    """Triangles of an evaluated mesh object, None if it has none.

    Triangles with a vertex that is not finite are dropped and counted in `read.warnings`; the
    user's mesh is not touched.
    """
    mesh = evaluated.to_mesh()
    try:
        return _triangles(mesh, evaluated, read) if mesh is not None else None
    finally:
        evaluated.to_mesh_clear()


def _triangles(
    mesh: bpy.types.Mesh, evaluated: bpy.types.Object, read: SceneValues
) -> MeshValues | None:
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    if count == 0:
        return None
    positions = np.empty(len(mesh.vertices) * 3, np.float32)
    triangles, corners = np.empty(count * 3, np.int32), np.empty(count * 3, np.int32)
    slots = np.empty(count, np.int32)
    mesh.vertices.foreach_get("co", positions)
    mesh.loop_triangles.foreach_get("vertices", triangles)
    mesh.loop_triangles.foreach_get("loops", corners)
    mesh.loop_triangles.foreach_get("material_index", slots)
    positions, triangles = positions.reshape(-1, 3), triangles.reshape(-1, 3)
    normals = hosts.corner_normals(mesh).reshape(-1, 3, 3)
    uv_maps = hosts.corner_uv_maps(mesh, corners)
    colors = hosts.corner_colors(mesh, corners, triangles.ravel())
    known = {name for name, _ in (*uv_maps, *colors)}
    others = tuple(item.name for item in mesh.attributes if item.name not in known)

    finite = np.isfinite(positions).all(axis=1)
    if not finite.all():
        good = finite[triangles].all(axis=1)
        read.warn(
            f"Object '{evaluated.name}': {int((~good).sum())} triangles with vertices that are not "
            "finite are left out"
        )
        positions = np.where(finite[:, None], positions, np.float32(0))
        triangles, slots, normals = triangles[good], slots[good], normals[good]
        kept = np.repeat(good, 3)
        uv_maps = tuple((name, values[kept]) for name, values in uv_maps)
        colors = tuple((name, values[kept]) for name, values in colors)
        if not len(triangles):
            return None
    last = max(len(evaluated.material_slots), 1) - 1
    return MeshValues(
        name=evaluated.data.name,
        positions=positions,
        triangles=np.ascontiguousarray(triangles),
        corner_normals=np.ascontiguousarray(normals.reshape(-1, 3)),
        material_slots=np.clip(slots, 0, last),
        uv_maps=uv_maps,
        colors=colors,
        other_attributes=others,
    )
