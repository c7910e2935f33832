# SPDX-License-Identifier: GPL-3.0-or-later
"""Math, Vector Math, ranges, and nodes that take values apart or put them together."""

from __future__ import annotations

import bpy

from ...shaders import Register
from ..nodes import Groups
from .tree import Tree, maker

Node = bpy.types.Node
Socket = bpy.types.NodeSocket


@maker("Math")
def _math(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    inputs = [tree.value(item, groups) for item in node.inputs[:3]]
    return tree.math(node.operation, *inputs, clamp=node.use_clamp)


@maker("VectorMath")
def _vector_math(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    inputs = [tree.value(item, groups) for item in node.inputs[:3]]
    number = tree.get(node, "Scale", groups)
    return tree.emit("vector_math", *inputs, number, mode=node.operation)


@maker("Clamp")
def _clamp(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    inputs = [tree.get(node, name, groups) for name in ("Value", "Min", "Max")]
    return tree.emit("clamp", *inputs, flags=("sorted",) * (node.clamp_type == "RANGE"))


@maker("MapRange")
def _map_range(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    is_vector = getattr(node, "data_type", "FLOAT") == "FLOAT_VECTOR"
    names = ["Value", "From Min", "From Max", "To Min", "To Max", "Steps"]
    if is_vector:
        names = ["Vector", *(name.replace(" ", "_") + "_FLOAT3" for name in names[1:])]
    inputs = [tree.get(node, name, groups, 4.0) for name in names]
    flags = ("per_channel",) * is_vector + ("clamp_result",) * bool(node.clamp)
    return tree.emit("map_range", *inputs, mode=node.interpolation_type, flags=flags)


@maker("CombineXYZ", "CombineRGB")
def _combine(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    return tree.emit("combine", *(tree.value(item, groups) for item in node.inputs[:3]))


@maker("SeparateXYZ", "SeparateRGB")
def _separate(tree: Tree, node: Node, output: Socket, groups: Groups) -> Register:
    return channel(tree, tree.value(node.inputs[0], groups), node, output)


def channel(tree: Tree, whole: Register, node: Node, output: Socket) -> Register:
    """One of the three outputs of a node that takes a value apart."""
    number = [item.identifier for item in node.outputs].index(output.identifier)
    return tree.emit("channel", whole, mode=number)


@maker("CombineHSV")
def _combine_hsv(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    whole = tree.emit("combine", *(tree.value(item, groups) for item in node.inputs[:3]))
    return tree.emit("convert", whole, mode="from_hsv")


@maker("SeparateHSV")
def _separate_hsv(tree: Tree, node: Node, output: Socket, groups: Groups) -> Register:
    whole = tree.emit("convert", tree.value(node.inputs[0], groups), mode="to_hsv")
    return channel(tree, whole, node, output)


@maker("CombineColor")
def _combine_color(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    whole = tree.emit("combine", *(tree.value(item, groups) for item in node.inputs[:3]))
    if node.mode == "RGB":
        return whole
    return tree.emit("convert", whole, mode=f"from_{node.mode.lower()}")


@maker("SeparateColor")
def _separate_color(tree: Tree, node: Node, output: Socket, groups: Groups) -> Register:
    whole = tree.value(node.inputs[0], groups)
    if node.mode != "RGB":
        whole = tree.emit("convert", whole, mode=f"to_{node.mode.lower()}")
    return channel(tree, whole, node, output)
