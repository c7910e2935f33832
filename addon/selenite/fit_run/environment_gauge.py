# SPDX-License-Identifier: GPL-3.0-or-later
"""What an unknown environment and unknown colours make up for, as far as the scene alone tells."""

from __future__ import annotations

from collections.abc import Sequence

from ..parameters import join_name, split_name
from ..scene_read.values import SceneValues

_ENVIRONMENT = join_name("World", "environment")
#: What of a material a brighter light makes up for.
_COLOURS = ("base_color", "base_color_texture", "albedo", "albedo_grid")


def remarks(values: SceneValues, names: Sequence[str]) -> list[str]:
    """One sentence where the environment and the colours of all that is seen are unknown, and no
    lamp is known. names: of all that is fitted."""
    if _ENVIRONMENT not in names:
        return []
    pairs = [split_name(name) for name in names]
    materials = {item.name for item in values.materials}
    unknown = {owner for owner, name in pairs if owner in materials and name in _COLOURS}
    seen = {
        name for item in values.objects if item.visible_to_camera for name in item.materials
    } & materials
    fitted = {owner for owner, name in pairs if name == "power"}
    known = [
        item.name
        for item in values.lights
        if item.power > 0 and max(item.color) > 0 and item.name not in fitted
    ]
    if not unknown or seen - unknown or known:
        return []
    colours = [join_name(*pair) for pair in pairs if pair[0] in unknown and pair[1] in _COLOURS]
    return [
        f"{_ENVIRONMENT} and {' and '.join(colours)} make up for each other, since no material or "
        "lamp in the scene is known: a brighter room with darker surfaces looks the same. Add a "
        "grey card or another known material to photos and scene, or fit one of the two"
    ]
