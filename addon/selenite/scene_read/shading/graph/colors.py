# SPDX-License-Identifier: GPL-3.0-or-later
"""Mix, tables (Color Ramp and curves), and what changes a colour."""

from __future__ import annotations

import bpy
import numpy as np

from ...shaders import TABLE_SIZE, Register
from ..nodes import Groups
from . import ramps
from .tree import Tree, maker

Node = bpy.types.Node
Socket = bpy.types.NodeSocket
#: By what a Mix node's sockets end, by its type of data.
_ENDINGS = {"FLOAT": "Float", "VECTOR": "Vector", "RGBA": "Color", "ROTATION": "Rotation"}


@maker("Mix")
def _mix(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    kind = node.data_type
    if kind not in {"FLOAT", "VECTOR", "RGBA"}:
        return tree.refuse(node, "{} mixes rotations", "mix vectors instead")
    uniform = kind != "VECTOR" or node.factor_mode == "UNIFORM"
    factor = tree.get(node, "Factor_Float" if uniform else "Factor_Vector", groups)
    a, b = (tree.get(node, f"{name}_{_ENDINGS[kind]}", groups) for name in "AB")
    flags = ("clamp_factor",) * node.clamp_factor
    mode = "MIX"
    if kind == "RGBA":
        mode = node.blend_type
        flags += ("clamp_result",) * node.clamp_result
    return tree.emit("mix", factor, a, b, mode=mode, flags=flags)


@maker("MixRGB")
def _mix_rgb(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    inputs = [tree.value(item, groups) for item in node.inputs[:3]]
    flags = ("clamp_factor", *("clamp_result",) * node.use_clamp)
    return tree.emit("mix", *inputs, mode=node.blend_type, flags=flags)


@maker("ValToRGB")
def _ramp(tree: Tree, node: Node, output: Socket, groups: Groups) -> Register:
    # Blender 3 has 256 entries at i / 255: one more entry would move them.
    places = np.arange(TABLE_SIZE) / (TABLE_SIZE - 1)
    colors = np.array([node.color_ramp.evaluate(float(x)) for x in places], np.float32)
    values = np.repeat(colors[:, 3:], 3, axis=1) if output.identifier == "Alpha" else colors[:, :3]
    flags = ("stepped",) * (node.color_ramp.interpolation == "CONSTANT")
    place = tree.get(node, "Fac", groups)
    parts = None if output.identifier == "Alpha" else ramps.shares(node.color_ramp, places)
    if parts is None:
        return tree.emit("table", place, flags=flags, item=tree.shader.table(values))
    stops = tree.stops(node, output, groups)

    def share(of: int) -> Register:
        item = tree.shader.table(np.repeat(parts[:, of : of + 1], 3, axis=1))
        return tree.emit("table", place, flags=flags, item=item)

    if len(stops) == 1:
        return stops[0]
    if len(stops) == 2:
        return tree.emit("mix", share(1), *stops, mode="MIX")
    found = zero = tree.shader.literal(0)
    for number, color in enumerate(stops):
        inputs = (share(number), color, found, zero)
        found = tree.emit("vector_math", *inputs, mode="MULTIPLY_ADD")
    return found


def _curve_table(tree: Tree, node: Node, curves: list[list[int]]) -> tuple[int, tuple[str, ...]]:
    """The table of three channels, each through its curves in turn, and its flags."""
    mapping = node.mapping
    mapping.initialize()
    ends = [(item.points[0].location[0], item.points[-1].location[0]) for item in mapping.curves]
    low, high = min(end[0] for end in ends), max(end[1] for end in ends)
    values = np.empty((TABLE_SIZE, 3), np.float32)
    for row, x in enumerate(np.linspace(low, high, TABLE_SIZE)):
        for column, chain in enumerate(curves):
            y = float(x)
            for number in chain:
                y = mapping.evaluate(mapping.curves[number], y)
            values[row, column] = y
    extrapolated = mapping.extend == "EXTRAPOLATED"
    return tree.shader.table(values, low, high), ("extrapolate",) * extrapolated


def _curves(
    tree: Tree, node: Node, groups: Groups, value: str, curves: list[list[int]]
) -> Register:
    item, flags = _curve_table(tree, node, curves)
    before = tree.get(node, value, groups)
    after = tree.emit("table_each", before, flags=flags, item=item)
    return tree.emit("mix", tree.get(node, "Fac", groups, 1.0), before, after, mode="MIX")


@maker("RGBCurve")
def _rgb_curves(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    return _curves(tree, node, groups, "Color", [[3, 0], [3, 1], [3, 2]])


@maker("VectorCurve")
def _vector_curves(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    return _curves(tree, node, groups, "Vector", [[0], [1], [2]])


@maker("FloatCurve")
def _float_curve(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    item, flags = _curve_table(tree, node, [[0]] * 3)
    before = tree.get(node, "Value", groups)
    after = tree.emit("table", before, flags=flags, item=item)
    return tree.emit("mix", tree.get(node, "Factor", groups, 1.0), before, after, mode="MIX")


@maker("HueSaturation")
def _hue_saturation(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    names = ("Hue", "Saturation", "Value", "Fac", "Color")
    return tree.emit("hue_saturation", *(tree.get(node, name, groups) for name in names))


@maker("BrightContrast")
def _bright_contrast(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    names = ("Color", "Bright", "Contrast")
    return tree.emit("bright_contrast", *(tree.get(node, name, groups) for name in names))


@maker("Gamma")
def _gamma(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    return tree.emit("gamma", tree.get(node, "Color", groups), tree.get(node, "Gamma", groups))


@maker("Invert")
def _invert(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    return tree.emit("invert", tree.get(node, "Fac", groups), tree.get(node, "Color", groups))


@maker("RGBToBW")
def _grey(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    return tree.emit("luminance", tree.get(node, "Color", groups))


@maker("Blackbody")
def _blackbody(tree: Tree, node: Node, _: Socket, groups: Groups) -> Register:
    return tree.emit("blackbody", tree.get(node, "Temperature", groups))
