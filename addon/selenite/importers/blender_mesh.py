# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes to Blender, and from the formats that Blender's own importers read: OBJ, PLY, glTF."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import bpy
import mathutils
import numpy as np

from ..scene_read import hosts
from .obj_offset import near_origin
from .reconstruction import ReconstructedMesh, ReconstructionError

#: Blender's importers keep single precision, 6e-8 of the largest coordinate.
_COARSE = 1000.0


def new_mesh(mesh: ReconstructedMesh, made: list[bpy.types.ID]) -> bpy.types.Mesh:
    """A mesh datablock with UV map, normals and colours. Triangles with two equal corners are left
    out. Positions become single precision."""
    corners = np.asarray(mesh.triangles, np.int32)
    a, b, c = corners.T
    real = (a != b) & (b != c) & (c != a)
    corners = corners[real]
    data = bpy.data.meshes.new(mesh.name)
    made.append(data)
    data.vertices.add(len(mesh.positions))
    data.vertices.foreach_set("co", np.asarray(mesh.positions, np.float32).ravel())
    data.loops.add(corners.size)
    data.loops.foreach_set("vertex_index", corners.ravel())
    data.polygons.add(len(corners))
    data.polygons.foreach_set("loop_start", np.arange(0, corners.size, 3, dtype=np.int32))
    if bpy.app.version < (3, 6, 0):  # later it follows from the next start
        data.polygons.foreach_set("loop_total", np.full(len(corners), 3, np.int32))
    smooth = np.full(len(corners), mesh.normals is not None)
    data.polygons.foreach_set("use_smooth", smooth)
    data.update(calc_edges=True)
    if mesh.uvs is not None:
        layer = data.uv_layers.new(name="UVMap")
        layer.data.foreach_set("uv", np.asarray(mesh.uvs[real], np.float32).ravel())
    if mesh.colors is not None:
        attribute = cast(Any, data.color_attributes).new("Color", "FLOAT_COLOR", "POINT")
        colors = np.ones((len(mesh.positions), 4), np.float32)
        colors[:, :3] = mesh.colors
        attribute.data.foreach_set("color", colors.ravel())
    if mesh.normals is not None:
        if hasattr(data, "use_auto_smooth"):  # before 4.1
            data.use_auto_smooth = True
        data.normals_split_custom_set(mesh.normals[real].reshape(-1, 3).astype(np.float32))
    return data


def read_with_blender(file: Path) -> tuple[tuple[ReconstructedMesh, ...], tuple[str, ...]]:
    """The meshes of an OBJ, PLY or glTF file, with the axes of the file (glTF, whose y points
    upward, as Blender turns it), and remarks. Leaves nothing in the open file. Raises
    ReconstructionError."""
    with _scratch_scene() as scene:
        before = set(bpy.data.user_map())
        try:
            with near_origin(file) as (near, offset):
                _import(near)
                graph = bpy.context.evaluated_depsgraph_get()
                made = [item for item in scene.objects if item.type == "MESH"]
                found = [_neutral(item.evaluated_get(graph), file) for item in made]
                inside = [item.name for item in made if _is_inside(item, file)]
            meshes = tuple(replace(one, positions=one.positions + offset) for one in found)
        except (RuntimeError, AttributeError, ImportError, OSError) as error:
            cause = " ".join(str(error).removeprefix("Error: ").split()) or type(error).__name__
            cure = "export the mesh again, as OBJ or X3D"
            raise ReconstructionError(file, "mesh", f"not imported ({cause})", cure) from error
        finally:
            bpy.data.batch_remove([item for item in bpy.data.user_map() if item not in before])
    meshes = tuple(mesh for mesh in meshes if len(mesh.triangles))
    if not meshes:  # importers report success all the same
        cure = "export a mesh with faces; or, as OBJ or X3D, with another program"
        raise ReconstructionError(file, "mesh", "Blender finds no faces in it", cure)
    far = 0.0 if offset.any() else max(float(np.abs(mesh.positions).max()) for mesh in meshes)
    size = float(np.ptp(np.concatenate([mesh.positions for mesh in meshes]), axis=0).max())
    remarks: tuple[str, ...] = tuple(
        f"mesh '{name}': its texture is inside of '{file.name}' and is left out; export it as a "
        "picture of its own (glTF Separate, OBJ)"
        for name in inside
    )
    if far > _COARSE * size:
        remarks += (
            f"mesh file '{file.name}' reaches from its origin {far / size:.0f} times as far as it "
            "is large: single precision has moved its vertices; export it with a local origin, or "
            "as X3D",
        )
    return meshes, remarks


