# SPDX-License-Identifier: GPL-3.0-or-later
"""What a row of the panel says of its photo, and a row that says what a request does."""

from __future__ import annotations

import bpy

from .capture_property import CaptureProperty
from .panel_controls import LEFT_OUT, PARTS
from .request import PROPERTIES, CaptureRequest


def values_of_row(row: bpy.types.PropertyGroup) -> dict[str, object]:
    """Fields of a CaptureRequest, but for camera and photo; what is switched off is left out."""
    found = {}
    for item in PROPERTIES:
        if item.panel is not None:
            found[item.name] = item.panel.read(_group(row, item), bpy.path.abspath)
    return {name: value for name, value in found.items() if value is not LEFT_OUT}


def write_row(row: bpy.types.PropertyGroup, request: CaptureRequest) -> None:
    """The inverse, into a row that was just added. Where lamps stood has no place in a row."""
    for item in PROPERTIES:
        if item.panel is not None and not request.leaves_out(item):
            item.panel.write(_group(row, item), getattr(request, item.name))


def _group(row: bpy.types.PropertyGroup, item: CaptureProperty) -> bpy.types.PropertyGroup:
    name = PARTS[item.panel.part] if item.panel is not None else ""
    return getattr(row, name) if name else row
