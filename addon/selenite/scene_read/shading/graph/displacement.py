# SPDX-License-Identifier: GPL-3.0-or-later
"""Displacement that Cycles renders as a bump of the interpolated normal, its default."""

from __future__ import annotations

import bpy

from ... import hosts
from ..nodes import Source
from .tree import Tree

#: Of the bump that Cycles makes of it.
_WIDTH = 0.1


def read_displacement(tree: Tree, source: Source, material: bpy.types.Material) -> None:
    """Sets `tree.base_normal` to what the Displacement of an output makes of it."""
    node, groups = source.node, source.groups
    if node is None:
        return
    if hosts.displacement_method(material) != "BUMP":
        cure = "set the displacement of the material to Bump Only, or unlink it"
        tree.refuse(node, "{} moves the surface itself, which is not rendered", cure)
        return
    if node.bl_idname != "ShaderNodeDisplacement":
        cure = "use a Displacement node, or unlink the Displacement of the output"
        tree.refuse(node, "{} displaces along vectors, which is not rendered", cure)
        return
    if tree.is_linked(node, "Normal", groups):
        tree.refuse(node, "{} has its Normal linked, which is not modelled", "unlink it")
        return
    if not tree.is_linked(node, "Height", groups):
        return
    middle, scale = (tree.get(node, name, groups) for name in ("Midlevel", "Scale"))
    zero, one = tree.shader.literal(0), tree.shader.literal(1)
    normal = tree.ask("geometry", "normal")
    if node.space == "OBJECT":  # its length goes with the scale of the object
        inside = tree.emit("transform", normal, mode="NORMAL", item=1)
        outside = tree.emit("transform", inside, mode="VECTOR", item=3)
        along = tree.emit("vector_math", outside, normal, zero, zero, mode="DOT_PRODUCT")
        scale = tree.math("MULTIPLY", scale, along)
    heights = [
        tree.math("MULTIPLY", tree.math("SUBTRACT", height, middle), scale)
        for height in tree.at_offsets(node, "Height", groups, _WIDTH)
    ]
    tree.base_normal = tree.shader.emit("bump", *heights, None, one, one, shift=(0, _WIDTH))
