# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes after modifiers, as triangles with corner normals and UVs; instances share one mesh."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import bpy
import numpy as np

from ..problems import Problem
from . import hosts, view_layers
from .values import MeshValues, SceneValues

# Object types that Cycles renders and Selenite does not; curves, text and metaballs arrive as
# meshes of their own from the dependency graph.
_NOT_READ = {"CURVES", "POINTCLOUD", "GPENCIL", "GREASEPENCIL"}
_AS_MESH = {"CURVE", "SURFACE", "FONT", "META"}


@dataclass(frozen=True)
class Instance:
    """One object that Cycles would render. `object` is evaluated and valid in this step only.
    `instancer`: the original object that shows it, itself where nothing else does."""

    object: bpy.types.Object
    original: bpy.types.Object
    instancer: bpy.types.Object
    matrix: np.ndarray
    is_instance: bool


def rendered_instances(
    scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, read: SceneValues
) -> Iterator[Instance]:
    """Everything that renders, with its matrix (4, 4); what a render would show differently is
    noted in `read.warnings`."""
    in_render = set().union(
        *(_renderable_objects(layer.layer_collection) for layer in view_layers.of_sets(scene)),
        _renderable_objects(depsgraph.view_layer.layer_collection),
    )
    within: dict[str, set[str]] = {}
    seen = set()
    for item in depsgraph.object_instances:
        evaluated = item.object
        original = evaluated.original
        owner = item.parent.original if item.is_instance else original
        seen.add(owner.name)
        if owner.name not in in_render or owner.hide_render or original.hide_render:
            continue
        if item.is_instance and owner.instance_type == "COLLECTION" and owner.instance_collection:
            collection = owner.instance_collection
            shown = within.setdefault(collection.name, _shown_in(collection))
            if original.name in collection.all_objects and original.name not in shown:
                continue
        if not item.is_instance and original.is_instancer:
            if not original.show_instancer_for_render:
                continue
        elif not item.show_self:
            continue
        matrix = np.array(item.matrix_world, np.float64)
        yield Instance(evaluated, original, owner, matrix, item.is_instance)
    for name in sorted(in_render - seen):
        candidate: bpy.types.Object | None = scene.objects.get(name)
        if candidate is None or candidate.hide_render or candidate.type in {"CAMERA", "EMPTY"}:
            continue
        read.warn(f"Object '{name}' is hidden in the viewport and therefore left out; show it")


def warn_of_object(original: bpy.types.Object, read: SceneValues) -> None:
    """Notes what Selenite renders differently from Cycles for this object."""
    title = f"Object '{original.name}'"
    if original.type in _NOT_READ:
        read.warn(f"{title} of type {original.type.lower()} is not rendered")
    for modifier in original.modifiers:
        if modifier.show_viewport != modifier.show_render:
            read.warn(f"{title}: modifier '{modifier.name}' is read as the viewport shows it")
        levels = getattr(modifier, "levels", None)
        if modifier.show_render and levels != getattr(modifier, "render_levels", levels):
            read.warn(
                f"{title}: modifier '{modifier.name}' is read at viewport level {levels}; "
                f"a render uses level {modifier.render_levels}"
            )
    if any(item.settings.type == "HAIR" for item in original.particle_systems):
        read.warn(f"{title}: particle hair is not rendered")
    if original.is_shadow_catcher:
        cure = "switch off Shadow Catcher in its Visibility properties"
        problem = Problem(title, "it is a shadow catcher, which is not modelled", cure)
        if problem not in read.problems:
            read.problems.append(problem)


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


def is_wire(evaluated: bpy.types.Object) -> bool:
    """Curves, texts and metaballs without a surface render as nothing, in Cycles too."""
    return evaluated.original.type in _AS_MESH


def _renderable_objects(layer: bpy.types.LayerCollection) -> set[str]:
    """Names of the objects in collections that take part in a render."""
    if layer.exclude or layer.collection.hide_render:
        return set()
    names = {item.name for item in layer.collection.objects}
    return names.union(*(_renderable_objects(child) for child in layer.children))


def _shown_in(collection: bpy.types.Collection) -> set[str]:
    if collection.hide_render:
        return set()
    names = {item.name for item in collection.objects}
    return names.union(*(_shown_in(child) for child in collection.children))
