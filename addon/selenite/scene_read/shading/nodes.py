# SPDX-License-Identifier: GPL-3.0-or-later
"""Following the links of a node tree to where a value comes from, as Cycles does.

Nodes are recognised by `bl_idname`; names and order mean nothing. Reroutes, node groups and muted
nodes only pass a value on, but each of their sockets converts it to its own type.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy

from ...parameters import Values
from ...problems import Problem, Reason
from .. import hosts
from ..values import LUMINANCE

if TYPE_CHECKING:
    from ..hosts import BpyStruct

_CONSTANT_NODES = {"ShaderNodeRGB", "ShaderNodeValue"}
#: Socket type -> what Cycles passes through it.
_KINDS = {"VALUE": "float", "INT": "int", "BOOLEAN": "int", "VECTOR": "vector", "RGBA": "color"}
_NAMES = {
    "VALUE": "Float",
    "INT": "Integer",
    "BOOLEAN": "Boolean",
    "VECTOR": "Vector",
    "RGBA": "Color",
    "SHADER": "Shader",
}

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
    the output of `node` that feeds it. `passed`: the sockets that the value passes afterwards, the
    one that was asked for last. `unset`: nothing feeds `socket`, which passes on nothing but zeros.
    `stop`: of a Color Ramp, the stop whose colour is meant; -1: the value of `socket` itself.
    """

    node: bpy.types.Node | None
    socket: bpy.types.NodeSocket
    groups: Groups
    passed: tuple[bpy.types.NodeSocket, ...] = ()
    unset: bool = False
    stop: int = -1

    @property
    def place(self) -> tuple[BpyStruct, str]:
        """What holds the value, and by which property."""
        if self.stop >= 0 and self.node is not None:
            return self.node.color_ramp.elements[self.stop], "color"
        return self.socket, "default_value"

    @property
    def kinds(self) -> tuple[str, ...]:
        """What Cycles takes the value for at each socket: "float", "int", "vector", "color"; ""
        for what is no number."""
        return tuple(_KINDS.get(item.type, "") for item in (self.socket, *self.passed))

    @property
    def conversion(self) -> str:
        """The socket that takes the value for something else, for a message; "" if none does."""
        before = self.socket
        for item in self.passed:
            if _width(item) != _width(before):
                return f"socket '{item.name}' ({_NAMES.get(item.type, item.type)})"
            before = item
        return ""


@dataclass(frozen=True)
class Output:
    """What Cycles takes for the output of a tree. `ends`: the output node of the tree and those in
    its groups, with the groups around each; the inner ones come first, linked or not. A muted one
    gives nothing. `node`: that of the tree, or the first."""

    tree: bpy.types.NodeTree
    node: bpy.types.Node
    ends: tuple[tuple[bpy.types.Node, Groups], ...]

    def source(self, name: str) -> Source:
        """What arrives at "Surface", "Volume" or "Displacement": at the first that a node feeds."""
        for node, groups in self.ends:
            inlet: bpy.types.NodeSocket | None = node.inputs.get(
                name
            )  # a world has no Displacement
            source = source_of(inlet, groups) if inlet is not None else None
            if source is not None and source.node is not None:
                return source
        return Source(None, self.node.inputs.get(name) or self.node.inputs[0], (), unset=True)


def output_of(tree: bpy.types.NodeTree | None) -> Output | None:
    """The output of a material's, a world's or a lamp's tree; None if it has none."""
    if tree is None:
        return None
    ends = tuple(_ends(tree, ()))
    own = tree.get_output_node("CYCLES")  # type: ignore[attr-defined]
    if own is None and not ends:
        return None
    return Output(tree, ends[0][0] if own is None else own, ends)


def _ends(tree: bpy.types.NodeTree, groups: Groups) -> Iterator[tuple[bpy.types.Node, Groups]]:
    for node in tree.nodes:
        inner = getattr(node, "node_tree", None)
        if node.bl_idname == "ShaderNodeGroup" and inner is not None and not node.mute:
            yield from _ends(inner, (*groups, node))
    own = tree.get_output_node("CYCLES")  # type: ignore[attr-defined]
    if own is not None and not own.mute:
        yield own, groups


