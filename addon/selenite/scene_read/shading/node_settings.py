# SPDX-License-Identifier: GPL-3.0-or-later
"""What the value of a node depends on beside its links, as plain values: for keys of caches."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np

if TYPE_CHECKING:
    from ..hosts import BpyStruct

#: What a node has for the editor alone, and what is looked at in other ways: its links and values.
_OF_EDITOR = {
    "location", "location_absolute", "width", "width_hidden", "height", "dimensions", "parent",
    "select", "show_options", "show_preview", "hide", "show_texture", "color", "use_custom_color",
    "label", "name", "inputs", "outputs", "internal_links", "node_tree", "interface",
    "warning_propagation", "color_tag", "panel_states", "is_active_output",
}  # fmt: skip
_DEPTH = 3  # a curve's points are that deep below the node


def settings_of(node: bpy.types.Node) -> list[object]:
    """Names and values of its properties, and of the ramp, curves and image that it holds."""
    return _values(node, _DEPTH, _OF_EDITOR)


def _values(struct: BpyStruct, depth: int, left_out: set[str]) -> list[object]:  # any
    found: list[object] = []
    for item in struct.bl_rna.properties:
        name = item.identifier
        if name in left_out or name == "rna_type" or name.startswith("bl_"):
            continue
        value = getattr(struct, name, None)
        # Below the node the same names are no longer the editor's: stops of a ramp have colours.
        if item.type == "COLLECTION":
            parts = [_values(one, depth - 1, set()) for one in value] if depth else None
            found.append((name, parts))
        elif isinstance(value, bpy.types.Image):
            found.append((name, facts_of(value)))
        elif isinstance(value, bpy.types.Object):
            found.append((name, value.name_full, np.array(value.matrix_world).tolist()))
        elif value is None or isinstance(value, bpy.types.ID):
            found.append((name, getattr(value, "name_full", None)))
        elif item.type != "POINTER":
            found.append((name, plain(value)))
        elif depth:
            found.append((name, _values(value, depth - 1, set())))
    return found


def plain(value: BpyStruct) -> object:
    """Of numbers, texts and lists."""
    if isinstance(value, (set, frozenset)):
        return sorted(value)
    if hasattr(value, "__len__") and not isinstance(value, str):
        return [plain(item) for item in value]
    return value if isinstance(value, (bool, int, float, str)) or value is None else str(value)


def facts_of(image: bpy.types.Image) -> list[object]:
    """The file with its size and time, or what is packed, or the pixels of what was made or
    painted."""
    facts = [image.name_full, image.source, image.colorspace_settings.name, image.alpha_mode]
    if image.source == "GENERATED" or image.is_dirty:
        stored: BpyStruct = image.pixels
        pixels = np.empty(len(stored), np.float32)
        stored.foreach_get(pixels)
        return [*facts, tuple(image.size), hashlib.sha256(pixels.tobytes()).hexdigest()]
    if image.packed_file:
        return [*facts, hashlib.sha256(image.packed_file.data).hexdigest()]
    path = Path(bpy.path.abspath(image.filepath, library=image.library))
    try:
        found = path.stat()
    except OSError:
        return [*facts, str(path)]
    return [*facts, str(path), found.st_size, found.st_mtime_ns]
