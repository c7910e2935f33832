# SPDX-License-Identifier: GPL-3.0-or-later
"""Tangents, along which the highlights of two widths lie."""

from __future__ import annotations

import math

import bpy

from ...shaders import TANGENT, Register
from ..nodes import Groups
from .tree import Tree, maker

Node = bpy.types.Node
Socket = bpy.types.NodeSocket

#: Axis of a radial tangent -> the coordinates that its components are, and their signs.
_RADIAL = {
    "X": ((0, 0), (2, -1), (1, 1)),
    "Y": ((2, -1), (0, 0), (0, 1)),
    "Z": ((1, -1), (0, 1), (0, 0)),
}
_OBJECT_TO_WORLD = 3
#: Inputs that turn a tangent; of the Principled BSDF the second.
_ROTATIONS = ("Rotation", "Anisotropic Rotation")


@maker("Tangent")
def _tangent(tree: Tree, node: Node, _: Socket, __: Groups) -> Register:
    if node.direction_type == "RADIAL":
        return _radial(tree, node.axis)
    name = tree.shader.name(TANGENT + node.uv_map)
    return _in_surface(tree, tree.ask("attribute", "vector", name))


def tangent_of(tree: Tree, node: Node, groups: Groups) -> Register:
    """The Tangent of a closure turned by its rotation; nothing linked: around the z axis."""
    linked = tree.is_linked(node, "Tangent", groups)
    tangent = tree.get(node, "Tangent", groups) if linked else _radial(tree, "Z")
    rotation = next(name for name in _ROTATIONS if tree.find(node, name) is not None)
    if tree.number_of(node, rotation, groups) == 0:
        return tangent
    turn = tree.math("MULTIPLY", tree.get(node, rotation, groups), tree.shader.literal(2 * math.pi))
    zero = tree.shader.literal(0)
    axis = tree.given(tree.normal(node, groups))
    return tree.emit("rotate", tangent, zero, axis, turn, zero, mode="AXIS_ANGLE")


def _radial(tree: Tree, axis: str) -> Register:
    generated = tree.emit(
        "vector_math",
        tree.generated(),
        tree.shader.literal(0.5, 0.5, 0.5),
        tree.shader.literal(0),
        tree.shader.literal(0),
        mode="SUBTRACT",
    )
    parts = [
        tree.math(
            "MULTIPLY",
            tree.emit("channel", generated, mode=channel),
            tree.shader.literal(sign),
        )
        for channel, sign in _RADIAL[axis]
    ]
    return _in_surface(tree, tree.emit("combine", *parts))


def _in_surface(tree: Tree, vector: Register) -> Register:
    """The part across the normal of a direction of the object."""
    normal = tree.ask("geometry", "normal")
    zero = tree.shader.literal(0)
    world = tree.emit("transform", vector, mode="NORMAL", item=_OBJECT_TO_WORLD)
    across = tree.emit("vector_math", world, normal, zero, zero, mode="CROSS_PRODUCT")
    unit = tree.emit("vector_math", across, zero, zero, zero, mode="NORMALIZE")
    return tree.emit("vector_math", normal, unit, zero, zero, mode="CROSS_PRODUCT")
