# SPDX-License-Identifier: GPL-3.0-or-later
"""Following the links of a node tree to where a value comes from.

Nodes are recognised by `bl_idname`; names and order mean nothing. Reroutes and node groups are
looked through.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import bpy

from ..parameters import Values
from ..problems import Problem
from . import hosts

_CONSTANT_NODES = {"ShaderNodeRGB", "ShaderNodeValue"}

Groups = tuple[bpy.types.Node, ...]  # the group nodes that were entered, outermost first


class Unreadable(Exception):
    """Why something cannot be rendered, as a Problem."""

    def __init__(self, title: str, cause: str, cure: str) -> None:
        super().__init__(cause)
        self.problem = Problem(title, cause, cure)


@dataclass(frozen=True)
class Source:
    """Where a socket's value comes from.

    `node` is None when the value sits on `socket` itself (an unlinked input); otherwise `socket` is
    the output of `node` that feeds it.
    """

    node: bpy.types.Node | None
    socket: bpy.types.NodeSocket
    groups: Groups


def source_of(socket: bpy.types.NodeSocket, groups: Groups = ()) -> Source:
    """Follows `socket`, an input, to its value or to the node that feeds it."""
    link = next((item for item in socket.links if not item.is_muted), None)
    if link is None:
        return Source(None, socket, groups)
    node, output = link.from_node, link.from_socket
    if node.mute:
        return Source(node, output, groups)
    if node.bl_idname == "NodeReroute":
        return source_of(node.inputs[0], groups)
    if node.bl_idname == "NodeGroupInput" and groups:
        outer = _by_identifier(groups[-1].inputs, output.identifier)
        if outer is not None:
            return source_of(outer, groups[:-1])
    if node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None:
        inner = _group_output(node.node_tree, output.identifier)
        if inner is not None:
            return source_of(inner, (*groups, node))
    return Source(node, output, groups)


def constant(source: Source) -> Values | None:
    """The number or colour (three channels) of a source, None if it varies or is unknown."""
    holder = source.socket
    node = source.node
    if node is not None and (node.mute or node.bl_idname not in _CONSTANT_NODES):
        return None
    value = getattr(holder, "default_value", None)
    if value is None or isinstance(value, str):
        return None
    if hasattr(value, "__len__"):
        return tuple(float(channel) for channel in value[:3])
    return (float(value),)


def converted(value: Values, width: int) -> Values:
    """A number for a colour means grey; a colour for a number its luminance, as in Blender."""
    if width == 1 and len(value) == 3:
        return (0.2126729 * value[0] + 0.7151522 * value[1] + 0.0721750 * value[2],)
    return value * width if len(value) == 1 else value


def describe(node: bpy.types.Node) -> str:
    """A node for a message: its label or name, and its type."""
    muted = "muted " if node.mute else ""
    return f"{muted}node '{node.label or node.name}' ({node.bl_label})"


def why_not_writable(source: Source, owner: bpy.types.ID) -> str:
    """Why a value cannot be written to `source`; empty if it can.

    `owner` is the material or world that the node tree belongs to.
    """
    if owner.library is not None:
        return f"linked from library '{owner.library.filepath}': make it local"
    if owner.override_library is not None or not hosts.is_editable(owner):
        return "a library override, whose nodes cannot be edited: make it local"
    if source.node is not None:
        return f"linked to {describe(source.node)}: unlink it to fit one value"
    tree = source.socket.id_data
    if tree.library is not None:
        return f"inside node group '{tree.name}' of a library: make the group local"
    if source.groups and tree.users > 1:
        return f"inside node group '{tree.name}', which has {tree.users} users: make it single-user"
    return why_animated(tree, source.socket.path_from_id("default_value"))


def why_animated(block: bpy.types.ID, path: str) -> str:
    """Why the value at `path` of `block` does not keep what is written; empty if it does."""
    for kind, animated in hosts.animated_paths(block):
        if animated == path:
            cure = "remove the driver" if kind == "driven" else "clear its keyframes"
            return f"{kind}: {cure}"
    return ""


def _by_identifier(
    sockets: Iterable[bpy.types.NodeSocket], identifier: str
) -> bpy.types.NodeSocket | None:
    return next((item for item in sockets if item.identifier == identifier), None)


def _group_output(tree: bpy.types.NodeTree, identifier: str) -> bpy.types.NodeSocket | None:
    outputs = [node for node in tree.nodes if node.bl_idname == "NodeGroupOutput"]
    active = next((node for node in outputs if node.is_active_output), None)
    return _by_identifier(active.inputs, identifier) if active is not None else None
