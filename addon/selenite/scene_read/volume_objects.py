# SPDX-License-Identifier: GPL-3.0-or-later
"""Volume objects: the grids of an OpenVDB file, or of modifiers, under a Principled Volume.

The density attribute is multiplied by the node's Density, the colour attribute by its Color. Beyond
the active voxels nothing is. In object space, the default, the density of a scaled object is
divided by its scale. Sources: docs/method/rendering.md; the rest is compared with Cycles by
blender_tests/test_volume_objects.py.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypedDict

import bpy
import numpy as np

from ..parameters import Values
from . import openvdb_files
from .geometry.mesh import Instance
from .openvdb_files import VdbError, VdbGrid
from .shading import materials, nodes, volumes
from .shading.nodes import Unreadable
from .shading.textures import TextureRoom
from .values import GridValues, MaterialValues, MeshValues, Owner

_PRINCIPLED = "ShaderNodeVolumePrincipled"
_CURE = "give its material a Principled Volume"


@dataclass(frozen=True)
class VolumeRead:
    """A Volume object as a box with a medium inside."""

    mesh: MeshValues
    material: MaterialValues
    owner: Owner
    warnings: list[str]


def read(instance: Instance, material: bpy.types.Material, name: str) -> VolumeRead:
    """`material` is the original one, `name` what it is called. Raises Unreadable."""
    title = f"Object '{instance.original.name}'"
    found = materials.read_material(material, name, TextureRoom())
    node = _principled(material, title)
    if found.problems:
        first = found.problems[0]
        raise Unreadable(first.object, first.cause, first.cure)
    density_name = _attribute(node, "Density Attribute", title)
    colour_name = _attribute(node, "Color Attribute", title)
    wanted = {density_name: 1} | ({colour_name: 3} if colour_name else {})
    grids = _grids(instance, wanted, title)
    density = grids.get(density_name)
    if density is None:
        cause = f"it has no grid '{density_name}'"
        raise Unreadable(title, cause, "name one of its grids in the Density Attribute")
    scale = _density_scale(instance.object, instance.matrix)
    placed = {
        "density": _placed(density, np.maximum(density.values, 0) / np.float32(scale), instance)
    }
    warnings = list(found.warnings)
    colour = grids.get(colour_name)
    if colour_name and colour is None:
        warnings.append(f"{title}: it has no grid '{colour_name}'; its colour is left as set")
    if colour is not None:
        placed["albedo"] = _placed(colour, _albedo(node, colour, title, warnings), instance)
    only = {key: found.owner.values[key] for key in volumes.PARAMETERS}
    fixed = found.owner.fixed | {
        key: "a Volume object has no surface"
        for key in found.owner.values
        if key not in volumes.PARAMETERS
    }
    if "albedo" in placed:
        fixed["albedo"] = f"it comes from grid '{colour_name}': fit albedo_grid"
    return VolumeRead(
        _box(instance.original.name, density),
        MaterialValues(name, only | {"alpha": (0.0,)}, multi_ggx=True, flavour="v2", grids=placed),
        replace(found.owner, values=only, fixed=fixed),
        warnings,
    )


def _grids(instance: Instance, wanted: dict[str, int], title: str) -> dict[str, VdbGrid]:
    """The grids by name, as they render: those that modifiers make go through a file of ours."""
    own_file = instance.original.type == "VOLUME" and not instance.original.modifiers
    try:
        if own_file:
            return openvdb_files.read(_path(instance.object, title), wanted)
        with tempfile.TemporaryDirectory() as folder:
            path = str(Path(folder) / "grids.vdb")
            if not _data(instance.object).grids.save(filepath=path):
                cause = "Blender does not write the grids that its modifiers make to a file"
                raise Unreadable(title, cause, "make room in the folder for temporary files")
            return openvdb_files.read(path, wanted)
    except VdbError as error:
        raise Unreadable(title, error.cause, error.cure) from error


#: What stood in a Volume object and its Principled Volume.
VolumeBefore = TypedDict(
    "VolumeBefore",
    {
        "filepath": str,
        "Color Attribute": str,
        "Color": list[float],
        "Absorption Color": list[float],
    },
)


def write(
    item: bpy.types.Object,
    material: bpy.types.Material,
    grids: Mapping[str, GridValues],
    path: str,
) -> VolumeBefore:
    """Gives a Volume object an OpenVDB file at `path` with grids in world space (use -> grid), and
    for an albedo its Principled Volume the name of that grid and white. Other grids of its file
    stay. Returns what stood there before, for `put_back`. Raises Unreadable."""
    title = f"Object '{item.name}'"
    if item.modifiers:
        cause = "its grids come from its modifiers, so a fitted one cannot be shown by it"
        raise Unreadable(title, cause, "give it an OpenVDB file and remove its modifiers")
    node = _principled(material, title)
    matrix = np.array(item.matrix_world, np.float64)
    names = {
        "density": _attribute(node, "Density Attribute", title),
        "albedo": _attribute(node, "Color Attribute", title) or "albedo",
    }
    written = []
    for use, grid in grids.items():
        values = grid.values
        if use == "density":
            values = values * np.float32(_density_scale(item, matrix))
        else:
            values = np.broadcast_to(values, (*values.shape[:3], 3))
        from_unit = np.linalg.inv(matrix) @ np.linalg.inv(grid.to_unit)
        written.append(VdbGrid(names[use], values, from_unit))
    try:
        openvdb_files.write(path, written, _path(item, title))
    except VdbError as error:
        raise Unreadable(title, error.cause, error.cure) from error
    before: VolumeBefore = {
        "filepath": _data(item).filepath,
        "Color Attribute": node.inputs["Color Attribute"].default_value,
        "Color": list(node.inputs["Color"].default_value),
        "Absorption Color": list(node.inputs["Absorption Color"].default_value),
    }
    _data(item).filepath = path
    if "albedo" in grids:
        colour_from_grid(node, names["albedo"])
    return before


def put_back(item: bpy.types.Object, material: bpy.types.Material, before: VolumeBefore) -> None:
    """What `write` returned. Raises Unreadable."""
    node = _principled(material, f"Object '{item.name}'")
    _data(item).filepath = before["filepath"]
    node.inputs["Color Attribute"].default_value = before["Color Attribute"]
    node.inputs["Color"].default_value = before["Color"]
    node.inputs["Absorption Color"].default_value = before["Absorption Color"]


def colour_from_grid(node: bpy.types.Node, name: str) -> None:
    """Makes a Principled Volume scatter what its grid of colours says of what it meets."""
    node.inputs["Color Attribute"].default_value = name
    node.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    node.inputs["Absorption Color"].default_value = (0.0, 0.0, 0.0, 1.0)


def _density_scale(item: bpy.types.Object, matrix: np.ndarray) -> float:
    """By what the numbers of the file are divided."""
    if _data(item).render.space != "OBJECT":
        return 1.0
    return float(np.linalg.norm(matrix[:3, :3] @ np.full(3, 3**-0.5)))


def _principled(material: bpy.types.Material, title: str) -> bpy.types.Node:
    output = nodes.output_of(material.node_tree)
    source = output.source("Volume") if output is not None else None
    node = source.node if source is not None else None
    if node is None or node.bl_idname != _PRINCIPLED or source.groups:
        what = nodes.describe(node) if node is not None else "nothing"
        raise Unreadable(title, f"its Volume is {what}, not a Principled Volume of its own", _CURE)
    return node


def _attribute(node: bpy.types.Node, name: str, title: str) -> str:
    socket = node.inputs[name]
    if socket.is_linked:
        raise Unreadable(title, f"input '{name}' is linked", "unlink it and write the name")
    return str(socket.default_value)


def _data(item: bpy.types.Object) -> bpy.types.Volume:
    assert isinstance(item.data, bpy.types.Volume), item.type
    return item.data


def _path(item: bpy.types.Object, title: str) -> str:
    data = _data(item)
    if data.packed_file is not None:
        raise Unreadable(title, "its OpenVDB file is packed", "unpack it (File, External Data)")
    if not data.grids.load():
        cause = f"its OpenVDB file does not load ({data.grids.error_message or 'no grids'})"
        raise Unreadable(title, cause, "choose another file")
    return data.grids.frame_filepath


def _albedo(node: bpy.types.Node, grid: VdbGrid, title: str, warnings: list[str]) -> np.ndarray:
    """What Cycles scatters of what meets the medium, where the absorption colour is black."""
    if any(_constant(node, "Absorption Color")):
        cause = "its colour varies and its absorption colour is not black"
        raise Unreadable(title, cause, "set the Absorption Color of the Principled Volume to black")
    albedo = grid.values * np.asarray(_constant(node, "Color"), np.float32)
    if albedo.max() > 1:
        warnings.append(f"{title}: colours above 1 in grid '{grid.name}' are taken as 1")
    return np.clip(albedo, 0, 1)


def _constant(node: bpy.types.Node, name: str) -> Values:
    """Three numbers of an input that was found to be constant."""
    value = nodes.constant(nodes.source_of(node.inputs[name]))
    return nodes.broadcast(value or (0.0,), 3)


def _placed(grid: VdbGrid, values: np.ndarray, instance: Instance) -> GridValues:
    to_unit = np.linalg.inv(instance.matrix @ grid.from_unit)
    return GridValues(grid.name, np.ascontiguousarray(values, np.float32), to_unit)


def _box(name: str, grid: VdbGrid) -> MeshValues:
    """The box of a grid in object space, faces out."""
    corners = np.array([[i & 1, i >> 1 & 1, i >> 2, 1] for i in range(8)], np.float64)
    positions = (grid.from_unit @ corners.T).T[:, :3]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))], np.int32)
    if np.linalg.det(grid.from_unit[:3, :3]) < 0:
        triangles = triangles[:, ::-1].copy()
    a, b, c = (positions[triangles[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return MeshValues(
        name,
        positions.astype(np.float32),
        triangles,
        np.repeat(normals, 3, axis=0).astype(np.float32),
        np.zeros(len(triangles), np.int32),
    )