@contextmanager
def _scratch_scene() -> Iterator[bpy.types.Scene]:
    """A scene of its own, so that selection and active object of the open one stay."""
    window = bpy.context.window
    shown = bpy.context.scene
    scene = bpy.data.scenes.new("Selenite import")
    try:
        if window is not None:
            window.scene = scene
        with bpy.context.temp_override(scene=scene, view_layer=scene.view_layers[0]):
            yield scene
    finally:
        if window is not None:
            window.scene = shown
        bpy.data.scenes.remove(scene)


def _import(file: Path) -> None:
    ending, path = file.suffix.lower(), str(file)
    manager, operators = bpy.ops.wm, cast(Any, bpy.ops)
    if ending in (".glb", ".gltf"):
        bpy.ops.import_scene.gltf(filepath=path)
    elif ending == ".obj":
        manager.obj_import(filepath=path, forward_axis="Y", up_axis="Z")
    elif bpy.app.version >= (4, 0, 0):
        manager.ply_import(filepath=path, forward_axis="Y", up_axis="Z")
    else:
        operators.import_mesh.ply(filepath=path)


def world_triangles(
    mesh: bpy.types.Mesh, matrix: mathutils.Matrix
) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) double positions in the world, (m, 3) vertices of `mesh.loop_triangles`, which are
    calculated here."""
    mesh.calc_loop_triangles()
    positions = hosts.floats(mesh.vertices, "co", 3)
    triangles = hosts.whole_numbers(mesh.loop_triangles, "vertices", 3)
    to_world = np.array(matrix, np.float64)
    placed = positions.astype(np.float64) @ to_world[:3, :3].T + to_world[:3, 3]
    return placed, triangles.reshape(-1, 3)


def _neutral(item: bpy.types.Object, file: Path) -> ReconstructedMesh:
    mesh = item.to_mesh()
    positions, triangles = world_triangles(mesh, item.matrix_world)
    corners = hosts.whole_numbers(mesh.loop_triangles, "loops", 3)
    uvs = hosts.corner_uv_maps(mesh, corners)
    smooth = any(polygon.use_smooth for polygon in mesh.polygons)
    normals = None
    if smooth:
        matrix = np.array(item.matrix_world, np.float64)
        normals = hosts.corner_normals(mesh, corners, triangles.ravel()) @ np.linalg.inv(
            matrix[:3, :3]
        )
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = (normals / np.where(lengths > 0, lengths, 1)).reshape(-1, 3, 3)
    return ReconstructedMesh(
        name=item.name,
        positions=positions,
        triangles=triangles,
        uvs=uvs[0][1].reshape(-1, 3, 2) if uvs else None,
        normals=normals,
        texture=_texture(item, file),
    )


def _texture(item: bpy.types.Object, file: Path) -> Path | None:
    """The file behind the base colour, if it lies in the folder of `file` or inside."""
    for image in _base_images(item):
        path = Path(bpy.path.abspath(image.filepath)).resolve() if image.filepath else file
        if path != file and path.is_file() and path.is_relative_to(file.resolve().parent):
            return path
    return None


def _is_inside(item: bpy.types.Object, file: Path) -> bool:
    """Whether the picture is inside the mesh's file, and nowhere else."""
    packed = any(image.packed_file is not None for image in _base_images(item))
    return packed and _texture(item, file) is None


def _base_images(item: bpy.types.Object) -> Iterator[bpy.types.Image]:
    """Images behind the base colours of its materials."""
    for slot in item.material_slots:
        tree = slot.material.node_tree if slot.material is not None else None
        for link in tree.links if tree is not None else ():
            image = getattr(link.from_node, "image", None)
            if link.to_socket.name == "Base Color" and image is not None:
                yield image
