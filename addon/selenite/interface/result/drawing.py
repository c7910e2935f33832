# SPDX-License-Identifier: GPL-3.0-or-later
"""A result drawn: in the sidebar, and in a pop-up."""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from ...report import table
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
    owner = ("", "")
    for row in settings.results:
        if (row.kind, row.owner) != owner:
            owner = row.kind, row.owner
            layout.label(text=row.owner, icon=OWNERS[row.kind], translate=False)
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
    """A line for each number; where the region is narrow, name, values and interval below."""
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
        for text in (f"{start} \u2192 {fitted}", interval):
            if text:
                column.label(text=shown(text), icon="BLANK1", translate=False)


def _draw_cells(column: bpy.types.UILayout, cells: Sequence[str]) -> None:
    line, rest = column.row(align=True), 1.0
    for text, share in zip(cells[:-1], _COLUMNS, strict=False):
        line = line.split(factor=share / rest, align=True)
        line.label(text=text, translate=False)
        rest -= share
    line.label(text=cells[-1], translate=False)


def value_text(row: bpy.types.PropertyGroup, *, with_half: bool = True) -> str:
    """ "0.312 \u00b1 0.004": the value and half of its interval."""
    values, half = list(row.value[: row.width]), _half(row)
    if half is not None:
        text = table.with_half(values, half)
        text = text if with_half else text.partition(" \u00b1")[0]
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
    """What it is and its value; how sure, with half of the interval; where the interval lies. A
    narrow region has half of the interval below the value."""
    left, right = _halves(column, ICONS[row.sureness])
    room = _NAME * (region_width(bpy.context) - _TAKEN) - _MARGIN
    left.label(text=abbreviated(label_of(row), room), translate=False)
    if row.width == 3 and not row.is_vector and max(row.swatch) <= 1:
        right.prop(row, "swatch", text="")
        if wide:
            right.label(text=value_text(row), translate=False)
    else:
        right.label(text=value_text(row, with_half=wide), translate=False)
    if row.sureness == "UNKNOWN":
        return
    left, right = _halves(column, "BLANK1")
    left.label(text=translated(table.WORDS[row.sureness]), translate=False)
    half = _half(row)
    if half is None:  # an interval would say more than is known
        return
    if wide:
        _draw_bar(right.column(), row.bar_low, row.bar_high)
        return
    right.label(text=table.half_text(half).strip(), translate=False)
    _, right = _halves(column, "BLANK1", _BAR_HEIGHT)
    _draw_bar(right.column(), row.bar_low, row.bar_high, height=1.0)


def _halves(
    column: bpy.types.UILayout, icon: str, height: float = 1.0
) -> tuple[bpy.types.UILayout, bpy.types.UILayout]:
    """A line with an icon: the part of the name, and that of the value."""
    line = column.row(align=True)
    line.scale_y = height
    line.label(text="", icon=icon)
    parts = line.split(factor=_NAME)
    return parts.row(), parts.row(align=True)


def _draw_bar(
    column: bpy.types.UILayout, low: float, high: float, height: float = _BAR_HEIGHT
) -> None:
    """From the lower to the upper bound of the fit; what is filled is the interval."""
    width = max(high - low, _THINNEST)
    low = min(low, 1 - width)
    line = column.row(align=True)
    line.scale_y = height
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
