# SPDX-License-Identifier: GPL-3.0-or-later
"""What the list calls a parameter: as the node of this Blender labels its input."""

from __future__ import annotations

import bpy

from ... import parameters
from ...fit.field_kinds import NODE_IMAGE, Family, field_kind, kind_of
from ...parameters import Parameter
from ...scene_read import hosts
from ..texts import shown, translated

_UNITS = {"1": "", "scale": ""}


def label_of(row: bpy.types.PropertyGroup) -> str:
    """ "Transmission Weight" in Blender 4, "Transmission" in 3; in the interface's language."""
    if kind_of(row.parameter) is not None:
        kind = field_kind(row.parameter)
        if row.kind == "world":
            return f"{translated('World')}: {translated('Image')}"
        if kind.label:
            return translated(kind.label)
        if kind.family is Family.NODE_IMAGE:
            return f"{row.parameter.removesuffix(NODE_IMAGE)}: {translated('Image')}"
        if kind.is_image:
            input_of = socket_name(parameters.table()["material", kind.use])
            return f"{translated(input_of)}: {translated('Image')}"
        return f"{translated(kind.use.title())}: {translated('Grid')}"
    parameter = parameters.table().get((row.kind, row.parameter))
    return (
        constant_label(row.parameter) if parameter is None else translated(socket_name(parameter))
    )


def constant_label(name: str) -> str:
    """Of a constant of a node graph, "Mix.Factor" -> "Mix: Factor", "Ramp.color[1]" -> "Ramp: Color
    [1]": the node by its own name, the input in the interface's language."""
    node, _, socket = name.rpartition(".")
    title, bracket, number = socket.partition("[")
    title = "Color" if title == "color" else title
    return f"{node}: {translated(title)}" + (f" [{number}" if bracket else "")


def socket_name(parameter: Parameter) -> str:
    """Of the input that holds it in this Blender, in English; in words where it has none."""
    if not parameter.sockets:
        return parameter.label
    return parameter.sockets[-1 if hosts.is_version_3() else 0]


def with_labels(text: str, rows: bpy.types.bpy_prop_collection) -> str:
    """A text whose parameters have the names of the command line, "Body:base_color", with what the
    list calls them: "Body: Base Color"."""
    labels = {
        parameters.join_name(row.owner, row.parameter): f"{row.owner}: {row.label}" for row in rows
    }
    for name in sorted(labels, key=len, reverse=True):  # one may be the begin of another
        text = text.replace(name, labels[name])
    return text


def unit_text(unit: str) -> str:
    """ " W" to put behind a number; "" of a ratio."""
    shown = _UNITS.get(unit, unit)
    return f" {shown}" if shown else ""


def tip_of(row: bpy.types.PropertyGroup) -> str:
    """Tooltip: what it is, its unit, its name on the command line, and why it is locked."""
    lines = [label_of(row)]  # the list may cut it
    lines += [shown(row.help)] if row.help else []
    if row.note:
        lines.append(shown(row.note))
    if row.unit not in ("", "1"):
        lines.append(translated("Unit: {}").format(row.unit))
    lines.append(
        translated("Command line: {}").format(parameters.join_name(row.owner, row.parameter))
    )
    if row.reason:
        lines.append(translated("Locked: {}").format(shown(row.reason)))
    return "\n".join(lines)
