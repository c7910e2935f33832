# SPDX-License-Identifier: GPL-3.0-or-later
"""Bodies for light that goes through: counts and volume, filled holes, a watertight remesh, and the
thickness at a point. Each changes one mesh; the caller makes it one undo step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import bmesh
import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree

from ..problems import BadInput, Problem
from ..scene_read.closedness import Closedness, survey
from ..scene_read.hosts import BpyStruct, floats, is_editable
from .blender_mesh import world_triangles

#: Distance of vertices that are one, and of a ray's start from its surface: share of the diagonal.
_TINY = 1e-6
#: More voxels along the longest side than Blender's remesh takes in a minute.
MOST_VOXELS = 2000


@dataclass(frozen=True)
class BodyState:
    """volume: enclosed by the triangles, in cubic Blender units; means something once closed."""

    found: Closedness
    volume: float

    def text(self, unit_length: float) -> str:
        """Counts and, of a closed body, the volume. unit_length: metres in one Blender unit."""
        found = self.found
        state = "closed" if found.encloses else "not closed"
        counts = (
            (found.open_edges, "open edge"),
            (found.loose_crowded_edges, "edge with too many faces"),
            (found.disagreeing_faces, "face wound against its neighbours"),
            (found.doubled_faces, "face on top of another"),
            (found.inside_out, "body turned inside out"),
        )
        parts = [f"{state}: triangles: {found.triangles}, bodies: {found.bodies}"]
        parts += [f"{name}: {count}" for count, name in counts if count]
        cubic = self.volume * unit_length**3 * 1e6
        parts += [f"volume {cubic:.6g} cm³"] if found.encloses else []
        return ", ".join(parts)


def state_of(item: bpy.types.Object) -> BodyState:
    """Of the object's own mesh, without modifiers, in world space."""
    positions, triangles = _triangles(item)
    found = survey(positions, triangles)
    if not len(triangles):
        return BodyState(found, 0.0)
    corners = positions[triangles] - positions.mean(axis=0)
    cross = np.cross(corners[:, 1], corners[:, 2])
    volume = float(np.einsum("ij,ij->", corners[:, 0], cross)) / 6
    mirrored = np.linalg.det(np.array(item.matrix_world, np.float64)[:3, :3]) < 0
    return BodyState(found, -volume if mirrored else volume)


def sides(item: bpy.types.Object) -> np.ndarray:
    """(3,) of its box along its own axes, in Blender units of the world."""
    return np.array(item.dimensions, np.float64)


def fill_holes(item: bpy.types.Object) -> int:
    """Closes every hole by a face of triangles whose corners keep the UVs of their neighbours, and
    turns all faces outwards; vertices at one place become one. Returns the number of new triangles.
    Raises BadInput where nothing is open, or the mesh cannot be changed."""
    mesh = _own_mesh(item)
    size = max(float(np.linalg.norm(sides(item))), 1e-30) / max(_scale(item), 1e-30)
    count = _fill(mesh, _TINY * size)
    if not count:
        cure = "there is nothing to do; use Watertight Remesh where other faults are left"
        raise BadInput(Problem(f"Object '{item.name}'", "it has no hole", cure))
    return count


def remesh(item: bpy.types.Object, voxel: float) -> None:
    """Fills the holes, then Blender's voxel remesh: one closed surface around all, with faces as
    large as a voxel, of the shape that the shape keys make. These are lost, UV maps and details
    smaller than a voxel too. voxel: its side in Blender units of the world. Raises BadInput."""
    mesh = _own_mesh(item, keys=True)
    longest, scale = float(sides(item).max()), _scale(item)
    if not voxel > 0 or longest / voxel > MOST_VOXELS:
        parts = longest / max(voxel, 1e-30)
        cause = f"a voxel of {voxel:.4g} is 1/{parts:.0f} of its longest side"
        cure = f"give a larger one, at least {longest / MOST_VOXELS:.4g}"
        raise BadInput(Problem(f"Object '{item.name}'", cause, cure))
    # Across a hole the remesh does not know inside from outside, and leaves crumbs.
    filled = _without_keys(item)
    _fill(filled, _TINY * longest / scale)
    made = _voxels_of(filled, voxel / scale)
    bpy.data.meshes.remove(filled)
    if not len(made.polygons):
        bpy.data.meshes.remove(made)
        cure = "give a smaller voxel"
        raise BadInput(Problem(f"Object '{item.name}'", "no face would be left", cure))
    made.name = mesh.name
    item.data = made