def source_of(socket: bpy.types.NodeSocket, groups: Groups = ()) -> Source:
    """Follows `socket`, an input, to its value or to the node that feeds it."""
    passed: tuple[bpy.types.NodeSocket, ...] = ()
    converts = True  # an input of a reroute or a muted node does not, only the output
    while (link := link_of(socket)) is not None:
        node, output = link.from_node, link.from_socket
        inner = passed_on(node, output, groups)
        if inner is None and (node.mute or node.bl_idname == "NodeGroupInput"):
            break  # Cycles does not know this output, and passes over the link
        if converts:
            passed = (socket, *passed)
        if inner is None:
            is_group = node.bl_idname == "ShaderNodeGroup"
            return Source(None if is_group else node, output, groups, passed, is_group)
        socket, groups = inner
        converts = not (node.mute or node.bl_idname == "NodeReroute")
        if not converts:
            passed = (output, *passed)
    if converts:
        return Source(None, socket, groups, passed)
    return Source(None, passed[0], groups, passed[1:], unset=True)


def passed_on(
    node: bpy.types.Node, output: bpy.types.NodeSocket, groups: Groups
) -> tuple[bpy.types.NodeSocket, Groups] | None:
    """The input that `node` hands on by `output`, and the groups around it; None if there is none:
    the node makes a value of its own, or nothing feeds this output."""
    found: bpy.types.NodeSocket | None = None
    if node.mute:
        ends = (link.from_socket for link in node.internal_links if link.to_socket == output)
        found = next(ends, None)
    elif node.bl_idname == "NodeReroute":
        found = node.inputs[0]
    elif node.bl_idname == "NodeGroupInput" and groups:
        found, groups = _by_identifier(groups[-1].inputs, output.identifier), groups[:-1]
    elif node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None:
        found, groups = _group_output(node.node_tree, output.identifier), (*groups, node)
    return None if found is None else (found, groups)


def link_of(socket: bpy.types.NodeSocket) -> bpy.types.NodeLink | None:
    """The link that feeds an input, None if it has none that counts."""
    return next(
        (
            item
            for item in socket.links
            if item.is_valid
            and not item.is_muted
            and item.from_socket.enabled
            and (item.from_socket.type != "BOOLEAN" or hosts.cycles_has_booleans())
        ),
        None,
    )


def constant(source: Source) -> Values | None:
    """The number or colour (three channels) that arrives at the socket that was asked for; None if
    it varies or is unknown."""
    node = source.node
    if node is not None and node.bl_idname not in _CONSTANT_NODES:
        return None
    before, *kinds = source.kinds
    if not before:
        return None
    own = (0.0,) if source.unset else _numbers(source.socket.default_value)
    value = _as_kind(own, before, before)
    for kind in kinds:
        if not kind:
            return None
        value, before = _as_kind(value, before, kind), kind
    return value


def _numbers(found: BpyStruct) -> Values:  # the value of any socket
    if hasattr(found, "__len__"):
        return tuple(float(channel) for channel in found[:3])
    return (float(found),)


def _as_kind(value: Values, before: str, kind: str) -> Values:
    """What Cycles makes of a value between two sockets: luminance of a colour, mean of a vector,
    whole numbers cut off towards 0, and the same number in all channels."""
    if kind in {"vector", "color"}:
        return value if len(value) == 3 else value * 3
    if len(value) == 3:
        weights = LUMINANCE if before == "color" else (1 / 3,) * 3
        value = (sum(w * x for w, x in zip(weights, value, strict=True)),)
    if kind == "int" and math.isfinite(value[0]):
        value = (float(math.trunc(value[0])),)
    return value


def grey_of(source: Source) -> str | None:
    """What becomes of a colour that varies on its way: "" nothing, "luminance" or "mean" in all
    channels; None if it is cut to whole numbers or is no number.

    The luminance that only the last socket takes is left to the parameter, which takes it itself.
    """
    before, *kinds = source.kinds
    grey = ""
    for left, kind in zip(reversed(range(len(kinds))), kinds, strict=True):
        if kind in {"", "int"} or before in {"", "int"}:
            return None
        if kind == "float" and before == "vector" and not grey:
            grey = "mean"
        if kind == "float" and before == "color" and not grey and left:
            grey = "luminance"
        before = kind
    return grey


