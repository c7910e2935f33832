# SPDX-License-Identifier: GPL-3.0-or-later
"""What nodes ask of the hit: coordinates, attributes, the object, the ray."""

from __future__ import annotations

import bpy

from ...shaders import (
    ALPHA,
    ATTRIBUTE,
    FACTOR,
    ISLAND,
    MADE,
    MATRIX,
    NOT_MADE,
    OPACITY,
    POINTINESS,
    STANDARD,
    USUAL_COLOR,
    USUAL_UV,
    Register,
)
from ..nodes import Groups
from .tree import Tree, maker

Node = bpy.types.Node
Socket = bpy.types.NodeSocket

_BAKE = "bake it into an image, or give a constant value"
_GEOMETRY = {
    "Position": "position",
    "Normal": "normal",
    "True Normal": "true_normal",
    "Incoming": "incoming",
    "Parametric": "parametric",
    "Backfacing": "backfacing",
}
_COORDINATES = {
    "Object": ("geometry", "object_position"),
    "Normal": ("geometry", "object_normal"),
    "Reflection": ("geometry", "reflection"),
    "Camera": ("camera", "position"),
}
_OBJECT = {
    "Location": "location",
    "Color": "color",
    "Alpha": "alpha",
    "Object Index": "index",
    "Random": "random",
}
_CAMERA = {"View Vector": "vector", "View Z Depth": "depth", "View Distance": "distance"}


@maker("NewGeometry")
def _geometry(tree: Tree, node: Node, output: Socket, _: Groups) -> Register:
    if output.identifier == "Random Per Island":
        return tree.ask("attribute", "vector", tree.shader.name(ISLAND))
    if output.identifier == "Pointiness":
        return tree.ask("attribute", "vector", tree.shader.name(POINTINESS))
    if output.identifier not in _GEOMETRY:
        return tree.refuse(node, f"{{}} gives '{output.name}', which is not modelled", _BAKE)
    return tree.ask("geometry", _GEOMETRY[output.identifier])


@maker("TexCoord")
def _coordinates(tree: Tree, node: Node, output: Socket, _: Groups) -> Register:
    name = output.identifier
    if node.from_instancer and name in {"Generated", "UV"}:
        cause = "{} takes the coordinates of the instancer"
        return tree.refuse(node, cause, "switch off From Instancer")
    if name == "Generated":
        return tree.generated()
    if name == "UV":
        return tree.ask("attribute", "uv", tree.shader.name(""))
    if name == "Object" and node.object is not None:
        cause = f"{{}} takes the coordinates of object '{node.object.name}'"
        return tree.refuse(node, cause, "clear its Object")
    if name not in _COORDINATES:
        return tree.refuse(node, f"{{}} gives '{output.name}', which is not modelled", _BAKE)
    return tree.ask(*_COORDINATES[name])


@maker("UVMap")
def _uv_map(tree: Tree, node: Node, _: Socket, __: Groups) -> Register:
    if node.from_instancer:
        cause = "{} takes the coordinates of the instancer"
        return tree.refuse(node, cause, "switch off From Instancer")
    return tree.ask("attribute", "uv", tree.shader.name(node.uv_map))


@maker("VertexColor")
def _vertex_color(tree: Tree, node: Node, output: Socket, _: Groups) -> Register:
    if node.layer_name in STANDARD:
        return tree.shader.literal(0)
    if output.identifier == "Alpha":
        return tree.ask("attribute", "vector", tree.shader.name(ALPHA + node.layer_name))
    return tree.ask("attribute", "color", tree.shader.name(node.layer_name))


@maker("Attribute")
def _attribute(tree: Tree, node: Node, output: Socket, _: Groups) -> Register:
    name, kind = node.attribute_name, output.identifier
    if node.attribute_type != "GEOMETRY" or not name or name == MATRIX:
        cure = "set its type to Geometry and name an attribute"
        return tree.refuse(node, "{} names no attribute of the geometry", cure)
    if kind == "Alpha":
        if name in STANDARD - {USUAL_COLOR}:
            return tree.shader.literal(1)
        usual = "" if name == USUAL_COLOR else name
        return tree.ask("attribute", "vector", tree.shader.name(OPACITY + usual))
    if name in NOT_MADE:
        return tree.shader.literal(0)
    if name in MADE:
        found = tree.ask("attribute", "vector", tree.shader.name(MADE[name]))
        return tree.emit("mean", found) if kind == "Fac" else found
    if name == USUAL_UV:
        found = tree.ask("attribute", "uv", tree.shader.name(""))
        return tree.emit("channel", found, mode=0) if kind == "Fac" else found
    if name == USUAL_COLOR:
        found = tree.ask("attribute", "color", tree.shader.name(""))
        return tree.emit("mean", found) if kind == "Fac" else found
    made = (FACTOR if kind == "Fac" else ATTRIBUTE) + name
    return tree.ask("attribute", "vector", tree.shader.name(made))


@maker("ObjectInfo")
def _object_info(tree: Tree, node: Node, output: Socket, _: Groups) -> Register:
    if output.identifier == "Material Index":
        return tree.shader.literal(tree.material_index)
    if output.identifier not in _OBJECT:
        return tree.refuse(node, f"{{}} gives '{output.name}', which is not modelled", _BAKE)
    return tree.ask("object", _OBJECT[output.identifier])


@maker("LightPath")
def _light_path(tree: Tree, node: Node, output: Socket, _: Groups) -> Register:
    return tree.ask("path", output.identifier)


@maker("CameraData")
def _camera_data(tree: Tree, node: Node, output: Socket, _: Groups) -> Register:
    return tree.ask("camera", _CAMERA[output.identifier])


@maker("Fresnel")
def _fresnel(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    return tree.emit("fresnel", tree.get(node, "IOR", groups), tree.normal(node, groups))


@maker("LayerWeight")
def _layer_weight(tree: Tree, node: Node, output: Socket, groups: Groups) -> Register:
    inputs = (tree.get(node, "Blend", groups), tree.normal(node, groups))
    return tree.emit("layer_weight", *inputs, mode=output.identifier)


@maker("RGB", "Value")
def _value(tree: Tree, node: Node, output: Socket, _: Groups) -> Register:
    number = output.default_value
    return tree.shader.literal(*(number[:3] if hasattr(number, "__len__") else (number,)))
