# SPDX-License-Identifier: GPL-3.0-or-later
"""The world: a Background node with a constant colour or an Environment Texture."""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy
import numpy as np

from ... import parameters
from ...problems import Problem
from ..values import Owner, WorldValues
from . import images, nodes
from .coordinates import read_coordinates
from .nodes import Groups, Source, Unreadable

WORLD = "World"  # the owner's name, whatever the datablock is called
#: Of its image among what can be fixed.
ENVIRONMENT = "environment"
ROTATION = "rotation"
_FORWARD = ("POINT", "VECTOR")
_CURE = "use a Background node with a colour or an equirectangular Environment Texture"


def read_world(
    world: bpy.types.World | None,
) -> tuple[WorldValues, Owner | None, list[Problem], list[str]]:
    """Values, owner, problems, warnings. Without a world the background is black."""
    if world is None:
        return WorldValues(), None, [], []
    title = f"World '{world.name}'"
    library = world.library.filepath if world.library is not None else ""
    owner = Owner(WORLD, "world", world.name, library, {}, {})
    warnings: list[str] = []
    try:
        values = _read(world, title, warnings)
    except Unreadable as error:
        owner.fixed.update({row.name: error.problem.cause for row in parameters.of("world")})
        return WorldValues(), owner, [error.problem], warnings
    problems = []
    for parameter in parameters.of("world"):
        value = {
            "strength": (values.strength,),
            "color": values.color,
            ROTATION: (values.rotation,),
        }[parameter.name]
        complaint = parameter.complaint(value)
        if complaint:
            cure = "set a value inside the range"
            problems.append(Problem(title, f"{parameter.name}: {complaint}", cure))
        owner.values[parameter.name] = value
        of_rotation = parameter.name == ROTATION
        reason = find_rotation(world)[1] if of_rotation else find_source(world, parameter)[1]
        if reason:
            owner.fixed[parameter.name] = reason
    if reason := find_inlet(world)[1]:
        owner.fixed[ENVIRONMENT] = reason
    return values, owner, problems, warnings


def find_source(
    world: bpy.types.World, parameter: parameters.Parameter
) -> tuple[Source | None, str]:
    """Where strength or colour of the world sits, and why it cannot be written ("" if it can)."""
    background, reason = _found_background(world)
    if background is None:
        return None, reason
    socket = parameter.find(background.node)
    source = nodes.source_of(socket, background.groups)
    return source, nodes.why_not_writable(source, world)


def find_inlet(world: bpy.types.World) -> tuple[bpy.types.NodeSocket | None, str]:
    """The Color of the Background, to which an image can be linked, and why none can ("" if one
    can)."""
    background, reason = _found_background(world)
    if background is None:
        return None, reason
    socket = background.node.inputs["Color"]
    return socket, nodes.why_tree_fixed(socket.id_data, background.groups, world)


@dataclass(frozen=True)
class RotationPlace:
    """Where the rotation of the world's image about Z sits. inlet: the Vector of its Environment
    Texture. socket: the Rotation of the Mapping before it; None: that of a new one, which has to
    be put in between."""

    inlet: bpy.types.NodeSocket
    socket: bpy.types.NodeSocket | None

    @property
    def angle(self) -> float:
        """Radians from -pi to pi."""
        if self.socket is None:
            return 0.0
        return math.remainder(float(self.socket.default_value[2]), 2 * math.pi)


def find_rotation(world: bpy.types.World) -> tuple[RotationPlace | None, str]:
    """Where the image's rotation can be written, and why it cannot ("" if it can)."""
    socket, reason = find_inlet(world)
    if socket is None or reason:
        return None, reason
    source = nodes.source_of(socket)
    texture = source.node
    if not isinstance(texture, bpy.types.ShaderNodeTexEnvironment):
        return None, "the world has no image: give it an Environment Texture with a panorama"
    if reason := nodes.why_tree_fixed(texture.id_data, source.groups, world):
        return None, reason
    inlet = texture.inputs["Vector"]
    before = nodes.source_of(inlet, source.groups)
    mapping = before.node
    # Of these types the rotation about Z comes last.
    if isinstance(mapping, bpy.types.ShaderNodeMapping) and mapping.vector_type in _FORWARD:
        rotation = nodes.source_of(mapping.inputs["Rotation"], before.groups)
        plain = rotation.node is None and rotation.socket == mapping.inputs["Rotation"]
        if plain and not before.conversion and not nodes.why_not_writable(rotation, world):
            return RotationPlace(inlet, rotation.socket), ""
    return RotationPlace(inlet, None), ""


