# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes to Blender, and from the formats that Blender's own importers read: OBJ, glTF."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import cast

import bpy
import mathutils
import numpy as np

from ..scene_read import hosts
from ..scene_read.geometry import corner_normals
from ..scene_read.hosts import BpyStruct
from .appearance import Appearances, of_gltf, of_obj
from .blender_material import COLORS
from .obj_scan import ObjScan, scan, write_copy
from .readers.files import shortened
from .reconstruction import MeshMaterial, ReconstructedMesh, ReconstructionError

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
        attribute = cast(BpyStruct, data.color_attributes).new(COLORS, "FLOAT_COLOR", "POINT")
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
    remarks: list[str] = []
    scanned = scan(file) if file.suffix.lower() == ".obj" else None
    offset = np.zeros(3) if scanned is None else scanned.offset
    appearances = of_gltf(file, remarks) if scanned is None else of_obj(file, scanned, remarks)
    with _scratch_scene() as scene:
        before = set(bpy.data.user_map())
        try:
            with _readable(file, scanned) as readable:
                _import(readable)
            graph = bpy.context.evaluated_depsgraph_get()
            made = [item for item in scene.objects if item.type == "MESH"]
            found = [_neutral(item.evaluated_get(graph), appearances) for item in made]
            meshes = tuple(replace(one, positions=one.positions + offset) for one in found)
        except (RuntimeError, AttributeError, ImportError, OSError, IndexError, KeyError) as error:
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
    if far > _COARSE * size:
        remarks.append(
            f"mesh file '{file.name}' reaches from its origin {far / size:.0f} times as far as it "
            "is large: single precision has moved its vertices; export it with a local origin, or "
            "as X3D"
        )
    if scanned is not None and scanned.lost_normals:
        remarks.append(
            f"mesh file '{file.name}': {scanned.lost_normals} of its normals are no numbers; those "
            "of the faces take their place"
        )
    return meshes, tuple(dict.fromkeys(remarks))


@contextmanager
def _readable(file: Path, scanned: ObjScan | None) -> Iterator[Path]:
    """The file, or the copy of an OBJ that Blender's importer reads as it is meant. Materials and
    pictures of an OBJ are read here, see `obj_materials`."""
    if scanned is None or not scanned.needs_copy:
        yield file
        return
    with tempfile.TemporaryDirectory(prefix="selenite-") as folder:
        copy = Path(folder) / file.name
        write_copy(file, scanned, copy)
        yield copy


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


def _neutral(item: bpy.types.Object, appearances: Appearances) -> ReconstructedMesh:
    mesh = item.to_mesh()
    positions, triangles = world_triangles(mesh, item.matrix_world)
    corners = hosts.whole_numbers(mesh.loop_triangles, "loops", 3)
    maps = {name: uv.reshape(-1, 3, 2) for name, uv in hosts.corner_uv_maps(mesh, corners)}
    smooth = any(polygon.use_smooth for polygon in mesh.polygons)
    normals = None
    if smooth:
        matrix = np.array(item.matrix_world, np.float64)
        local = hosts.floats(mesh.vertices, "co", 3)
        of_corners = corner_normals.of(mesh, local, corners, triangles.ravel())
        normals = of_corners @ np.linalg.inv(matrix[:3, :3])
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = (normals / np.where(lengths > 0, lengths, 1)).reshape(-1, 3, 3)
    materials, material_of, uvs = _materials(item, appearances, maps)
    return ReconstructedMesh(
        name=item.name,
        positions=positions,
        triangles=triangles,
        uvs=uvs,
        normals=normals,
        colors=_colors(mesh),
        materials=materials,
        material_of=material_of,
    )


def _colors(mesh: bpy.types.Mesh) -> np.ndarray | None:
    """(vertices, 3) linear, of the colours that are shown; a vertex has that of its last corner."""
    attribute: BpyStruct = mesh.color_attributes.active_color
    if attribute is None:
        return None
    colors = hosts.floats(attribute.data, "color", 4)[:, :3].astype(np.float64)
    if attribute.domain == "POINT":
        return colors
    found = np.ones((len(mesh.vertices), 3))
    found[hosts.corner_vertices(mesh)] = colors
    return found


def _materials(
    item: bpy.types.Object, appearances: Appearances, maps: dict[str, np.ndarray]
) -> tuple[tuple[MeshMaterial, ...], np.ndarray | None, np.ndarray | None]:
    """Those that faces have, which each of `loop_triangles` has, and where in its picture each
    corner lies. maps: (triangles, 3, 2) by name, the usual one first."""
    mesh = cast(bpy.types.Mesh, item.data)
    last = max(len(item.material_slots) - 1, 0)  # Blender shows it for what is beyond
    slots = np.minimum(hosts.whole_numbers(mesh.loop_triangles, "material_index", 1), last)
    used, which = np.unique(slots, return_inverse=True)
    which = which.reshape(-1)
    usual = next(iter(maps.values()), None)
    uvs = None if usual is None else usual.astype(np.float64)
    found = []
    for number, index in enumerate(used):
        slot = item.material_slots[index] if len(item.material_slots) else None
        shown = appearances.of(slot.material if slot is not None else None)
        material = shown.material
        if uvs is not None and usual is not None:
            faces = which == number
            placed = maps.get(shown.uv_map, usual)[faces].astype(np.float64)
            uvs[faces] = placed @ shown.placed[:, :2].T + shown.placed[:, 2]
            if material.texture is not None and _within(uvs[faces]):
                material = replace(material, extension="REPEAT")  # it ends nowhere inside
            elif material.texture is not None:
                appearances.note_wrap(shown)
        found.append(material)
    if len(found) < 2:
        return tuple(found) or (MeshMaterial(),), None, uvs
    return tuple(found), which, uvs


def _within(uvs: np.ndarray) -> bool:
    """Whether all of them lie on the picture, but for rounding."""
    return bool((uvs >= -1e-5).all() and (uvs <= 1 + 1e-5).all())
