# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps in Blender's units: power in watts (sun: irradiance), colour, shape."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from ... import parameters
from ...messages import thing
from ...problems import Problem, Reason
from .. import hosts
from ..shading import nodes
from ..shading.graph.constants import fold
from ..values import LightValues, Owner
from . import places as lamp_places

_EMISSION = ("Color", "Strength")

#: Where numbers of 32 bits end when they are squared.
_FARTHEST = 1e18


def read_light(
    light: bpy.types.Light, matrix: np.ndarray, name: str
) -> tuple[LightValues, Owner, list[Problem], list[Problem]]:
    """Reads an original lamp standing at `matrix` (4, 4): values, owner, problems, and those of a
    lamp that can be rendered nevertheless, in another way than by Cycles."""
    title = thing("Light", light.name)
    library = light.library.filepath if light.library is not None else ""
    scale = hosts.light_scale(light)
    shape = _shape(light)
    normalized = hosts.light_is_normalized(light)
    if not normalized:
        scale *= lamp_places.area_of(light.type, shape, matrix)
    color: parameters.Values = tuple(light.color)
    temperature = hosts.temperature_color(light)
    if temperature is not None:
        color = tuple(a * b for a, b in zip(color, temperature, strict=True))
    values = LightValues(
        name, light.type, matrix, light.energy, color, scale, hosts.light_units(), shape,
        normalized=normalized,
    )  # fmt: skip
    problems: list[Problem] = []
    otherwise: list[Problem] = []
    if light.use_nodes and light.node_tree is not None:
        values, otherwise = _through_nodes(light, values, title)
    if trouble := lamp_places.flattened(matrix):
        problems.append(Problem(title, *trouble))
    elif trouble := lamp_places.trouble_of(light.type, values.light_units, matrix):
        otherwise.append(Problem(title, *trouble))
    if light.type != "SUN" and np.abs(matrix[:3, 3]).max() > _FARTHEST:
        problems.append(Problem(title, "it stands infinitely far away", "move it, or use a sun"))
    owner = Owner(name, "light", light.name, library, {}, {})
    for parameter in parameters.of("light"):
        value = {"power": (values.power,), "color": values.color}[parameter.name]
        complaint = parameter.complaint(value)
        if complaint:
            cure = "set a value inside the range"
            problems.append(Problem(title, f"{parameter.name}: {complaint}", cure))
        owner.values[parameter.name] = tuple(float(number) for number in value)
        reason = why_fixed(light, parameter.name)
        if reason:
            owner.fixed[parameter.name] = reason
    return values, owner, problems, otherwise


def is_portal(light: bpy.types.Light) -> bool:
    """Portals guide sampling and emit nothing."""
    return light.type == "AREA" and bool(getattr(light.cycles, "is_portal", False))


def is_line(light: bpy.types.Light) -> bool:
    """Whether a side of an area lamp is 0. Cycles 4.5 shows no light of it, and all of it at a side
    of 1e-6."""
    return light.type == "AREA" and min(_sides(light)) == 0


def why_fixed(light: bpy.types.Light, parameter: str) -> Reason:
    """Why `power` or `color` of a lamp cannot be written; empty if it can."""
    if light.library is not None:
        return Reason(f"linked from library '{light.library.filepath}'", "make it local")
    if not hosts.is_editable(light):
        return Reason("not editable", "make it local")
    if parameter == "color" and hosts.temperature_color(light) is not None:
        return Reason("the lamp uses a colour temperature", "switch it off")
    if parameter == "color" and light.use_nodes:
        return Reason("the lamp uses nodes", "switch them off")
    return nodes.why_animated(light, "energy" if parameter == "power" else "color")


def _shape(light: bpy.types.Light) -> dict[str, float | bool | str]:
    if light.type == "SUN":
        return {"angle": light.angle}
    if light.type == "AREA":
        size_x, size_y = _sides(light)
        return {
            "shape": light.shape,
            "size_x": size_x,
            "size_y": size_y,
            "spread": light.spread,
        }
    shape = {"radius": light.shadow_soft_size, "soft_falloff": hosts.soft_falloff(light)}
    if light.type == "SPOT":
        shape |= {"size": light.spot_size, "blend": light.spot_blend}
    return shape


def _sides(light: bpy.types.Light) -> tuple[float, float]:
    """Width and height of an area lamp; squares and disks have one size for both."""
    return light.size, light.size_y if light.shape in {"RECTANGLE", "ELLIPSE"} else light.size


def _through_nodes(
    light: bpy.types.Light, values: LightValues, title: str
) -> tuple[LightValues, list[Problem]]:
    """An Emission node whose inputs are constants, or are computed from them, multiplies the lamp;
    anything else is a problem."""
    cure = "switch off Use Nodes of the lamp or use one Emission node with constant inputs"
    output = nodes.output_of(light.node_tree)
    source = output.source("Surface") if output is not None else None
    if source is None or source.node is None:
        return values, [Problem(title, "its nodes have no output", cure)]
    if source.node.bl_idname != "ShaderNodeEmission":
        return values, [Problem(title, f"it is lit by {nodes.describe(source.node)}", cure)]
    inputs = [source.node.inputs[name] for name in _EMISSION]
    color, strength = (fold(socket, source.groups, title) for socket in inputs)
    if color is None or strength is None:
        name = _EMISSION[0 if color is None else 1]
        what = nodes.source_of(source.node.inputs[name], source.groups).node
        cause = f"the {name} of its Emission node is linked to {nodes.describe(what)}"
        return values, [Problem(title, cause, cure)]
    color = nodes.broadcast(color, 3)
    color = tuple(a * b for a, b in zip(values.color, color, strict=True))
    return replace(values, color=color, radiance_scale=values.radiance_scale * strength[0]), []
