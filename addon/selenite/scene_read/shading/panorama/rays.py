# SPDX-License-Identifier: GPL-3.0-or-later
"""What a world's Light Path nodes tell apart, and which shader a ray sees of a mixture."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import bpy

from .. import nodes
from ..nodes import Output, Source, Unreadable

_LIGHT_PATH = "ShaderNodeLightPath"
_SHADERS = {"ShaderNodeBackground", "ShaderNodeEmission"}
_CAMERA_DEPENDENT = {"Window", "Camera"}
#: Nodes by which Cycles knows that a world varies with the direction, apart from textures.
_SPATIAL = {
    "ShaderNodeNewGeometry",
    "ShaderNodeUVMap",
    "ShaderNodeAttribute",
    "ShaderNodeVertexColor",
    "ShaderNodeWireframe",
}
#: Of a Math node, what two numbers give.
_MATH: dict[str, Callable[[float, float], float]] = {
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
    "MULTIPLY": lambda a, b: a * b,
    "MAXIMUM": max,
    "MINIMUM": min,
    "GREATER_THAN": lambda a, b: float(a > b),
    "LESS_THAN": lambda a, b: float(a < b),
}


@dataclass(frozen=True)
class Rays:
    """Rays to which a background may be a special one.

    kinds: as the native scene has them. name: for messages. outputs: of Light Path, that are 1 to
    them; all others are 0.
    """

    name: str
    kinds: tuple[str, ...]
    outputs: frozenset[str]


#: Light samples are of no kind to Cycles.
LIGHT = Rays("light samples", (), frozenset())
OTHERS = (
    Rays("camera rays", ("camera",), frozenset({"Is Camera Ray"})),
    Rays("diffuse rays", ("diffuse",), frozenset({"Is Diffuse Ray", "Is Reflection Ray"})),
    Rays("glossy rays", ("glossy",), frozenset({"Is Glossy Ray", "Is Reflection Ray"})),
    Rays(
        "diffusely transmitted rays",
        ("transmission", "diffuse"),
        frozenset({"Is Diffuse Ray", "Is Transmission Ray"}),
    ),
    Rays(
        "transmitted rays",
        ("transmission", "glossy"),
        frozenset({"Is Glossy Ray", "Is Transmission Ray"}),
    ),
    Rays("rays scattered in a volume", ("volume_scatter",), frozenset({"Is Volume Scatter Ray"})),
)
#: The world is asked by no shadow ray.
_KNOWN = frozenset({"Is Shadow Ray"}).union(*(rays.outputs for rays in OTHERS))


def reached(start: Source, rays: Rays | None = None) -> Iterator[Source]:
    """The nodes on which a value depends, as these rays see it: without the shaders that a mixture
    hides from them. Each output of a node comes once."""
    seen = set()
    waiting = [start]
    while waiting:
        source = waiting.pop()
        node = source.node
        if node is None:
            continue
        names = tuple(group.name for group in source.groups)
        key = (names, node.id_data.name, node.name, source.socket.identifier)
        if key in seen:
            continue
        seen.add(key)
        yield source
        hidden = _hidden(source, rays)
        waiting += [
            nodes.source_of(item, source.groups)
            for item in node.inputs
            if item.enabled and not item.is_unavailable and item != hidden
        ]


def used_outputs(output: Output, title: str) -> frozenset[str]:
    """The outputs of Light Path that distinguish rays. Raises Unreadable where one needs more than
    the kinds of rays."""
    found = set()
    for source in reached(output.source("Surface")):
        if source.node.bl_idname != _LIGHT_PATH:
            continue
        name = source.socket.identifier
        if name not in _KNOWN:
            cause = f"it depends on {nodes.describe(source.node)}, output '{source.socket.name}'"
            raise Unreadable(title, cause, "use an output that distinguishes kinds of rays")
        found.add(name)
    return frozenset(found - {"Is Shadow Ray"})


def require_direction_only(output: Output, rays: Rays, title: str) -> None:
    """Raises Unreadable where what the rays see depends on more than their direction."""
    for source in reached(output.source("Surface"), rays):
        node, name = source.node, source.socket.name
        kind = node.bl_idname
        if (
            (kind == "ShaderNodeTexCoord" and source.socket.identifier in _CAMERA_DEPENDENT)
            or kind == "ShaderNodeCameraData"
            or (
                kind == "ShaderNodeVectorTransform"
                and "CAMERA" in {node.convert_from, node.convert_to}
            )
        ):
            cause = f"it depends on the camera by {nodes.describe(node)}, output '{name}'"
            cure = "link the Generated output of Texture Coordinate in its place"
            raise Unreadable(title, cause, cure)


def is_spatial(output: Output) -> bool:
    """Whether Cycles takes the world for one that varies with the direction."""
    return any(
        source.node.bl_idname.startswith("ShaderNodeTex") or source.node.bl_idname in _SPATIAL
        for source in reached(output.source("Surface"))
    )


def surface_of(output: Output, rays: Rays) -> Source:
    """The shader that these rays see: through mixtures that show them one side only."""
    source = output.source("Surface")
    while source.node is not None and source.node.bl_idname == "ShaderNodeMixShader":
        hidden = _hidden(source, rays)
        if hidden is None:
            break
        shown = next(item for item in source.node.inputs[1:3] if item != hidden)
        source = nodes.source_of(shown, source.groups)
    return source


def is_background(source: Source) -> bool:
    """A shader whose Color times Strength is all that the world emits."""
    return source.node is not None and source.node.bl_idname in _SHADERS


def is_light_path(node: bpy.types.Node) -> bool:
    """Whether its outputs depend on the ray."""
    return node.bl_idname == _LIGHT_PATH and not node.mute


def _hidden(source: Source, rays: Rays | None) -> bpy.types.NodeSocket | None:
    """The input of a Mix Shader that the rays do not see; None: they see both, or it is another
    node."""
    node = source.node
    if rays is None or node is None or node.bl_idname != "ShaderNodeMixShader":
        return None
    factor = _number(nodes.source_of(node.inputs[0], source.groups), rays)
    if factor is None or 0 < factor < 1:
        return None
    return node.inputs[2] if factor <= 0 else node.inputs[1]


def _number(source: Source, rays: Rays) -> float | None:
    """The number that arrives, as the rays see it; None if it varies or is not known."""
    value = nodes.constant(source)
    if value is not None:
        return value[0] if len(value) == 1 else None
    node = source.node
    if node is None or source.conversion or source.socket.type != "VALUE":
        return None
    if node.bl_idname == _LIGHT_PATH:
        return float(source.socket.identifier in rays.outputs)
    if node.bl_idname != "ShaderNodeMath" or node.operation not in _MATH:
        return None
    numbers = [_number(nodes.source_of(node.inputs[i], source.groups), rays) for i in (0, 1)]
    if numbers[0] is None or numbers[1] is None:
        return None
    result = float(_MATH[node.operation](numbers[0], numbers[1]))
    return min(max(result, 0.0), 1.0) if node.use_clamp else result
