# SPDX-License-Identifier: GPL-3.0-or-later
"""Bump and Normal Map."""

from __future__ import annotations

import bpy

from ... import hosts
from ...shaders import NORMAL, SIGN, TANGENT, Register
from ..nodes import Groups
from .tree import Tree, maker

Node = bpy.types.Node
Socket = bpy.types.NodeSocket


@maker("Bump")
def _bump(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    normal = tree.normal(node, groups)
    if not tree.is_linked(node, "Height", groups):
        return tree.given(normal)
    width = hosts.bump_width(node)
    if width is None:
        return tree.refuse(node, "{} has its Filter Width linked", "unlink it")
    heights = tree.at_offsets(node, "Height", groups, width)
    return tree.shader.emit(
        "bump",
        *heights,
        normal,
        tree.get(node, "Strength", groups),
        tree.get(node, "Distance", groups),
        flags=("inverted",) * node.invert,
        shift=(0, width),
    )


@maker("NormalMap")
def _normal_map(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    inputs = [tree.get(node, name, groups) for name in ("Strength", "Color")]
    if node.space == "TANGENT":
        # The three names follow each other, whatever was named before.
        names = tree.shader.names
        item = len(names)
        names.extend((TANGENT + node.uv_map, SIGN + node.uv_map, NORMAL))
        return tree.emit("normal_map", *inputs, mode="TANGENT", item=item)
    if node.space.startswith("BLENDER_"):
        # y and z point the other way.
        zero = tree.shader.literal(0)
        inputs[1] = tree.emit(
            "vector_math",
            inputs[1],
            tree.shader.literal(1, -1, -1),
            tree.shader.literal(0, 1, 1),
            zero,
            mode="MULTIPLY_ADD",
        )
    return tree.emit("normal_map", *inputs, mode=node.space.removeprefix("BLENDER_"))