def _without_keys(item: bpy.types.Object) -> bpy.types.Mesh:
    """A copy of the object's mesh with its shape keys as they are mixed now, and without them."""
    mesh = cast(bpy.types.Mesh, item.data)
    made = mesh.copy()
    if mesh.shape_keys is None:
        return made
    mix = item.shape_key_add(name="Selenite mix", from_mix=True)
    places = floats(mix.data, "co", 3)
    item.shape_key_remove(mix)
    scratch = bpy.data.objects.new("Selenite mix", made)
    scratch.shape_key_clear()
    bpy.data.objects.remove(scratch)
    made.vertices.foreach_set("co", places.ravel())
    made.update()
    return made


def _fill(mesh: bpy.types.Mesh, distance: float) -> int:
    """Vertices within `distance` become one; returns how many triangles fill holes. Without any
    hole the mesh stays as it is."""
    scratch = bmesh.new()
    try:
        scratch.from_mesh(mesh)
        bmesh.ops.remove_doubles(scratch, verts=list(scratch.verts), dist=distance)
        rims = [edge for edge in scratch.edges if edge.is_boundary]
        if not rims:
            return 0
        before = set(scratch.faces)
        bmesh.ops.holes_fill(scratch, edges=rims, sides=0)
        new = [face for face in scratch.faces if face not in before]
        made = bmesh.ops.triangulate(scratch, faces=new)["faces"]
        _continue_uvs(scratch, set(made))
        bmesh.ops.recalc_face_normals(scratch, faces=list(scratch.faces))
        scratch.to_mesh(mesh)
    finally:
        scratch.free()
    mesh.update()
    return len(made)


def _voxels_of(mesh: bpy.types.Mesh, voxel: float) -> bpy.types.Mesh:
    """A new mesh; `voxel` in the mesh's own units."""
    scratch = bpy.data.objects.new("Selenite remesh", mesh)
    try:
        bpy.context.scene.collection.objects.link(scratch)
        modifier = scratch.modifiers.new("Remesh", "REMESH")
        modifier.mode, modifier.voxel_size = "VOXEL", voxel
        modifier.use_smooth_shade = True
        graph = bpy.context.evaluated_depsgraph_get()
        return bpy.data.meshes.new_from_object(scratch.evaluated_get(graph), depsgraph=graph)
    finally:
        bpy.data.objects.remove(scratch)


def thickness_at(item: bpy.types.Object, point: np.ndarray) -> float:
    """Way through the body from the surface point next to `point` (world), against its normal, to
    where it is left, in Blender units. Raises BadInput where nothing is behind."""
    positions, triangles = _triangles(item)
    title = f"Object '{item.name}'"
    if not len(triangles):
        raise BadInput(Problem(title, "it has no face", "choose a mesh with faces"))
    tree: BpyStruct = BVHTree.FromPolygons(positions.tolist(), triangles.tolist())
    place, normal, _, _ = tree.find_nearest(Vector(point.tolist()))
    diagonal = float(np.linalg.norm(np.ptp(positions, axis=0)))
    behind, _, _, distance = tree.ray_cast(place - normal * (_TINY * diagonal), -normal)
    if behind is None:
        cause = "no surface lies behind this point: it is open there, or faces inwards"
        raise BadInput(Problem(title, cause, "fill its holes, or choose another point"))
    return float(distance) + _TINY * diagonal


def _triangles(item: bpy.types.Object) -> tuple[np.ndarray, np.ndarray]:
    return world_triangles(cast(bpy.types.Mesh, item.data), item.matrix_world)


def _own_mesh(item: bpy.types.Object, *, keys: bool = False) -> bpy.types.Mesh:
    """The object's mesh, which no other object shares from now on. keys: it may have shape keys.
    Raises BadInput."""
    mesh = cast(bpy.types.Mesh, item.data)
    title = f"Object '{item.name}'"
    if not (is_editable(item) and is_editable(mesh)):
        raise BadInput(Problem(title, "it is linked from a library", "make it local first"))
    if mesh.shape_keys is not None and not keys:
        raise BadInput(Problem(title, "its mesh has shape keys", "apply or remove them first"))
    if mesh.users > 1:
        mesh = item.data = mesh.copy()
    return mesh


def _scale(item: bpy.types.Object) -> float:
    return float(np.mean(np.array(item.matrix_world.to_scale())))


def _continue_uvs(scratch: bmesh.types.BMesh, new: set[bmesh.types.BMFace]) -> None:
    """A new corner gets the UV of an old one at its vertex."""
    for layer in scratch.loops.layers.uv.values():
        for face in new:
            for loop in face.loops:
                old = next((one for one in loop.vert.link_loops if one.face not in new), None)
                if old is not None:
                    loop[layer].uv = old[layer].uv
