# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a texture node looks its image up: the links of its Vector input as one affine map."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Euler

from ...parameters import Values
from ..shaders import STANDARD
from . import nodes
from .nodes import Groups, Source, Unreadable


@dataclass(frozen=True)
class Coordinates:
    """Coordinates `matrix @ (x, y, z, 1)`, matrix (3, 4).

    (x, y, z) is by `kind`: "uv": (u, v, 0) of the UV map `attribute` ("" for the one that renders),
    "direction": the direction of a ray into the world, "constant": irrelevant.
    """

    kind: str
    attribute: str
    matrix: np.ndarray


def read_coordinates(node: bpy.types.Node, groups: Groups, title: str) -> Coordinates:
    """What feeds the Vector of an image node. Raises Unreadable.

    A node that nothing is linked to looks up by the UV map that renders, or by direction in a
    world.
    """
    source = nodes.source_of(node.inputs["Vector"], groups)
    in_world = isinstance(node, bpy.types.ShaderNodeTexEnvironment)
    if source.node is None:  # also where it passes an input of a group that nothing is linked to
        return _plain("direction" if in_world else "uv")
    return _follow(source, in_world, title)


def _plain(kind: str, attribute: str = "") -> Coordinates:
    return Coordinates(kind, attribute, np.eye(3, 4))


def _follow(source: Source, in_world: bool, title: str) -> Coordinates:
    value = nodes.constant(source)
    if value is not None:  # a link to a group's input or to a node with a value
        matrix = np.zeros((3, 4))
        matrix[:, 3] = value
        return Coordinates("constant", "", matrix)
    node, output = source.node, source.socket.identifier
    assert node is not None  # noqa: S101 - an unlinked vector is a constant
    if source.conversion:
        cause = f"its image is placed by {nodes.describe(node)}, which passes {source.conversion}"
        raise Unreadable(title, cause, "link it through sockets of vectors")
    if isinstance(node, bpy.types.ShaderNodeMapping):
        inner = _follow_vector(node, source.groups, in_world, title)
        return Coordinates(
            inner.kind, inner.attribute, _mapped(node, source.groups, inner.matrix, title)
        )
    plain = _direction(node, output) if in_world else _uv(node, output, title)
    if plain is not None:
        return plain
    wanted = "the Generated output of Texture Coordinate" if in_world else "a UV Map node"
    cause = f"its image is placed by {nodes.describe(node)}, output '{source.socket.name}'"
    raise Unreadable(title, cause, f"use {wanted}, through Mapping nodes if need be")


def _follow_vector(
    node: bpy.types.ShaderNodeMapping, groups: Groups, in_world: bool, title: str
) -> Coordinates:
    return _follow(nodes.source_of(node.inputs["Vector"], groups), in_world, title)


def _uv(node: bpy.types.Node, output: str, title: str) -> Coordinates | None:
    if isinstance(node, bpy.types.ShaderNodeTexCoord) and output == "UV":
        _refuse_instancer(node.from_instancer, node, title)
        return _plain("uv")
    if isinstance(node, bpy.types.ShaderNodeUVMap):
        _refuse_instancer(node.from_instancer, node, title)
        return _plain("uv", node.uv_map)
    if (
        isinstance(node, bpy.types.ShaderNodeAttribute)
        and output == "Vector"
        and node.attribute_type == "GEOMETRY"
        and node.attribute_name
        and node.attribute_name not in STANDARD
    ):
        return _plain("uv", node.attribute_name)
    return None


def _refuse_instancer(used: bool, node: bpy.types.Node, title: str) -> None:
    if used:
        cause = f"{nodes.describe(node)} takes the coordinates of the instancer"
        raise Unreadable(title, cause, "switch off From Instancer")


def _direction(node: bpy.types.Node, output: str) -> Coordinates | None:
    if isinstance(node, bpy.types.ShaderNodeTexCoord):
        known = output == "Generated" or (output == "Object" and node.object is None)
    else:
        known = isinstance(node, bpy.types.ShaderNodeNewGeometry) and output == "Position"
    return _plain("direction") if known else None


def _mapped(
    node: bpy.types.ShaderNodeMapping, groups: Groups, inner: np.ndarray, title: str
) -> np.ndarray:
    """`inner` followed by a Mapping node: scale, turn, move; the type Texture undoes that."""
    kind = node.vector_type
    if kind == "NORMAL":
        cause = f"{nodes.describe(node)} is of type Normal"
        raise Unreadable(title, cause, "use type Point or Texture")

    def read(name: str) -> np.ndarray:
        socket: bpy.types.NodeSocket | None = node.inputs.get(name)
        assert socket is not None  # noqa: S101 - every Mapping node has all of them
        value: Values | None = nodes.constant(nodes.source_of(socket, groups))
        if value is None:
            cause = f"the {name} of {nodes.describe(node)} is linked to what varies"
            raise Unreadable(title, cause, "unlink it")
        return np.broadcast_to(np.array(value, np.float64), 3)

    turn = np.array(Euler(tuple(read("Rotation")), "XYZ").to_matrix(), np.float64)
    scale = read("Scale")
    outer = np.zeros((3, 4))
    if kind == "TEXTURE":
        # Cycles takes 0 for what is divided by a scale of 0.
        inverse = np.divide(1, scale, out=np.zeros(3), where=scale != 0)
        outer[:, :3] = inverse[:, None] * turn.T
        outer[:, 3] = -outer[:, :3] @ read("Location")
    else:
        outer[:, :3] = turn * scale
        if kind == "POINT":  # type Vector has no location
            outer[:, 3] = read("Location")
    return outer @ np.vstack([inner, (0, 0, 0, 1)])
