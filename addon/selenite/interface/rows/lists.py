# SPDX-License-Identifier: GPL-3.0-or-later
"""The two lists: owners, and the parameters of the active one."""

from __future__ import annotations

import bpy

from ..texts import abbreviated, region_width, text_width
from .owners import ICONS, active_owner, owns

#: In pixels at a scale of the interface of 1: what the list and the tick take of the region, what a
#: label keeps for itself, a lock, a swatch, and what is left before a value.
_TAKEN, _MARGIN, _ICON, _SWATCH, _GAP = 78, 12, 20, 28, 5
_NAME = 0.7  # of a row, at most


class SELENITE_UL_owners(bpy.types.UIList):
    """Materials, objects, lamps and the world"""

    def draw_item(
        self,
        context: bpy.types.Context,
        layout: bpy.types.UILayout,
        _data: bpy.types.AnyType,
        item: bpy.types.PropertyGroup,
        _icon: int,
        _active_data: bpy.types.AnyType,
        _active_property: str,
    ) -> None:
        """Name, and how many of its parameters are ticked."""
        rows = [row for row in context.scene.selenite.rows if owns(item, row)]
        ticked = sum(row.enabled for row in rows)
        free = sum(not row.reason for row in rows)
        parts = layout.split(factor=0.75)
        parts.label(text=item.name, icon=ICONS[item.kind], translate=False)
        parts.label(text=f"{ticked} / {free}", translate=False)


class SELENITE_UL_rows(bpy.types.UIList):
    """Parameter and its value"""

    def draw_item(
        self,
        context: bpy.types.Context,
        layout: bpy.types.UILayout,
        _data: bpy.types.AnyType,
        item: bpy.types.PropertyGroup,
        _icon: int,
        _active_data: bpy.types.AnyType,
        _active_property: str,
    ) -> None:
        """Tick, label, value or swatch; greyed with a lock where it cannot be fitted."""
        row = layout.row(align=True)
        row.enabled = not item.reason
        row.prop(item, "enabled", text="")
        owner = active_owner(context.scene.selenite)
        found = owner is not None and not owns(owner, item)  # by a search
        behind = f", {item.owner}" if found else ""
        icon = "LOCKED" if item.reason else "NONE"
        width = region_width(context) - _TAKEN
        room = width - _MARGIN - (_ICON if item.reason else 0) - text_width(behind)
        taken = _SWATCH if item.is_colour else text_width(item.value) + _GAP
        fits = text_width(item.label) + taken <= room
        if not fits and not item.is_colour:  # the details below show the value
            text = abbreviated(item.label, room) + behind
            row.label(text=text, icon=icon, translate=False)
            return
        parts = row.split(factor=min(_NAME, 1 - taken / width))
        text = abbreviated(item.label, room - taken) + behind
        parts.label(text=text, icon=icon, translate=False)
        if item.is_colour:
            swatch = parts.row()
            swatch.enabled = False
            swatch.prop(item, "current", text="")
        else:
            parts.label(text=item.value, translate=False)

    def filter_items(
        self, context: bpy.types.Context, data: bpy.types.AnyType, name: str
    ) -> tuple[list[int], list[int]]:
        """Those of the active owner, or with a search those of all; locked ones only on demand."""
        items = getattr(data, name)
        settings = context.scene.selenite
        flags = shown(items, settings, self.filter_name, self.bitflag_filter_item)
        if self.use_filter_invert:
            flags = [self.bitflag_filter_item ^ flag for flag in flags]
        order: list[int] = []
        if self.use_filter_sort_alpha:
            order = by_label(items)
        return flags, order


def shown(
    items: bpy.types.bpy_prop_collection,
    settings: bpy.types.PropertyGroup,
    wanted: str,
    flag: int,
) -> list[int]:
    """`flag` for each row that is listed, 0 for the others. wanted: what the user searches; it may
    be a part of a label, of an owner or of a name on the command line."""
    owner = active_owner(settings)
    words = wanted.casefold().split()

    def passes(row: bpy.types.PropertyGroup) -> bool:
        if row.reason and not settings.show_locked:
            return False
        if words:
            text = f"{row.label} {row.owner} {row.parameter}".casefold()
            return all(word in text for word in words)
        return owner is None or owns(owner, row)

    return [flag if passes(row) else 0 for row in items]


def by_label(items: bpy.types.bpy_prop_collection) -> list[int]:
    """The place of each row in the order of the alphabet."""
    ranked = sorted(range(len(items)), key=lambda at: (items[at].label.casefold(), at))
    places = [0] * len(items)
    for place, at in enumerate(ranked):
        places[at] = place
    return places
