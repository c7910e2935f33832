# SPDX-License-Identifier: GPL-3.0-or-later
"""The groups of the list: materials, those of the active object first, then objects whose mesh has
something to be fitted, lamps and the world."""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ...scene_read.values import Owner
from ..chosen import chosen
from ..texts import translated

ICONS = {"material": "MATERIAL", "object": "MESH_DATA", "light": "LIGHT", "world": "WORLD"}
_ORDER = tuple(ICONS)


def refresh_owners(scene: bpy.types.Scene, owners: Iterable[Owner]) -> None:
    """One group for each owner; the active one stays the active one, at first it is the material of
    the active object."""
    settings = scene.selenite
    before = active_owner(settings)
    kept = (before.kind, before.name) if before is not None else ("", "")
    first = [item.name for item in _of_active_object()]
    blocks = {row.owner: row.material for row in settings.rows if row.kind == "material"}

    def rank(owner: Owner) -> tuple[int, int, str]:
        block = blocks.get(owner.name)
        name = block.name if block is not None else ""
        own = first.index(name) if owner.kind == "material" and name in first else len(first)
        return _ORDER.index(owner.kind), own, owner.name.casefold()

    settings.owners.clear()
    for owner in sorted(owners, key=rank):
        item = settings.owners.add()
        item.name, item.kind = owner.name, owner.kind
        item.material = blocks.get(owner.name) if owner.kind == "material" else None
        item.tip = f"{translated(owner.kind.title())} '{owner.name}'"
    names = [(item.kind, item.name) for item in settings.owners]
    settings.active_owner = names.index(kept) if kept in names else 0


def owns(owner: bpy.types.PropertyGroup, row: bpy.types.PropertyGroup) -> bool:
    """Whether a row is of this group; an object may be called as its material is."""
    return (owner.kind, owner.name) == (row.kind, row.owner)


def active_owner(settings: bpy.types.PropertyGroup) -> bpy.types.PropertyGroup | None:
    """The group whose parameters are listed."""
    found: bpy.types.PropertyGroup | None = chosen(settings.owners, settings.active_owner)
    return found


def _of_active_object() -> list[bpy.types.Material]:
    """Its active material first."""
    item = bpy.context.view_layer.objects.active if bpy.context.view_layer else None
    if item is None:
        return []
    found = [item.active_material, *(slot.material for slot in item.material_slots)]
    return [material for material in dict.fromkeys(found) if material is not None]
