# SPDX-License-Identifier: GPL-3.0-or-later
"""A result drawn: in the sidebar, and in a pop-up."""

from __future__ import annotations

import bpy

from ..rows.fields import is_field
from ..rows.labels import label_of, unit_text
from ..rows.owners import ICONS as OWNERS
from ..texts import abbreviated, letters, paragraph, region_width, translated

#: A coloured square, and a word beside it: nobody has to tell colours apart.
ICONS = {
    "SURE": "COLORSET_03_VEC",
    "WEAK": "COLORSET_09_VEC",
    "OPEN": "COLORSET_01_VEC",
    "UNKNOWN": "QUESTION",
}
_WORDS = {"SURE": "sure", "WEAK": "weak", "OPEN": "not determined", "UNKNOWN": ""}
_THINNEST = 0.03
_BAR_HEIGHT = 0.35
#: Share of a line that a name has; pixels that panel, tabs and square take, and a label.
_NAME, _TAKEN, _MARGIN = 0.55, 59, 12
_WIDE = 45  # letters of a line with room for an interval in figures


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
    for row in settings.results:
        box.label(text=f"{row.owner}: {row.parameter}", translate=False)
        for text in row.text.splitlines():
            paragraph(box, context, text)
    for text in settings.report.splitlines():
        paragraph(box, context, text)


def value_text(row: bpy.types.PropertyGroup, *, with_interval: bool = True) -> str:
    """ "0.312 (0.30 to 0.33)"; a colour without its interval, which the bar and the report show."""
    values = list(row.value[: row.width])
    unit = unit_text(row.unit)
    if row.width > 1:
        return " ".join(f"{x:.2f}" for x in values) + unit
    text = f"{values[0]:.3g}"
    if row.has_interval and with_interval:
        text += f" ({row.low[0]:.3g} {translated('to')} {row.high[0]:.3g})"
    return text + unit


def _draw_value(column: bpy.types.UILayout, row: bpy.types.PropertyGroup, *, wide: bool) -> None:
    """Two lines at most: what it is, its value; how sure, and where the interval lies."""
    line = column.row(align=True)
    line.label(text="", icon=ICONS[row.sureness])
    parts = line.split(factor=_NAME)
    room = _NAME * (region_width(bpy.context) - _TAKEN) - _MARGIN
    parts.label(text=abbreviated(label_of(row), room), translate=False)
    right = parts.row(align=True)
    if row.width == 3 and not row.is_vector and max(row.swatch) <= 1:
        swatch = right.row()
        swatch.enabled = False
        swatch.prop(row, "swatch", text="")
        if wide:
            right.label(text=value_text(row), translate=False)
    else:
        right.label(text=value_text(row, with_interval=wide), translate=False)
    if row.sureness == "UNKNOWN":
        return
    line = column.row(align=True)
    line.label(text="", icon="BLANK1")
    word = translated(_WORDS[row.sureness])
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
