# SPDX-License-Identifier: GPL-3.0-or-later
"""What a file's scripts would have done: the command line opens files without running any."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

_CURE = "bake it to keyframes, or write an expression of numbers and variables alone"


def blocked_drivers() -> list[str]:
    """A sentence for each driver whose expression is Python and did not run, so that what it drives
    has the value that the file was saved with."""
    if bpy.context.preferences.filepaths.use_scripts_auto_execute and not bpy.app.autoexec_fail:
        return []
    return [
        f"{kind} '{block.name}': the driver of '{curve.data_path}' has the Python expression "
        f"'{curve.driver.expression}', which is not run; its saved value counts; {_CURE}"
        for kind, block in _blocks()
        for curve in (block.animation_data.drivers if block.animation_data else ())
        if curve.driver.type == "SCRIPTED" and not curve.driver.is_simple_expression
    ]


def _blocks() -> Iterator[tuple[str, bpy.types.ID]]:
    """Every datablock that may have drivers, with its kind; node trees and shape keys with those
    that own them."""
    for name in dir(bpy.data):
        collection = getattr(bpy.data, name)
        if not isinstance(collection, bpy.types.bpy_prop_collection):
            continue
        for block in collection:
            kind = block.bl_rna.name
            for item in (
                block,
                getattr(block, "node_tree", None),
                getattr(block, "shape_keys", None),
            ):
                if item is not None and hasattr(item, "animation_data"):
                    yield kind, item
