# SPDX-License-Identifier: GPL-3.0-or-later
"""All tables by RNA type, and which of them a datablock has."""

from __future__ import annotations

from functools import cache

import bpy

from ..hosts import BpyStruct
from . import cameras, geometry, images, lamps, layers, materials, nodes, objects, render, worlds
from .rows import Row, Table, modelled, no_effect, table

#: A bpy.types.Property of whatever kind: the base class of the stubs has no default.
RnaProperty = BpyStruct

ID = table(
    "ID",
    modelled("library library_weak_reference override_library original is_evaluated is_missing"),
    no_effect("""
        name name_full id_type session_uid users use_fake_user use_extra_user is_embedded_data tag
        is_library_indirect is_linked_packed deep_hash is_runtime_data is_editable asset_data
        preview
    """),
)

TABLES: dict[str, Table] = {
    item.type: item
    for item in (
        ID,
        *render.TABLES,
        *layers.TABLES,
        *objects.TABLES,
        *lamps.TABLES,
        *worlds.TABLES,
        *materials.TABLES,
        *cameras.TABLES,
        *geometry.TABLES,
        *images.TABLES,
        *nodes.TABLES,
    )
}


def struct_of(name: str) -> bpy.types.Struct:
    """The RNA type of that name, None if this Blender has none.

    `bpy.types` lacks the groups that Cycles registers: a pointer to them leads there.
    """
    found = getattr(bpy.types, name, None)
    if found is not None:
        return found.bl_rna
    for owner in ("Scene", "ViewLayer", "Object", "Light", "World", "Material", "Camera", "Mesh"):
        for item in getattr(bpy.types, owner).bl_rna.properties:
            if item.type == "POINTER" and item.fixed_type.identifier == name:
                return item.fixed_type
    return None


#: Types whose properties are registered by Cycles itself when Blender starts.
CYCLES_GROUPS = tuple(name for name in TABLES if name.startswith("Cycles"))


def chain_of(struct: bpy.types.Struct) -> tuple[bpy.types.Struct, ...]:
    """An RNA type and its base types."""
    found = []
    while struct is not None:
        found.append(struct)
        struct = struct.base
    return tuple(found)


def own_properties(struct: bpy.types.Struct) -> list[RnaProperty]:
    """The properties that an RNA type adds to its base type.

    Add-ons register properties of their own, which change no picture; Cycles' groups count.
    """
    inherited = set(struct.base.properties.keys()) if struct.base else set()
    table = TABLES.get(struct.identifier)
    known = table.by_name if table is not None else {}
    return [
        item
        for item in struct.properties
        if item.identifier not in inherited
        and item.identifier != "rna_type"
        and (not item.is_runtime or item.identifier in known or struct.identifier in CYCLES_GROUPS)
    ]


def unknown_properties(struct: bpy.types.Struct) -> list[RnaProperty]:
    """Properties of an RNA type that its table lacks; none where there is no table."""
    table = TABLES.get(struct.identifier)
    if table is None:
        return []
    return [item for item in own_properties(struct) if item.identifier not in table.by_name]


def default_of(item: RnaProperty) -> object:
    """The default in RNA, None for a pointer or a collection."""
    if item.type in {"POINTER", "COLLECTION"}:
        return None
    if item.type == "ENUM" and item.is_enum_flag:
        return item.default_flag
    return item.default_array if getattr(item, "array_length", 0) else item.default


@cache
def _rows_of(identifiers: tuple[str, ...]) -> tuple[Row, ...]:
    return tuple(row for name in identifiers if name in TABLES for row in TABLES[name].named)


def rows_of(block: BpyStruct) -> tuple[Row, ...]:
    """The rows that may have to be named for a datablock, those of its base types too."""
    return _rows_of(tuple(struct.identifier for struct in chain_of(block.bl_rna)))