def broadcast(value: Values, width: int) -> Values:
    """One number given for a colour means grey."""
    return value * width if len(value) == 1 else value


def describe(node: bpy.types.Node) -> str:
    """A node for a message: its label or name, and its type."""
    return f"node '{node.label or node.name}' ({node.bl_label})"


def why_not_writable(source: Source, owner: bpy.types.ID) -> Reason:
    """Why a value cannot be written to `source`; empty if it can.

    `owner` is the material or world that the node tree belongs to.
    """
    if reason := why_owner_fixed(owner):
        return reason
    if source.node is not None:
        return Reason(f"linked to {describe(source.node)}", "unlink it to fit one value")
    if source.unset:
        return Reason(f"fed by socket '{source.socket.name}', which passes on nothing", "unlink it")
    if source.conversion:
        return Reason(
            f"converted by {source.conversion}", "link it through sockets of its own type"
        )
    return why_constant_fixed(source, owner)


def why_constant_fixed(source: Source, owner: bpy.types.ID) -> Reason:
    """As `why_not_writable`, for what follows in the graph is computed: a node of one value, a stop
    and a conversion do no harm."""
    if reason := why_owner_fixed(owner):
        return reason
    if source.socket.type in {"INT", "BOOLEAN"}:
        return Reason(f"held by socket '{source.socket.name}' of whole numbers", "unlink it")
    tree = source.socket.id_data
    holder, name = source.place
    fixed = why_tree_fixed(tree, source.groups, owner)
    return fixed or why_animated(tree, holder.path_from_id(name))


def why_tree_fixed(tree: bpy.types.ID, groups: Groups, owner: bpy.types.ID) -> Reason:
    """Why the nodes of `tree`, inside `groups`, cannot be changed for `owner` alone; empty if they
    can."""
    if reason := why_owner_fixed(owner):
        return reason
    if tree.library is not None:
        return Reason(f"inside node group '{tree.name}' of a library", "make the group local")
    return why_shared(groups)


def why_owner_fixed(owner: bpy.types.ID) -> Reason:
    """Why no node of a material or world can be edited; empty if they can."""
    if owner.library is not None:
        return Reason(f"linked from library '{owner.library.filepath}'", "make it local")
    if owner.override_library is not None or not hosts.is_editable(owner):
        return Reason("a library override, whose nodes cannot be edited", "make it local")
    return Reason()


def why_shared(groups: Groups) -> Reason:
    """Why what is inside `groups` belongs to more than one place; empty if it does not."""
    for group in groups:
        tree = group.node_tree
        uses = hosts.group_uses(tree)
        if uses > 1:
            return Reason(
                f"inside node group '{tree.name}', which has {uses} users", "make it single-user"
            )
    return Reason()


def _width(socket: bpy.types.NodeSocket) -> int:
    """Of the numbers that a socket holds; 0: none. Whole ones are their own kind."""
    return {"float": 1, "int": -1, "vector": 3, "color": 3}.get(_KINDS.get(socket.type, ""), 0)


def why_animated(block: bpy.types.ID, path: str) -> Reason:
    """Why the value at `path` of `block` does not keep what is written; empty if it does."""
    for kind, animated in hosts.animated_paths(block):
        if animated == path:
            cure = "remove the driver" if kind == "driven" else "clear its keyframes"
            return Reason(kind, cure)
    return Reason()


def _by_identifier(
    sockets: Iterable[bpy.types.NodeSocket], identifier: str
) -> bpy.types.NodeSocket | None:
    return next((item for item in sockets if item.identifier == identifier), None)


def _group_output(tree: bpy.types.NodeTree, identifier: str) -> bpy.types.NodeSocket | None:
    outputs = [node for node in tree.nodes if node.bl_idname == "NodeGroupOutput"]
    active = next((node for node in outputs if node.is_active_output and not node.mute), None)
    return _by_identifier(active.inputs, identifier) if active is not None else None
