# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender's importers make of a base colour: pictures, factors and how they are placed, out
of the nodes of a material."""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy
import numpy as np

from ..scene_read import hosts
from .reconstruction import WHITE

_COLORS = ("ShaderNodeVertexColor", "ShaderNodeAttribute")
#: Inputs of a Principled BSDF that show in photos and that an import leaves out.
_LEFT_OUT = (
    "Alpha", "Normal", "Metallic", "Roughness", "Transmission Weight", "Transmission",
    "Emission Color", "Emission", "Coat Weight", "Clearcoat", "Sheen Weight", "Sheen",
)  # fmt: skip
#: Those of them whose value without a link is another material as well.
_VALUES = {
    "Alpha": 1.0, "Metallic": 0.0, "Transmission Weight": 0.0, "Transmission": 0.0,
    "Coat Weight": 0.0, "Clearcoat": 0.0,
}  # fmt: skip


@dataclass
class BaseColor:
    """images: behind the base colour, the first of which counts. color: factor on it, or the colour
    without one. times_colors: whether colours of vertices are a factor. uv_map: its name, "" for
    the usual one. placed: (2, 3), from texture coordinates to those of the picture. extension: of
    the Image Texture. mixed_wrap: whether it repeats otherwise across than down. unread: names of
    nodes that stand between and are not read. left_out: other inputs that the file sets."""

    images: list[bpy.types.Image] = field(default_factory=list)
    color: tuple[float, float, float] = WHITE
    times_colors: bool = False
    uv_map: str = ""
    placed: np.ndarray = field(default_factory=lambda: np.eye(2, 3))
    extension: str = "REPEAT"
    mixed_wrap: bool = False
    unread: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)


def base_color(material: bpy.types.Material | None) -> BaseColor:
    """Of the material's Principled BSDF; of one that has none, as glTF has for what is lit already,
    of its Emission, or of any picture of colours."""
    found = BaseColor()
    tree = material.node_tree if material is not None else None
    if tree is None:
        return found
    shaders = [node for node in tree.nodes if "Base Color" in node.inputs]
    sockets: list[bpy.types.NodeSocket] = [node.inputs["Base Color"] for node in shaders]
    for node in shaders:
        found.left_out += _left_out(node)
    if not shaders:
        kinds = ("ShaderNodeEmission", "ShaderNodeBackground")
        sockets = [node.inputs["Color"] for node in tree.nodes if node.bl_idname in kinds]
    if sockets:
        factors = np.ones(3)
        _follow(sockets[0], found, factors)
        found.color = tuple(float(value) for value in factors)  # type: ignore[assignment]
    if not shaders and not found.images:
        found.images = _colour_images(tree)
    return found


def _colour_images(tree: bpy.types.NodeTree) -> list[bpy.types.Image]:
    images = (getattr(node, "image", None) for node in tree.nodes)
    return [image for image in images if image is not None and not hosts.is_data(image)]


def _left_out(node: bpy.types.Node) -> list[str]:
    found = []
    for name in _LEFT_OUT:
        socket: bpy.types.NodeSocket | None = node.inputs.get(name)
        if socket is None:
            continue
        usual = _VALUES.get(name)
        other = usual is not None and abs(socket.default_value - usual) > 1e-6
        if socket.is_linked or other:
            found.append(name)
    return found


def _follow(socket: bpy.types.NodeSocket, found: BaseColor, factors: np.ndarray) -> None:
    """Multiplies `factors` by what is constant behind a socket of a colour."""
    if not socket.is_linked:
        np.multiply(factors, np.array(socket.default_value, np.float64)[:3], out=factors)
        return
    link = socket.links[0]
    node = link.from_node
    if node.bl_idname == "ShaderNodeTexImage":
        if node.image is not None:
            if not found.images:
                _place(node, found)
            found.images.append(node.image)
    elif node.bl_idname == "NodeReroute":
        _follow(node.inputs[0], found, factors)
    elif node.bl_idname in _COLORS:
        found.times_colors = True
    elif node.bl_idname == "ShaderNodeRGB":
        np.multiply(factors, np.array(node.outputs[0].default_value)[:3], out=factors)
    elif (sides := _product(node)) is not None:
        for side in sides:
            _follow(side, found, factors)
    else:
        found.unread.append(node.name)
        for side in node.inputs:
            if side.type == "RGBA" and side.is_linked:
                _follow(side, found, np.ones(3))


def _product(node: bpy.types.Node) -> tuple[bpy.types.NodeSocket, ...] | None:
    """The two factors of a node that multiplies colours."""
    if getattr(node, "blend_type", "") != "MULTIPLY":
        return None
    if node.bl_idname == "ShaderNodeMixRGB":
        share, *sides = node.inputs
    elif getattr(node, "data_type", "") == "RGBA":
        share = node.inputs[0]
        sides = [socket for socket in node.inputs if socket.type == "RGBA"]
    else:
        return None
    whole = not share.is_linked and share.default_value == 1.0
    return tuple(sides[:2]) if whole and len(sides) >= 2 else None


def _place(node: bpy.types.Node, found: BaseColor) -> None:
    """Where an Image Texture takes its coordinates."""
    found.extension = node.extension
    socket = node.inputs["Vector"]
    placed = np.eye(2, 3)
    for _ in range(32):  # nodes of a chain; none is longer
        if not socket.is_linked:
            break
        source = socket.links[0].from_node
        if source.bl_idname == "ShaderNodeUVMap":
            found.uv_map = source.uv_map
            break
        if source.bl_idname == "ShaderNodeTexCoord":
            break
        if source.bl_idname == "ShaderNodeMapping" and source.vector_type == "POINT":
            placed = _after(placed, source)
            socket = source.inputs["Vector"]
        elif source.bl_idname in (
            "ShaderNodeCombineXYZ",
            "ShaderNodeSeparateXYZ",
            "ShaderNodeMath",
        ):
            found.mixed_wrap = True  # so the importer folds coordinates of one direction
            socket = next((one for one in source.inputs if one.is_linked), source.inputs[0])
        else:
            found.unread.append(source.name)
            break
    found.placed = placed


def _after(placed: np.ndarray, node: bpy.types.Node) -> np.ndarray:
    """`placed` of what a Mapping makes of coordinates: scaled, turned about z, moved."""
    scale, moved = (np.array(node.inputs[name].default_value)[:2] for name in ("Scale", "Location"))
    angle = node.inputs["Rotation"].default_value[2]
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    linear = placed[:, :2] @ turn @ np.diag(scale)
    return np.column_stack([linear, placed[:, :2] @ moved + placed[:, 2]])
