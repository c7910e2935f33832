# SPDX-License-Identifier: GPL-3.0-or-later
"""What this Blender has, and what of it the table of properties knows."""

from __future__ import annotations

from collections.abc import Iterator

import bpy
from property_scenes import scene_of_everything, scope

from selenite.scene_read.properties.inputs import INPUTS
from selenite.scene_read.properties.judge import places
from selenite.scene_read.properties.rows import Effect, same
from selenite.scene_read.properties.tables import (
    TABLES,
    chain_of,
    default_of,
    own_properties,
    struct_of,
    unknown_properties,
)


def unknown() -> list[str]:
    """What this Blender has and the table lacks: properties, inputs of nodes, types."""
    found = []
    for name in TABLES:
        struct = struct_of(name)
        if struct is not None:
            items = unknown_properties(struct)
            found += [f"{name}.{item.identifier} ({item.name})" for item in items]
    tree = bpy.data.materials.new("Probe")
    tree.use_nodes = True
    for name, item in INPUTS.items():
        if hasattr(bpy.types, name):
            node = tree.node_tree.nodes.new(name)
            found += [f"{name}.inputs.{s.name}" for s in node.inputs if s.name not in item.by_name]
    for base in ("Light", "Curve"):
        found += [
            f"type {name} (a kind of {base})"
            for name in dir(bpy.types)
            if name not in TABLES and _is_kind_of(name, base)
        ]
    return found + unknown_values()


def _is_kind_of(name: str, base: str) -> bool:
    struct = getattr(getattr(bpy.types, name), "bl_rna", None)
    return struct is not None and struct.base is not None and struct.base.identifier == base


def unknown_values() -> list[str]:
    """Values of modelled enumerations that the table lacks."""
    found = []
    for name, item in TABLES.items():
        struct = struct_of(name)
        for row in item.named if struct is not None else ():
            shown = struct.properties.get(row.names[0])
            if row.effect is Effect.MODELLED and shown is not None:
                known = row.neutral.values
                values = (value.identifier for value in shown.enum_items)
                found += [f"{name}.{row.names[0]} = {v}" for v in values if v not in known]
    return found


def different_defaults() -> list[str]:
    """Properties whose default in RNA is not the value of a fresh datablock."""
    scene_of_everything()
    found = {}
    for place in places(scope()):
        for struct in chain_of(place.block.bl_rna):
            if struct.identifier not in TABLES:
                continue
            for item in own_properties(struct):
                if item.type not in {"BOOLEAN", "INT", "FLOAT", "ENUM"} or item.is_readonly:
                    continue
                default = default_of(item)
                value = getattr(place.block, item.identifier)
                if not same(value, default):
                    key = f"{struct.identifier}.{item.identifier}"
                    found.setdefault(key, f"{key}: {default} in RNA, {value} in a new one"[:120])
    return list(found.values())


def counts() -> dict[str, dict[str, int]]:
    """Type -> class -> number of properties that this Blender has."""
    found: dict[str, dict[str, int]] = {}
    for name, item in TABLES.items():
        struct = struct_of(name)
        if struct is None:
            continue
        inherited = set(struct.base.properties.keys()) if struct.base else set()
        own = set(struct.properties.keys()) - inherited
        for key in own & item.by_name.keys():
            row = found.setdefault(name, {})
            effect = item.by_name[key].effect.value
            row[effect] = row.get(effect, 0) + 1
    return found


def absent_rows() -> Iterator[str]:
    """Rows of the table that this Blender lacks."""
    for name, item in TABLES.items():
        struct = struct_of(name)
        known = struct.properties.keys() if struct is not None else ()
        yield from (f"{name}.{key}" for key in item.by_name if key not in known)
