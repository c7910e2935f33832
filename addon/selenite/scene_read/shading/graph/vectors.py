# SPDX-License-Identifier: GPL-3.0-or-later
"""Mapping, and what turns vectors or takes them to another space."""

from __future__ import annotations

import bpy

from ...shaders import Register
from ..nodes import Groups
from .tree import Tree, maker

Node = bpy.types.Node
Socket = bpy.types.NodeSocket
_SPACES = ("WORLD", "OBJECT", "CAMERA")


@maker("Mapping")
def _mapping(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    names = ("Vector", "Location", "Rotation", "Scale")
    inputs = [tree.get(node, name, groups) for name in names]
    return tree.emit("mapping", *inputs, mode=node.vector_type)


@maker("VectorRotate")
def _rotate(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    names = ("Vector", "Center", "Axis", "Angle", "Rotation")
    inputs = [tree.get(node, name, groups) for name in names]
    flags = ("inverted",) * node.invert
    return tree.emit("rotate", *inputs, mode=node.rotation_type, flags=flags)


@maker("VectorTransform")
def _transform(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    item = 3 * _SPACES.index(node.convert_from) + _SPACES.index(node.convert_to)
    vector = tree.get(node, "Vector", groups)
    return tree.emit("transform", vector, mode=node.vector_type, item=item)


@maker("Normal")
def _normal(tree: Tree, node: Node, output: Socket, groups: Groups) -> Register:
    """A direction set by hand, and its cosine to another."""
    direction = tree.shader.literal(*node.outputs["Normal"].default_value)
    zero = tree.shader.literal(0)
    unit = tree.emit("vector_math", direction, zero, zero, zero, mode="NORMALIZE")
    if output.identifier == "Normal":
        return unit
    other = tree.get(node, "Normal", groups)
    other = tree.emit("vector_math", other, zero, zero, zero, mode="NORMALIZE")
    return tree.emit("vector_math", unit, other, zero, zero, mode="DOT_PRODUCT")
