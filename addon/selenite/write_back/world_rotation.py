# SPDX-License-Identifier: GPL-3.0-or-later
"""The rotation of the world's image: the Z of a Mapping node before its Environment Texture."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

import bpy

from ..scene_read.shading import nodes, world

if TYPE_CHECKING:
    from ..scene_read.hosts import BpyStruct


def read(found: bpy.types.World) -> float:
    """Radians from -pi to pi; 0 where there is no such node."""
    place, _ = world.find_rotation(found)
    return 0.0 if place is None else place.angle


def write(found: bpy.types.World, angle: float) -> None:
    """Sets it, in a new Mapping where there is none. The caller has asked `world.find_rotation`."""
    place, _ = world.find_rotation(found)
    assert place is not None  # noqa: S101 - it has been asked for
    socket = place.socket
    if socket is None:
        if angle == 0:
            return
        socket = _new_mapping(place.inlet).inputs["Rotation"]
    cast("BpyStruct", socket).default_value[2] = angle


def _new_mapping(inlet: bpy.types.NodeSocket) -> bpy.types.ShaderNodeMapping:
    """Between the texture whose Vector `inlet` is and what has fed it."""
    tree, node = cast(bpy.types.NodeTree, inlet.id_data), inlet.node
    mapping = cast(bpy.types.ShaderNodeMapping, tree.nodes.new("ShaderNodeMapping"))
    mapping.vector_type, mapping.select, mapping.parent = "POINT", False, node.parent
    mapping.location = node.location[0] - 200, node.location[1] - 100
    before = nodes.link_of(inlet)
    if before is None:
        coordinates = tree.nodes.new("ShaderNodeTexCoord")
        coordinates.select, coordinates.parent = False, node.parent
        coordinates.location = mapping.location[0] - 200, mapping.location[1]
        start = coordinates.outputs["Generated"]
    else:
        start = before.from_socket
    tree.links.new(start, mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], inlet)
    return mapping
