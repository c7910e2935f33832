# SPDX-License-Identifier: GPL-3.0-or-later
"""The world: a Background node with a constant colour or an Environment Texture."""

from __future__ import annotations

from typing import Any, cast

import bpy
import numpy as np
from mathutils import Euler

from .. import parameters
from ..problems import Problem
from . import hosts, nodes
from .nodes import Source
from .values import Owner, WorldValues

WORLD = "World"  # the owner's name, whatever the datablock is called
_CURE = "use a Background node with a colour or an equirectangular Environment Texture"


class Unreadable(Exception):
    """Why a part of the world cannot be rendered, as a Problem."""

    def __init__(self, title: str, cause: str, cure: str = _CURE) -> None:
        super().__init__(cause)
        self.problem = Problem(title, cause, cure)


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
        value = {"strength": (values.strength,), "color": values.color}[parameter.name]
        complaint = parameter.complaint(value)
        if complaint:
            cure = "set a value inside the range"
            problems.append(Problem(title, f"{parameter.name}: {complaint}", cure))
        owner.values[parameter.name] = value
        _, reason = find_source(world, parameter)
        if reason:
            owner.fixed[parameter.name] = reason
    return values, owner, problems, warnings


def find_source(
    world: bpy.types.World, parameter: parameters.Parameter
) -> tuple[Source | None, str]:
    """Where strength or colour of the world sits, and why it cannot be written ("" if it can)."""
    if not world.use_nodes or world.node_tree is None:
        return None, "the world does not use nodes: switch on Use Nodes"
    try:
        background = _background(world, f"World '{world.name}'")
    except Unreadable as error:
        return None, error.problem.cause
    socket = parameter.find(background.node)
    source = nodes.source_of(socket, background.groups)
    return source, nodes.why_not_writable(source, world)


def _read(world: bpy.types.World, title: str, warnings: list[str]) -> WorldValues:
    if not world.use_nodes or world.node_tree is None:
        return WorldValues(tuple(world.color), 1.0)
    background = _background(world, title)
    inputs, groups = background.node.inputs, background.groups
    strength = nodes.constant(nodes.source_of(inputs["Strength"], groups))
    if strength is None:
        raise Unreadable(title, "the Strength of its Background node is linked to what varies")
    source = nodes.source_of(inputs["Color"], groups)
    color = nodes.constant(source)
    if color is not None:
        return WorldValues(color, strength[0])
    node = source.node
    if not isinstance(node, bpy.types.ShaderNodeTexEnvironment) or node.mute:
        raise Unreadable(title, f"its colour comes from {nodes.describe(node)}")
    return WorldValues(
        (1.0, 1.0, 1.0),
        strength[0],
        _environment_image(node, title, warnings),
        _rotation(nodes.source_of(node.inputs["Vector"], source.groups), title),
    )


def _background(world: bpy.types.World, title: str) -> Source:
    output = world.node_tree.get_output_node("CYCLES")
    if output is None:
        raise Unreadable(title, "it has no World Output node")
    if nodes.source_of(output.inputs["Volume"]).node is not None:
        raise Unreadable(title, "it is filled with a volume", "unlink the Volume of its output")
    source = nodes.source_of(output.inputs["Surface"])
    if source.node is None:
        raise Unreadable(title, "nothing is linked to the Surface of its output")
    if source.node.bl_idname != "ShaderNodeBackground" or source.node.mute:
        raise Unreadable(title, f"its surface is {nodes.describe(source.node)}")
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
    if image.source not in {"FILE", "GENERATED"}:
        raise Unreadable(title, f"its source is {image.source.lower()}", "use a single image")
    width, height = image.size
    stored = cast(Any, image.pixels)  # the stubs say one float; it is an array of all channels
    if width == 0 or height == 0 or len(stored) == 0:
        raise Unreadable(title, f"the file '{image.filepath}' cannot be read", "relink the file")
    pixels = np.empty(width * height * image.channels, np.float32)
    stored.foreach_get(pixels)
    pixels = pixels.reshape(height, width, image.channels)[::-1]
    pixels = pixels[..., :3] if image.channels >= 3 else np.repeat(pixels[..., :1], 3, axis=2)
    if not image.is_float and hosts.is_srgb(image):  # bytes come as stored, floats decoded
        pixels = _decoded(pixels)
        warnings.append(f"{title}: 8-bit environment, decoded before it is interpolated")
    elif not hosts.is_linear(image) and not (image.is_float and hosts.is_srgb(image)):
        name = image.colorspace_settings.name
        raise Unreadable(title, f"its colour space is {name}", "set it to Linear or sRGB")
    if not np.isfinite(pixels).all():
        raise Unreadable(title, "it contains NaN or infinite pixels", "repair the image")
    if node.interpolation != "Linear":
        warnings.append(f"{title}: interpolated linearly, not by {node.interpolation}")
    return np.ascontiguousarray(pixels, np.float32)


def _decoded(encoded: np.ndarray) -> np.ndarray:
    """sRGB code values to linear light."""
    low = encoded / 12.92
    high = ((np.maximum(encoded, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.where(encoded <= 0.04045, low, high).astype(np.float32)


def _rotation(source: Source, title: str) -> np.ndarray:
    """(3, 3): direction in the image's frame = matrix @ direction in the world."""
    node = source.node
    if node is None:
        return np.eye(3)
    if node.bl_idname == "ShaderNodeTexCoord" and source.socket.identifier in {
        "Generated",
        "Object",
    }:
        return np.eye(3)
    if node.bl_idname == "ShaderNodeNewGeometry" and source.socket.identifier == "Position":
        return np.eye(3)
    if node.bl_idname != "ShaderNodeMapping" or node.mute:
        raise Unreadable(title, f"its image is placed by {nodes.describe(node)}", "use Mapping")
    if node.vector_type == "NORMAL":
        raise Unreadable(title, "its Mapping is of type Normal", "use type Point")
    inner = _rotation(nodes.source_of(node.inputs["Vector"], source.groups), title)
    parts: dict[str, parameters.Values] = {}
    for name in ("Location", "Rotation", "Scale"):
        socket: bpy.types.NodeSocket | None = node.inputs.get(name)
        if socket is None or not socket.enabled:  # type Vector has no location
            parts[name] = (0.0, 0.0, 0.0)
            continue
        parts[name] = nodes.constant(nodes.source_of(socket, source.groups))
        if parts[name] is None:
            raise Unreadable(title, f"the {name} of its Mapping is linked", "unlink it")
    if any(parts["Location"]) or len(set(parts["Scale"])) != 1 or parts["Scale"][0] <= 0:
        cause = "its Mapping moves or stretches the image"
        raise Unreadable(title, cause, "set Location to 0 and Scale to 1")
    turn = np.array(Euler(parts["Rotation"], "XYZ").to_matrix(), np.float64)
    return (turn.T if node.vector_type == "TEXTURE" else turn) @ inner