def _found_background(world: bpy.types.World) -> tuple[Source | None, str]:
    """The Background node; None where there is none, and why."""
    if not world.use_nodes or world.node_tree is None:
        return None, "the world does not use nodes: switch on Use Nodes"
    try:
        return _background(world, f"World '{world.name}'"), ""
    except Unreadable as error:
        return None, error.problem.cause


def _read(world: bpy.types.World, title: str, warnings: list[str]) -> WorldValues:
    if not world.use_nodes or world.node_tree is None:
        return WorldValues(tuple(world.color), 1.0)
    background = _background(world, title)
    inputs, groups = background.node.inputs, background.groups
    strength = nodes.constant(nodes.source_of(inputs["Strength"], groups))
    if strength is None:
        cause = "the Strength of its Background node is linked to what varies"
        raise Unreadable(title, cause, "unlink it")
    source = nodes.source_of(inputs["Color"], groups)
    color = nodes.constant(source)
    if color is not None:
        return WorldValues(color, strength[0])
    node = source.node
    if (
        not isinstance(node, bpy.types.ShaderNodeTexEnvironment)
        or source.socket.identifier != "Color"
    ):
        cause = f"its colour comes from {nodes.describe(node)}, output '{source.socket.name}'"
        raise Unreadable(title, cause, _CURE)
    if source.conversion:
        cause = f"its Environment Texture passes {source.conversion}, which makes it grey"
        raise Unreadable(
            title, cause, "link its Color to the Background through sockets of colours"
        )
    return WorldValues(
        (1.0, 1.0, 1.0),
        strength[0],
        _environment_image(node, title, warnings),
        _to_map(node, source.groups, title),
        place.angle if (place := find_rotation(world)[0]) is not None else 0.0,
    )


def _background(world: bpy.types.World, title: str) -> Source:
    output = world.node_tree.get_output_node("CYCLES")
    if output is None:
        raise Unreadable(title, "it has no World Output node", _CURE)
    if nodes.source_of(output.inputs["Volume"]).node is not None:
        raise Unreadable(title, "it is filled with a volume", "unlink the Volume of its output")
    source = nodes.source_of(output.inputs["Surface"])
    if source.node is None:
        raise Unreadable(title, "nothing is linked to the Surface of its output", _CURE)
    if source.node.bl_idname != "ShaderNodeBackground":
        raise Unreadable(title, f"its surface is {nodes.describe(source.node)}", _CURE)
    return source


def _environment_image(
    node: bpy.types.ShaderNodeTexEnvironment, title: str, warnings: list[str]
) -> np.ndarray:
    """(h, w, 3) float32, linear, row 0 at the top; also for packed and generated images."""
    image = node.image
    if image is None:
        raise Unreadable(title, "its Environment Texture has no image", "choose an image")
    title = f"Image '{image.name}'"
    if node.projection != "EQUIRECTANGULAR":
        raise Unreadable(title, "it is a mirror ball", "use an equirectangular image")
    pixels = images.read_pixels(image)
    if pixels.encoded:
        warnings.append(f"{title}: sRGB environment, decoded before it is interpolated")
    if node.interpolation != "Linear":
        warnings.append(f"{title}: interpolated linearly, not by {node.interpolation}")
    color = np.ascontiguousarray(pixels.decoded(), np.float32)
    if not np.isfinite(color).all():
        raise Unreadable(title, "its pixels are infinite once they are decoded", "repair the image")
    return color


def _to_map(node: bpy.types.ShaderNodeTexEnvironment, groups: Groups, title: str) -> np.ndarray:
    """(3, 3): direction in the image's frame = matrix @ direction in the world."""
    coordinates = read_coordinates(node, groups, title)
    if coordinates.kind != "direction":
        cause = "its image is looked up in one direction only"
        cure = "link the Generated output of Texture Coordinate to the Mapping"
        raise Unreadable(title, cause, cure)
    turn = coordinates.matrix[:, :3]
    scale = np.cbrt(np.linalg.det(turn))  # only the direction counts
    if (
        scale <= 0
        or coordinates.matrix[:, 3].any()
        or not np.allclose(turn @ turn.T, scale**2 * np.eye(3), rtol=0, atol=1e-5 * scale**2)
    ):
        cause = "its Mapping moves, mirrors or stretches the image"
        raise Unreadable(title, cause, "set Location to 0 and Scale to 1")
    return turn / scale
