# SPDX-License-Identifier: GPL-3.0-or-later
"""The active parameter: always as high, so that nothing below moves when another one is chosen."""

from __future__ import annotations

import bpy

from ..texts import letters, shown, translated, wrapped
from . import fields as field_rows
from .labels import unit_text

#: Lines of text below the name, and of controls.
TEXT_LINES = 3
CONTROL_LINES = 6


def draw(
    layout: bpy.types.UILayout, context: bpy.types.Context, row: bpy.types.PropertyGroup | None
) -> None:
    """row: the active one, or None."""
    box = layout.box()
    _draw_text(box.column(align=True), context, row)
    column = box.column(align=True)
    lines = 0
    if row is not None and not row.reason:
        lines = _draw_controls(column, row)
    for _ in range(CONTROL_LINES - lines):
        column.label(text="")


def _draw_text(
    column: bpy.types.UILayout, context: bpy.types.Context, row: bpy.types.PropertyGroup | None
) -> None:
    """Name, and in a fixed number of lines why it is locked, or what its value means."""
    title, text, icon = translated("No parameter is chosen"), "", "NONE"
    if row is not None:
        title = f"{row.label}, {row.owner}{unit_text(row.unit) and f' [{row.unit}]'}"
        text = shown(row.reason or row.note or row.help)
        icon = "LOCKED" if row.reason else "NONE"
    column.label(text=title, icon=icon, translate=False)
    lines = wrapped(text, letters(context))
    if len(lines) > TEXT_LINES:  # the tooltip of the row has all of it
        lines = lines[:TEXT_LINES]
        lines[-1] = f"{lines[-1]} ..."
    for line in [*lines, *[""] * (TEXT_LINES - len(lines))]:
        column.label(text=line, translate=False)


def _draw_controls(column: bpy.types.UILayout, row: bpy.types.PropertyGroup) -> int:
    """Returns how many lines it has used."""
    is_field = field_rows.is_field(row)
    column.prop(row, "use_start")
    value = column.row(align=True)
    value.enabled = row.use_start
    for index in range(row.width):
        value.prop(row, "start", index=index, text="")
    if not is_field:
        column.prop(row, "minimum", text=translated("Min"))
        column.prop(row, "maximum", text=translated("Max"))
        return 4 + _draw_rate(column, row)
    names = field_rows.shown(row)
    for at in range(0, len(names), 2):
        line = column.row(align=True)
        for name in names[at : at + 2]:
            line.prop(row, name, text="")
    line = column.row(align=True)
    line.prop(row, "minimum", text="")
    line.prop(row, "maximum", text="")
    return 3 + _draw_rate(column, row) + (len(names) + 1) // 2


def _draw_rate(column: bpy.types.UILayout, row: bpy.types.PropertyGroup) -> int:
    """Where Adam may step; returns how many lines it has used."""
    settings = row.id_data.selenite
    fields = any(item.enabled and field_rows.is_field(item) for item in settings.rows)
    if settings.optimiser == "gauss-newton" or (settings.optimiser == "auto" and not fields):
        return 0
    column.prop(row, "learning_rate")
    return 1
