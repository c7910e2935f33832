# SPDX-License-Identifier: GPL-3.0-or-later
"""Homogeneous media: volume nodes -> extinction, albedo, anisotropy, and back.

Units are 1 / Blender unit; an object's scale does not change them. docs/guide/volumes.md
has what Cycles takes from each node, and the inverse.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import bpy

from ...parameters import Parameter, Values
from ...problems import Reason
from . import nodes
from .nodes import Groups, Source, Unreadable

PARAMETERS = ("extinction", "albedo", "anisotropy")
_CURE = "give it a constant value, or unlink the Volume of the Material Output"
_ZERO = (0.0, 0.0, 0.0)
_MIXTURES = {"ShaderNodeMixShader", "ShaderNodeAddShader"}
#: How the names of nodes begin that shade a surface alone.
_SURFACES = ("ShaderNodeBsdf", "ShaderNodeSubsurfaceScattering")


@dataclass(frozen=True)
class Coefficients:
    """sigma_s and sigma_a per channel; g of Henyey and Greenstein, None if nothing scatters."""

    scattering: Values
    absorption: Values
    g: float | None

    def values(self) -> dict[str, Values]:
        """By parameter name. An albedo that means nothing is left at 0.8."""
        extinction = tuple(s + a for s, a in zip(self.scattering, self.absorption, strict=True))
        albedo = tuple(
            s / t if t > 0 else 0.8 for s, t in zip(self.scattering, extinction, strict=True)
        )
        return {"extinction": extinction, "albedo": albedo, "anisotropy": (self.g or 0.0,)}


def has_medium(source: Source) -> bool:
    """Whether a node that is fed into Volume gives one: Cycles passes over shaders of surfaces."""
    node = source.node
    if node is None:
        return source.socket.type != "SHADER"
    if node.bl_idname in _MIXTURES:
        shaders = [item for item in node.inputs if item.type == "SHADER"]
        return any(has_medium(nodes.source_of(item, source.groups)) for item in shaders)
    return not node.bl_idname.startswith(_SURFACES)


def read(source: Source, title: str) -> dict[str, Values]:
    """The medium that a node fed into Volume stands for. Raises Unreadable."""
    return _coefficients(source, title).values()


def _coefficients(source: Source, title: str) -> Coefficients:
    node = source.node
    reader = _READERS.get(node.bl_idname) if node is not None else None
    if node is None or reader is None:
        socket = source.socket
        what = nodes.describe(node) if node is not None else f"the value of socket '{socket.name}'"
        raise Unreadable(
            title,
            f"its Volume is {what}, which this version does not render",
            "use Principled Volume, Volume Absorption, Volume Scatter or Volume Coefficients",
        )
    return reader(node, source.groups, title)


def _number(node: bpy.types.Node, name: str, groups: Groups, title: str) -> Values:
    if name not in node.inputs:
        return (0.0,)
    value = nodes.constant(nodes.source_of(node.inputs[name], groups))
    if value is None:
        cause = f"input '{name}' of {nodes.describe(node)} varies, which cannot be rendered"
        raise Unreadable(title, cause, _CURE)
    return value


def _colour(node: bpy.types.Node, name: str, groups: Groups, title: str) -> Values:
    return nodes.broadcast(_number(node, name, groups, title), 3)


def _no_emission(node: bpy.types.Node, names: tuple[str, ...], groups: Groups, title: str) -> None:
    for name in names:
        if any(_number(node, name, groups, title)):
            raise Unreadable(
                title,
                f"{nodes.describe(node)} emits light, which this version does not render",
                f"set '{name}' to 0",
            )


def _phase(node: bpy.types.Node, groups: Groups, title: str) -> float:
    phase = getattr(node, "phase", "HENYEY_GREENSTEIN")
    if phase != "HENYEY_GREENSTEIN":
        raise Unreadable(
            title,
            f"the phase function {phase.replace('_', ' ').title()} of {nodes.describe(node)} "
            "is not rendered",
            "choose Henyey-Greenstein",
        )
    return _number(node, "Anisotropy", groups, title)[0]


def _principled(node: bpy.types.Node, groups: Groups, title: str) -> Coefficients:
    _no_emission(node, ("Emission Strength", "Blackbody Intensity"), groups, title)
    density = max(_number(node, "Density", groups, title)[0], 0.0)
    colour = _colour(node, "Color", groups, title)
    absorbed = _colour(node, "Absorption Color", groups, title)
    return Coefficients(
        tuple(density * max(c, 0.0) for c in colour),
        tuple(
            density * max(1 - c, 0.0) * max(1 - math.sqrt(max(a, 0.0)), 0.0)
            for c, a in zip(colour, absorbed, strict=True)
        ),
        _phase(node, groups, title),
    )


def _absorption(node: bpy.types.Node, groups: Groups, title: str) -> Coefficients:
    density = max(_number(node, "Density", groups, title)[0], 0.0)
    colour = _colour(node, "Color", groups, title)
    return Coefficients(_ZERO, tuple(density * max(1 - c, 0.0) for c in colour), None)


def _scatter(node: bpy.types.Node, groups: Groups, title: str) -> Coefficients:
    density = max(_number(node, "Density", groups, title)[0], 0.0)
    colour = _colour(node, "Color", groups, title)
    return Coefficients(
        tuple(density * max(c, 0.0) for c in colour), _ZERO, _phase(node, groups, title)
    )


def _direct(node: bpy.types.Node, groups: Groups, title: str) -> Coefficients:
    _no_emission(node, ("Emission Coefficients",), groups, title)
    return Coefficients(
        tuple(max(c, 0.0) for c in _colour(node, "Scatter Coefficients", groups, title)),
        tuple(max(c, 0.0) for c in _colour(node, "Absorption Coefficients", groups, title)),
        _phase(node, groups, title),
    )


def _sum(node: bpy.types.Node, groups: Groups, title: str) -> Coefficients:
    sources = [nodes.source_of(item, groups) for item in node.inputs]
    parts = [_coefficients(source, title) for source in sources if source.node is not None]
    lobes = {part.g for part in parts if part.g is not None and any(part.scattering)}
    if len(lobes) > 1:
        raise Unreadable(
            title,
            f"{nodes.describe(node)} adds media of different anisotropy, which is not rendered",
            "give both the same",
        )
    return Coefficients(
        tuple(sum(c) for c in zip(*(part.scattering for part in parts), strict=True)) or _ZERO,
        tuple(sum(c) for c in zip(*(part.absorption for part in parts), strict=True)) or _ZERO,
        next(iter(lobes), None),
    )


_READERS: dict[str, Callable[[bpy.types.Node, Groups, str], Coefficients]] = {
    "ShaderNodeVolumePrincipled": _principled,
    "ShaderNodeVolumeAbsorption": _absorption,
    "ShaderNodeVolumeScatter": _scatter,
    "ShaderNodeVolumeCoefficients": _direct,
    "ShaderNodeAddShader": _sum,
}


def find_node(material: bpy.types.Material) -> tuple[Source | None, Reason]:
    """The volume node that can hold any medium, and why there is none ("" if there is)."""
    output = nodes.output_of(material.node_tree)
    if output is None:
        return None, Reason("the material has no Material Output node for Cycles")
    source = output.source("Volume")
    if source.node is None:
        return None, Reason(
            "there is no medium", "link a Principled Volume to the Volume of the output"
        )
    if source.node.bl_idname not in _SOCKETS:
        return None, (
            Reason(
                f"{nodes.describe(source.node)} cannot hold every medium", "use a Principled Volume"
            )
        )
    for name in _SOCKETS[source.node.bl_idname]:
        reason = nodes.why_not_writable(
            nodes.source_of(source.node.inputs[name], source.groups), material
        )
        if reason:
            return None, reason.after(f"input '{name}' is ")
    return source, Reason()


_SOCKETS = {
    "ShaderNodeVolumePrincipled": ("Color", "Density", "Absorption Color", "Anisotropy"),
    "ShaderNodeVolumeCoefficients": (
        "Scatter Coefficients",
        "Absorption Coefficients",
        "Anisotropy",
    ),
}


def write(source: Source, parameter: Parameter, value: Values) -> None:
    """Puts one parameter into the node and keeps the other two; see `find_node`."""
    node = source.node
    medium = read(source, "") | {parameter.name: value}
    scattering = tuple(t * a for t, a in zip(medium["extinction"], medium["albedo"], strict=True))
    absorption = tuple(
        t * (1 - a) for t, a in zip(medium["extinction"], medium["albedo"], strict=True)
    )

    def put(name: str, numbers: Values) -> None:
        socket = nodes.source_of(node.inputs[name], source.groups).socket
        if len(numbers) == 1:
            socket.default_value = numbers[0]
        else:
            socket.default_value[:3] = numbers

    put("Anisotropy", medium["anisotropy"])
    if node.bl_idname == "ShaderNodeVolumeCoefficients":
        put("Scatter Coefficients", scattering)
        put("Absorption Coefficients", absorption)
        return
    # The smallest density that leaves room for every channel's absorption.
    density = max(medium["extinction"])
    colour = tuple(s / density if density > 0 else 0.0 for s in scattering)
    put("Density", (density,))
    put("Color", colour)
    put(
        "Absorption Color",
        tuple(
            (1 - min(a / (density * (1 - c)), 1.0)) ** 2 if density * (1 - c) > 0 else 1.0
            for a, c in zip(absorption, colour, strict=True)
        ),
    )
