# SPDX-License-Identifier: GPL-3.0-or-later
"""The controls of a capture as Blender keeps and draws them; `capture.request` declares them."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from ...capture.panel_controls import PARTS, Control
from ...capture.request import PROPERTIES
from ...scene_read import hosts
from ..texts import field


def properties_of_group(group: str) -> dict[str, object]:
    """Annotations of the group of a row with that name; "" for the row itself."""
    parts = (part for part, name in PARTS.items() if name == group)
    return {item.name: _property(item) for part in parts for item in _controls(part)}


def draw_part(layout: bpy.types.UILayout, group: bpy.types.PropertyGroup, part: str) -> None:
    """A part of the panel; what is switched off shows its switch alone."""
    column = layout.column()
    for item in _controls(part):
        if item.greys:
            row = column.row(align=True)
            row.enabled = item.counts(group)
            row.prop(group, item.name)
        elif item.counts(group):
            field(column, group, item.name)


def _controls(part: str) -> Iterator[Control]:
    for item in PROPERTIES:
        if item.panel is not None and item.panel.part == part:
            yield from item.controls()


def _is_lamp(_group: bpy.types.PropertyGroup, item: bpy.types.Object) -> bool:
    return item.type == "LIGHT"


def _property(item: Control) -> object:
    words = {"name": item.label, "description": item.help, **item.keywords}
    if item.kind == "Path":
        words |= {"subtype": "FILE_PATH", "options": hosts.path_options()}
        return bpy.props.StringProperty(**words)
    if item.kind == "Lamp":
        return bpy.props.PointerProperty(type=bpy.types.Object, poll=_is_lamp, **words)
    if item.kind == "Collection":
        return bpy.props.PointerProperty(type=bpy.types.Collection, **words)
    return getattr(bpy.props, f"{item.kind}Property")(**words)
