# SPDX-License-Identifier: GPL-3.0-or-later
"""Light linking and shadow linking (Blender 4.0 on), as sets of objects and bits of lights.

A light shines on the objects that its receiver collection includes, or where it includes none on
all but those that it excludes. Its blocker collection says the same of who casts its shadows.
Objects that all lights treat alike make up a set, numbered from 0; a light has a bit for each.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import bpy

from ..problems import Problem
from .values import ALL_SETS

MOST_SETS = 64
_COLLECTIONS = ("receiver_collection", "blocker_collection")


@dataclass(frozen=True)
class Linking:
    """One of the two kinds of linking, of all lights together.

    `sets`: object -> its set, 0 for one that no light names. `bits`: light -> the sets it is linked
    to, by the name of its object and library.
    """

    sets: dict[tuple[str, str], int]
    bits: dict[tuple[str, str], int]

    def set_of(self, item: bpy.types.Object, instancer: bpy.types.Object) -> int:
        """Of an original object; an instancer that a light names speaks for what it shows."""
        return self.sets.get(_key(instancer)) or self.sets.get(_key(item), 0)

    def bits_of(self, light: bpy.types.Object) -> int:
        """Of the object of a lamp or of an emissive mesh."""
        return self.bits.get(_key(light), ALL_SETS)


def light_and_shadow_linking(
    emitters: Iterable[bpy.types.Object], problems: list[Problem]
) -> tuple[Linking, Linking]:
    """Of the original objects that are evaluated. What goes beyond what Cycles can tell apart goes
    into `problems`."""
    items = list(emitters)
    light, shadow = (_linking(items, name, problems) for name in _COLLECTIONS)
    return light, shadow


def _key(item: bpy.types.Object) -> tuple[str, str]:
    return item.name, item.library.filepath if item.library is not None else ""


def _linking(items: list[bpy.types.Object], name: str, problems: list[Problem]) -> Linking:
    states: dict[str, dict[tuple[str, str], str]] = {}  # collection -> object -> link state
    collection_of: dict[tuple[str, str], str] = {}
    for item in items:
        linking = getattr(item, "light_linking", None)
        collection = getattr(linking, name, None)
        if collection is None:
            continue
        title = f"{collection.library.filepath if collection.library else ''}:{collection.name}"
        collection_of[_key(item)] = title
        if title not in states:
            states[title] = _states(collection)
    # What every light says of an object decides its set.
    said: dict[tuple[str, str], tuple[tuple[str, str], ...]] = {}
    for title, named in states.items():
        for thing, state in named.items():
            said[thing] = (*said.get(thing, ()), (title, state))
    numbers: dict[tuple[tuple[str, str], ...], int] = {}
    sets = {thing: numbers.setdefault(text, len(numbers) + 1) for thing, text in said.items()}
    if len(numbers) >= MOST_SETS:
        cause = f"their {name.replace('_', ' ')}s tell {len(numbers)} kinds of objects apart"
        cure = f"use collections that tell at most {MOST_SETS - 1} kinds apart, as Cycles needs"
        problems.append(Problem("Light linking", cause, cure))
        return Linking({}, {})
    bits = {}
    for emitter, title in collection_of.items():
        included = {sets[thing] for thing, state in states[title].items() if state == "INCLUDE"}
        excluded = {sets[thing] for thing, state in states[title].items() if state == "EXCLUDE"}
        mask = sum(1 << number for number in included) or ALL_SETS
        bits[emitter] = mask & ~sum(1 << number for number in excluded)
    return Linking(sets, bits)


def _states(collection: bpy.types.Collection) -> dict[tuple[str, str], str]:
    """Object -> INCLUDE or EXCLUDE. Children come first; what is said last counts."""
    found: dict[tuple[str, str], str] = {}
    for child, settings in zip(collection.children, collection.collection_children, strict=True):
        for item in child.all_objects:
            found[_key(item)] = settings.light_linking.link_state
    for item, own in zip(collection.objects, collection.collection_objects, strict=True):
        found[_key(item)] = own.light_linking.link_state
    return found
