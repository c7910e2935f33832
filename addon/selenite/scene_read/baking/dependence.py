# SPDX-License-Identifier: GPL-3.0-or-later
"""What the output of a node depends on: the view, the instance, and every setting before it."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import bpy

from ..shading import nodes
from ..shading.node_settings import settings_of
from ..shading.nodes import Groups

if TYPE_CHECKING:
    from ..hosts import BpyStruct

Node = bpy.types.Node
Socket = bpy.types.NodeSocket

#: Nodes and outputs whose value depends on the ray that meets the surface.
_OF_VIEW = {
    "ShaderNodeLayerWeight",
    "ShaderNodeFresnel",
    "ShaderNodeLightPath",
    "ShaderNodeLightFalloff",
    "ShaderNodeCameraData",
}
#: Nodes that Cycles evaluates in no bake.
_NEVER = {"ShaderNodeScript", "ShaderNodeShaderToRGB"}
#: Nodes none of whose outputs can be baked.
NOT_BAKED = _OF_VIEW | _NEVER
_OUTPUTS_OF_VIEW = {
    ("ShaderNodeTexCoord", "Reflection"),
    ("ShaderNodeTexCoord", "Camera"),
    ("ShaderNodeTexCoord", "Window"),
    ("ShaderNodeNewGeometry", "Incoming"),
    ("ShaderNodeNewGeometry", "Backfacing"),
}
#: Nodes whose value differs from instance to instance of one object.
_OF_INSTANCE = {
    "ShaderNodeObjectInfo",
    "ShaderNodeNewGeometry",
    "ShaderNodeParticleInfo",
    "ShaderNodeAmbientOcclusion",
    "ShaderNodeBevel",
    "ShaderNodeBump",
    "ShaderNodeNormalMap",
    "ShaderNodeTangent",
    "ShaderNodeVectorTransform",
}


def upstream(node: Node, output: Socket, groups: Groups) -> Iterator[tuple[Node, Socket, Groups]]:
    """The output itself, and every one that feeds it, each once."""
    left, seen = [(node, output, groups)], set()
    while left:
        node, output, groups = left.pop()
        key = (node.as_pointer(), output.identifier, *(item.as_pointer() for item in groups))
        if key in seen:
            continue
        seen.add(key)
        yield node, output, groups
        for socket in node.inputs:
            source = nodes.source_of(socket, groups)
            if source.node is not None:
                left.append((source.node, source.socket, source.groups))


def can_be_baked(node: Node, output: Socket, groups: Groups) -> bool:
    """Whether its value belongs to the place on the surface alone."""
    if output.type == "SHADER":
        return False
    return not any(_hinders(item, end) for item, end, _ in upstream(node, output, groups))


def _hinders(node: Node, output: Socket) -> bool:
    kind = node.bl_idname
    if kind in NOT_BAKED or (kind, output.identifier) in _OUTPUTS_OF_VIEW:
        return True
    if kind == "ShaderNodeWireframe":
        return bool(node.use_pixel_size)
    return is_magenta(node)


def is_magenta(node: Node) -> bool:
    """Whether it is an image that is missing, in whose place Cycles shows magenta."""
    if node.bl_idname not in {"ShaderNodeTexImage", "ShaderNodeTexEnvironment"}:
        return False
    image = node.image
    return image is None or (image.source == "FILE" and image_is_gone(image))


def image_is_gone(image: bpy.types.Image) -> bool:
    """Whether the file of an image is not there."""
    path = bpy.path.abspath(image.filepath, library=image.library)
    return not image.packed_file and not Path(path).is_file()


def is_of_instance(node: Node, output: Socket, groups: Groups) -> bool:
    """Whether instances of one object have different values."""
    return any(item.bl_idname in _OF_INSTANCE for item, _, _ in upstream(node, output, groups))


def sees_others(node: Node, output: Socket, groups: Groups) -> bool:
    """Whether other objects of the scene count."""
    return any(
        item.bl_idname == "ShaderNodeAmbientOcclusion" and not item.only_local
        for item, _, _ in upstream(node, output, groups)
    )


def is_of_chance(node: Node, output: Socket, groups: Groups) -> bool:
    """Whether Cycles finds it by random rays."""
    kinds = {"ShaderNodeAmbientOcclusion", "ShaderNodeBevel"}
    return any(item.bl_idname in kinds for item, _, _ in upstream(node, output, groups))


def fingerprint(node: Node, output: Socket, groups: Groups) -> str:
    """Of every setting that the value depends on; changes with any of them."""
    found = hashlib.sha256()
    numbers: dict[tuple[int, ...], int] = {}

    def number(item: Node, within: Groups) -> int:
        key = (item.as_pointer(), *(group.as_pointer() for group in within))
        return numbers.setdefault(key, len(numbers))

    for item, end, within in upstream(node, output, groups):
        found.update(f"{number(item, within)} {item.bl_idname} {end.identifier}\n".encode())
        found.update(repr(settings_of(item)).encode())
        for socket in item.inputs:
            source = nodes.source_of(socket, within)
            value: BpyStruct = nodes.constant(source)
            if value is None and source.node is not None:
                value = (number(source.node, source.groups), source.socket.identifier)
            found.update(f"{socket.identifier} {value} {source.kinds}\n".encode())
    return found.hexdigest()
