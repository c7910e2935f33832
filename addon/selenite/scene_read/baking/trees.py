# SPDX-License-Identifier: GPL-3.0-or-later
"""Copies of materials that emit the output of a node, whatever group it is in."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import bpy
import numpy as np

from .. import hosts

if TYPE_CHECKING:
    from ..hosts import BpyStruct
    from .request import OutputRequest

#: Attribute that holds the Generated coordinates of a mesh whose modifiers were applied.
_GENERATED = "selenite_generated"
_SOCKET = "selenite_output"
#: Textures that take UVs, or nothing, where nothing is linked to them.
_NOT_GENERATED = {
    *("ShaderNodeTexImage", "ShaderNodeTexEnvironment", "ShaderNodeTexWhiteNoise"),
    *("ShaderNodeTexSky", "ShaderNodeTexIES", "ShaderNodeTexPointDensity"),
}


def keep_generated(evaluated: BpyStruct, mesh: bpy.types.Mesh) -> None:  # a mesh
    """`mesh` is a copy of an evaluated one, which alone knows where its vertices were before they
    were deformed."""
    undeformed = hosts.floats(evaluated.vertices, "undeformed_co", 3)
    middle = np.array(evaluated.texspace_location, np.float32)
    size = np.array(evaluated.texspace_size, np.float32)
    half = np.divide(0.5, size, out=np.zeros(3, np.float32), where=size != 0)
    attribute: BpyStruct = mesh.attributes.new(_GENERATED, "FLOAT_VECTOR", "POINT")
    values = undeformed * half - (middle * half - np.float32(0.5))
    attribute.data.foreach_set("vector", np.ascontiguousarray(values).reshape(-1))


@contextmanager
def emitting(material: bpy.types.Material, output: OutputRequest) -> Iterator[bpy.types.Material]:
    """A material that emits `output`, for a moment, on a mesh of `keep_generated`."""
    made = material.copy()
    groups: list[bpy.types.NodeTree] = []
    try:
        tree = made.node_tree
        _name_generated(tree, groups)
        path = []
        for name in output["groups"]:
            node = tree.nodes[name]
            node.node_tree = node.node_tree.copy()
            groups.append(node.node_tree)
            path.append((tree, node))
            tree = node.node_tree
        node = tree.nodes[output["node"]]
        socket = next(item for item in node.outputs if item.identifier == output["socket"])
        for outer, group in reversed(path):
            socket = _led_out(tree, group, socket)
            tree = outer
        _emit(tree, socket)
        yield made
    finally:
        bpy.data.materials.remove(made)
        for item in groups:
            bpy.data.node_groups.remove(item)


def _led_out(
    tree: bpy.types.NodeTree, group: bpy.types.Node, socket: bpy.types.NodeSocket
) -> bpy.types.NodeSocket:
    """The output of a group node that gives what `socket`, inside, gives."""
    hosts.add_group_output(tree, _SOCKET, "NodeSocketColor")
    ends = [node for node in tree.nodes if node.bl_idname == "NodeGroupOutput"]
    end = next((node for node in ends if node.is_active_output), None)
    end = end or tree.nodes.new("NodeGroupOutput")
    tree.links.new(socket, next(item for item in end.inputs if item.name == _SOCKET))
    return next(item for item in group.outputs if item.name == _SOCKET)


def _emit(tree: bpy.types.NodeTree, socket: bpy.types.NodeSocket) -> None:
    """The surface emits what `socket` gives, and there is nothing but the surface."""
    for node in [item for item in tree.nodes if item.bl_idname == "ShaderNodeOutputMaterial"]:
        tree.nodes.remove(node)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    emission = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(socket, emission.inputs["Color"])
    tree.links.new(emission.outputs[0], output.inputs["Surface"])


def _name_generated(tree: bpy.types.NodeTree, groups: list[bpy.types.NodeTree]) -> None:
    """Whatever takes Generated coordinates takes the attribute; groups become copies."""
    for node in list(tree.nodes):
        inner = getattr(node, "node_tree", None)
        if inner is not None:
            node.node_tree = inner.copy()
            groups.append(node.node_tree)
            _name_generated(node.node_tree, groups)
        if node.bl_idname == "ShaderNodeTexCoord" and not node.from_instancer:
            for link in list(node.outputs["Generated"].links):
                tree.links.new(_attribute(tree), link.to_socket)
        elif node.bl_idname.startswith("ShaderNodeTex") and node.bl_idname not in _NOT_GENERATED:
            vector: bpy.types.NodeSocket | None = node.inputs.get("Vector")
            if vector is not None and not vector.is_linked:
                tree.links.new(_attribute(tree), vector)


def _attribute(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeAttribute")
    node.attribute_name = _GENERATED
    return node.outputs["Vector"]
