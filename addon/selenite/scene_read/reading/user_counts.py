# SPDX-License-Identifier: GPL-3.0-or-later
"""How many users Blender counts of what stands in a scene's own collection.

Blender 3 counts each of these twice where a scene is copied, and once where the copy is removed. So
an object would seem to have one more user after each reading, and stay in the file when it is
deleted. A script cannot lower a count, so it is lowered in memory: at the one place that has shown
the count of a block through several changes, and nowhere else.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from functools import lru_cache

import bpy

_NAME = "selenite_user_counts"
#: Bytes at the begin of a block, among which its count is, and how many changes are watched.
_BYTES, _CHANGES = 192, 5


def copied(scene: bpy.types.Scene) -> tuple[bpy.types.Scene, Callable[[], None]]:
    """A copy, and what removes it without a trace."""
    members = [*scene.collection.children, *scene.collection.objects]
    before = [item.users for item in members]
    copy = scene.copy()
    twice = [item for item, users in zip(members, before, strict=True) if item.users > users + 1]

    def remove() -> None:
        bpy.data.scenes.remove(copy)
        _count_one_less(twice)

    return copy, remove


def _count_one_less(items: Sequence[bpy.types.ID]) -> None:
    place = _place() if items else None
    if place is None:
        return
    for item in items:
        count = _number(item, place)
        if count.value == item.users:
            count.value -= 1


@lru_cache(maxsize=1)
def _place() -> int | None:
    """Where a block has its count, in bytes from its begin; None if that is not clear."""
    block, holder = (bpy.data.meshes.new(_NAME) for _ in range(2))
    places = set(range(0, _BYTES, ctypes.sizeof(ctypes.c_int)))
    for index in range(_CHANGES):
        places = {place for place in places if _number(block, place).value == block.users}
        holder[str(index)] = block
    bpy.data.meshes.remove(holder)
    bpy.data.meshes.remove(block)
    return places.pop() if len(places) == 1 else None


def _number(block: bpy.types.ID, place: int) -> ctypes.c_int:
    return ctypes.c_int.from_address(block.as_pointer() + place)
