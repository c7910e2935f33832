# SPDX-License-Identifier: GPL-3.0-or-later
"""The material of a photographed body as another model: opaque, or rough glass over a medium."""

from __future__ import annotations

import bpy

from .. import parameters
from ..parameters import Parameter, Values
from ..problems import BadInput, Problem
from ..scene_read.shading import nodes
from ..scene_read.shading.materials import principled_of

#: What a body of each model has, where the fit begins.
_OPAQUE: dict[str, Values] = {"transmission": (0.0,), "subsurface_weight": (0.0,)}
_GLASS: dict[str, Values] = {
    "base_color": (1.0, 1.0, 1.0), "metallic": (0.0,), "subsurface_weight": (0.0,),
    "transmission": (1.0,), "roughness": (0.3,),
}  # fmt: skip
#: Albedo of the medium that a fit begins with, and the body's size in mean free paths.
_ALBEDO, _FREE_PATHS = 0.9, 3.0


def make_opaque(material: bpy.types.Material) -> None:
    """Light no longer enters the body. Raises BadInput."""
    node = _principled(material)
    _unlink_volume(material)
    for name, value in _OPAQUE.items():
        _put(node, parameters.table()["material", name], value)


def make_medium(material: bpy.types.Material) -> None:
    """Rough glass over a medium that scatters, three mean free paths thick. Raises BadInput."""
    node = _principled(material)
    size = _size(material)
    if not size > 0:
        cause = "no object of a size above 0 has it"
        raise BadInput(Problem(f"Material '{material.name}'", cause, "give it to the body"))
    for name, value in _GLASS.items():
        _put(node, parameters.table()["material", name], value)
    _unlink_volume(material)
    tree = material.node_tree
    volume = tree.nodes.new("ShaderNodeVolumePrincipled")
    volume.location = (node.location[0], node.location[1] - 700)
    volume.inputs["Color"].default_value = (_ALBEDO, _ALBEDO, _ALBEDO, 1.0)
    volume.inputs["Density"].default_value = _FREE_PATHS / size
    volume.inputs["Anisotropy"].default_value = 0.0
    output = nodes.output_of(tree)
    assert output is not None  # noqa: S101 - the Principled BSDF hangs on it
    tree.links.new(volume.outputs[0], output.node.inputs["Volume"])


def has_uvs(material: bpy.types.Material) -> bool:
    """Whether every mesh with the material has a UV map, so that an image can be fitted to it."""
    meshes = [item.data for item in _objects(material) if item.type == "MESH"]
    return bool(meshes) and all(mesh.uv_layers for mesh in meshes)


def _principled(material: bpy.types.Material) -> bpy.types.Node:
    found = principled_of(material)
    title = f"Material '{material.name}'"
    if isinstance(found, str):
        cure = "link a Principled BSDF to its Material Output"
        raise BadInput(Problem(title, f"it {found}", cure))
    node, groups = found
    if groups:
        cause = "its Principled BSDF stands in a node group, which other materials may share"
        raise BadInput(Problem(title, cause, "ungroup it"))
    return node


def _unlink_volume(material: bpy.types.Material) -> None:
    tree = material.node_tree
    output = nodes.output_of(tree)
    for link in list(output.node.inputs["Volume"].links) if output is not None else ():
        tree.links.remove(link)


def _put(node: bpy.types.Node, parameter: Parameter, value: Values) -> None:
    """The value in place of what is linked."""
    socket = parameter.find(node)
    if socket is None:  # of another version
        return
    for link in list(socket.links):
        node.id_data.links.remove(link)
    socket.default_value = value[0] if len(value) == 1 else (*value, 1.0)


def _objects(material: bpy.types.Material) -> list[bpy.types.Object]:
    return [
        item
        for item in bpy.context.scene.objects
        if any(slot.material == material for slot in item.material_slots)
    ]


def _size(material: bpy.types.Material) -> float:
    """The shortest side of the largest object with it, in Blender units of the world."""
    sides = [sorted(item.dimensions[axis] for axis in range(3)) for item in _objects(material)]
    return max(sides, key=lambda side: side[2])[0] if sides else 0.0
