# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes to Blender, and from the formats that Blender's own importers read: OBJ, glTF."""

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
from ..scene_read.geometry import corner_normals
from .obj_materials import pictures_of
from .obj_offset import near_origin
from .readers import tiles
from .readers.files import shortened
from .reconstruction import MeshMaterial, PackedPicture, ReconstructedMesh, ReconstructionError

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
    if mesh.material_of is not None:
        slots = np.asarray(mesh.material_of[real], np.int32)
        data.polygons.foreach_set("material_index", slots)
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
    """The meshes of an OBJ or glTF file, with the axes of the file (glTF, whose y points
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
                several = [name for item in made for name in _mixed(item)]
            meshes = tuple(replace(one, positions=one.positions + offset) for one in found)
        except (RuntimeError, AttributeError, ImportError, OSError) as error:
            cure = "export the mesh again, as OBJ or X3D"
            cause = f"not imported ({_said(error)})"
            raise ReconstructionError(file, "mesh", cause, cure) from error
        finally:
            bpy.data.batch_remove([item for item in bpy.data.user_map() if item not in before])
    meshes = tuple(mesh for mesh in meshes if len(mesh.triangles))
    if not meshes:  # importers report success all the same
        cure = "export a mesh with faces; or, as OBJ or X3D, with another program"
        raise ReconstructionError(file, "mesh", "Blender finds no faces in it", cure)
    far = 0.0 if offset.any() else max(float(np.abs(mesh.positions).max()) for mesh in meshes)
    size = float(np.ptp(np.concatenate([mesh.positions for mesh in meshes]), axis=0).max())
    remarks: tuple[str, ...] = tuple(
        f"material '{name}': of its textures of colour only the first is used"
        for name in dict.fromkeys(several)
    )
    lost = {one.name for mesh in meshes for one in mesh.materials if one.texture is None}
    lost |= {name.rpartition(".")[0] for name in lost}  # the open file had one of the name
    remarks += tuple(
        f"the texture '{shortened(picture)}' of material '{name}' is not there, below the folder of"
        " the mesh: its faces are white"
        for name, picture in pictures_of(file).items()
        if name in lost
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


def _said(error: Exception) -> str:
    """What an importer says went wrong, in a line: of a traceback the end."""
    lines = [line for line in str(error).removeprefix("Error: ").splitlines() if line.strip()]
    if "Traceback" in str(error):
        lines = [line for line in lines if not line.startswith((" ", "Location:"))][-1:]
    return shortened(" ".join(lines), 300) or type(error).__name__


def _import(file: Path) -> None:
    if file.suffix.lower() == ".obj":
        bpy.ops.wm.obj_import(filepath=str(file), forward_axis="Y", up_axis="Z")
    else:
        with _names_of_old_numpy():
            bpy.ops.import_scene.gltf(filepath=str(file))


@contextmanager
def _names_of_old_numpy() -> Iterator[None]:
    """The glTF importer of Debian's Blender 3.4 says np.bool, which Debian's NumPy has no more."""
    missing = "bool" not in vars(np)
    if missing:
        vars(np)["bool"] = bool
    try:
        yield
    finally:
        if missing:
            del vars(np)["bool"]


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
        local = hosts.floats(mesh.vertices, "co", 3)
        of_corners = corner_normals.of(mesh, local, corners, triangles.ravel())
        normals = of_corners @ np.linalg.inv(matrix[:3, :3])
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = (normals / np.where(lengths > 0, lengths, 1)).reshape(-1, 3, 3)
    materials, material_of = _materials(item, file)
    return ReconstructedMesh(
        name=item.name,
        positions=positions,
        triangles=triangles,
        uvs=uvs[0][1].reshape(-1, 3, 2) if uvs else None,
        normals=normals,
        colors=_colors(mesh),
        materials=materials,
        material_of=material_of,
    )


def _colors(mesh: bpy.types.Mesh) -> np.ndarray | None:
    """(vertices, 3) linear, of the colours that are shown; a vertex has that of its last corner."""
    attribute: Any = mesh.color_attributes.active_color
    if attribute is None:
        return None
    colors = hosts.floats(attribute.data, "color", 4)[:, :3].astype(np.float64)
    if attribute.domain == "POINT":
        return colors
    found = np.ones((len(mesh.vertices), 3))
    found[hosts.corner_vertices(mesh)] = colors
    return found


def _materials(
    item: bpy.types.Object, file: Path
) -> tuple[tuple[MeshMaterial, ...], np.ndarray | None]:
    """Those that faces have, and which each of `loop_triangles` has."""
    mesh = cast(bpy.types.Mesh, item.data)
    last = max(len(item.material_slots) - 1, 0)  # Blender shows it for what is beyond
    slots = np.minimum(hosts.whole_numbers(mesh.loop_triangles, "material_index", 1), last)
    used, which = np.unique(slots, return_inverse=True)
    found = []
    for index in used:
        slot = item.material_slots[index] if len(item.material_slots) else None
        material = slot.material if slot is not None else None
        name = "" if material is None else material.name
        found.append(MeshMaterial(name, _texture(material, file)))
    if len(found) < 2:
        return tuple(found) or (MeshMaterial(),), None
    return tuple(found), which.reshape(-1)


def _texture(material: bpy.types.Material | None, file: Path) -> Path | PackedPicture | None:
    """Behind the base colour: a file in the folder of `file` or inside, or what `file` holds."""
    for image in _base_images(material):
        path = Path(bpy.path.abspath(image.filepath)).resolve() if image.filepath else file
        is_there = path.is_file() or bool(tiles.of(path))
        if path != file and is_there and path.is_relative_to(file.resolve().parent):
            return path
        if image.packed_file is not None:
            return PackedPicture(image.name, bytes(image.packed_file.data))
    return None


def _mixed(item: bpy.types.Object) -> Iterator[str]:
    """Materials in which several pictures make the base colour."""
    for slot in item.material_slots:
        if slot.material is not None and len(set(_base_images(slot.material))) > 1:
            yield slot.material.name


def _base_images(material: bpy.types.Material | None) -> Iterator[bpy.types.Image]:
    """Images behind the base colour of a material; where its shader has none, as glTF has for what
    is lit already, all that hold colours."""
    tree = material.node_tree if material is not None else None
    if tree is None:
        return
    bases = [node.inputs["Base Color"] for node in tree.nodes if "Base Color" in node.inputs]
    links = [link for base in bases for link in base.links]
    nodes = [node for link in links for node in _upstream(link.from_node)]
    for node in nodes if bases else tree.nodes:
        image = getattr(node, "image", None)
        if image is not None and not hosts.is_data(image):
            yield image


def _upstream(node: bpy.types.Node) -> Iterator[bpy.types.Node]:
    """The node and all that lead to it: a colour may be mixed with a texture."""
    yield node
    for socket in node.inputs:
        for link in socket.links:
            yield from _upstream(link.from_node)
