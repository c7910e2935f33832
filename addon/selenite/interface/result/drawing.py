# SPDX-License-Identifier: GPL-3.0-or-later
"""A result drawn: in the sidebar, and in a pop-up."""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from ...fit_run.answer import table
from ..rows.fields import is_field
from ..rows.labels import label_of, unit_text, with_labels
from ..rows.owners import ICONS as OWNERS
from ..texts import abbreviated, letters, paragraph, region_width, shown, translated

#: Blender's own, and a word beside each.
ICONS = {"SURE": "CHECKMARK", "WEAK": "ERROR", "OPEN": "CANCEL", "UNKNOWN": "QUESTION"}
_THINNEST = 0.03
_BAR_HEIGHT = 0.35
#: Share of a line that a name has; pixels that panel, tabs and square take, and a label.
_NAME, _TAKEN, _MARGIN = 0.5, 59, 12
_SWATCH = 0.4  # share that it has of its half of the line
_WIDE = 45  # letters of a line with room for a colour in figures
_WIDE_TABLE = 55  # letters of a line with room for the table
#: Shares of a line that the columns of the table have.
_COLUMNS = (0.34, 0.16, 0.16, 0.34)


def draw_verdict(
    layout: bpy.types.UILayout, context: bpy.types.Context, settings: bpy.types.PropertyGroup
) -> None:
    """One sentence for the whole."""
    if settings.verdict:
        icon = ICONS.get(settings.verdict_icon, "NONE")
        paragraph(layout.box(), context, settings.verdict, icon)


def draw_values(
    layout: bpy.types.UILayout, context: bpy.types.Context, settings: bpy.types.PropertyGroup
) -> None:
    """A line for each value, with its interval as a bar between the bounds of the fit."""
    owner = None
    for row in settings.results:
        if row.owner != owner:
            owner = row.owner
            layout.label(text=owner, icon=OWNERS[row.kind], translate=False)
        if is_field(row):
            for line in (label_of(row), *row.text.splitlines()):
                paragraph(layout, context, line)
            continue
        _draw_value(layout.column(align=True), row, wide=letters(context) > _WIDE)


def draw_report(
    layout: bpy.types.UILayout, context: bpy.types.Context, settings: bpy.types.PropertyGroup
) -> None:
    """Everything, behind a triangle."""
    icon = "TRIA_DOWN" if settings.show_report else "TRIA_RIGHT"
    layout.prop(settings, "show_report", icon=icon, emboss=False)
    if not settings.show_report:
        return
    box = layout.box()
    _draw_table(box.column(align=True), context, settings)
    for text in settings.report.splitlines():
        paragraph(box, context, with_labels(shown(text), settings.rows))


def _draw_table(
    column: bpy.types.UILayout, context: bpy.types.Context, settings: bpy.types.PropertyGroup
) -> None:
    """A line for each number; two where the region is narrow."""
    wide = letters(context) >= _WIDE_TABLE
    if wide:
        _draw_cells(column, [translated(title.capitalize()) for title in table.TITLES[:4]])
    for line in settings.table.splitlines():
        name, start, fitted, interval, *_ = line.split("\t")
        name = with_labels(name, settings.rows)
        if wide:
            _draw_cells(column, [name, start, fitted, interval])
            continue
        column.label(text=name, translate=False)
        text = f"{start} \u2192 {fitted}" + (f" ({interval})" if interval else "")
        column.label(text=shown(text), icon="BLANK1", translate=False)


def _draw_cells(column: bpy.types.UILayout, cells: Sequence[str]) -> None:
    line, rest = column.row(align=True), 1.0
    for text, share in zip(cells[:-1], _COLUMNS, strict=False):
        line = line.split(factor=share / rest, align=True)
        line.label(text=text, translate=False)
        rest -= share
    line.label(text=cells[-1], translate=False)


def value_text(row: bpy.types.PropertyGroup) -> str:
    """ "0.312 \u00b1 0.004": the value and half of its interval."""
    values, half = list(row.value[: row.width]), _half(row)
    if half is not None:
        text = table.with_half(values, half)
    elif row.width > 1:
        text = " ".join(f"{x:.2f}" for x in values)
    else:
        text = f"{values[0]:.3g}"
    return text + unit_text(row.unit)


def _half(row: bpy.types.PropertyGroup) -> float | None:
    if not row.has_interval:
        return None
    return max((row.high[at] - row.low[at]) / 2 for at in range(row.width))


def _draw_value(column: bpy.types.UILayout, row: bpy.types.PropertyGroup, *, wide: bool) -> None:
    """Two lines at most: what it is, its value; how sure, and where the interval lies."""
    line = column.row(align=True)
    line.label(text="", icon=ICONS[row.sureness])
    parts = line.split(factor=_NAME)
    room = _NAME * (region_width(bpy.context) - _TAKEN) - _MARGIN
    parts.label(text=abbreviated(label_of(row), room), translate=False)
    right = parts.row(align=True)
    if row.width == 3 and not row.is_vector and max(row.swatch) <= 1:
        half = _half(row)
        narrow = "" if half is None else table.half_text(half)
        both = right.split(factor=_SWATCH) if wide or narrow else right
        both.prop(row, "swatch", text="")
        if wide or narrow:
            both.label(text=value_text(row) if wide else narrow, translate=False)
    else:
        right.label(text=value_text(row), translate=False)
    if row.sureness == "UNKNOWN":
        return
    line = column.row(align=True)
    line.label(text="", icon="BLANK1")
    word = translated(table.WORDS[row.sureness])
    if row.sureness == "OPEN":  # an interval would say more than is known
        line.label(text=word, translate=False)
        return
    parts = line.split(factor=_NAME)
    parts.label(text=word, translate=False)
    _draw_bar(parts.column(), row.bar_low, row.bar_high)


def _draw_bar(column: bpy.types.UILayout, low: float, high: float) -> None:
    """From the lower to the upper bound of the fit; what is filled is the interval."""
    width = max(high - low, _THINNEST)
    low = min(low, 1 - width)
    line = column.row(align=True)
    line.scale_y = _BAR_HEIGHT
    if width > 1 - _THINNEST:
        line.operator("selenite.show_result", text="", depress=True)
        return
    if low > _THINNEST:
        parts = line.split(factor=low, align=True)
        parts.box().label(text="")
        line = parts
    rest = 1 - low if low > _THINNEST else 1.0
    parts = line.split(factor=min(width / rest, 1.0), align=True)
    filled = parts.row(align=True)
    filled.operator("selenite.show_result", text="", depress=True)
    if width / rest < 1 - _THINNEST:
        parts.box().label(text="")
