# SPDX-License-Identifier: GPL-3.0-or-later
"""What becomes of materials that cannot be read: settings of a scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import bpy


@dataclass(frozen=True)
class ReadingOptions:
    """bake: Cycles bakes outputs of nodes that are not read into images. approximate: what still
    cannot be read is rendered as the nearest thing that can."""

    bake: bool = False
    approximate: bool = False

    def as_json(self) -> dict[str, object]:
        """A dict of plain values."""
        return asdict(self)

    @staticmethod
    def from_json(data: object) -> ReadingOptions:
        """The inverse. Raises ValueError, whose text says what is wrong."""
        names = [item.name for item in fields(ReadingOptions)]
        if not isinstance(data, Mapping) or not set(data) <= set(names):
            raise ValueError(f"its 'reading' is {data!r}, not an object with {', '.join(names)}")
        for key, value in data.items():
            if not isinstance(value, bool):
                raise ValueError(f"its '{key}' is {value!r}, not true or false")
        return ReadingOptions(**data)

    def __or__(self, other: ReadingOptions) -> ReadingOptions:
        return ReadingOptions(self.bake or other.bake, self.approximate or other.approximate)


def options_of(scene: bpy.types.Scene) -> ReadingOptions:
    """Of the panel; without the add-on nothing is baked or approximated."""
    settings = getattr(scene, "selenite", None)
    if settings is None:
        return ReadingOptions()
    return ReadingOptions(bool(settings.bake), bool(settings.approximate))


def set_options(scene: bpy.types.Scene, options: ReadingOptions) -> None:
    """Switches on what `options` ask for; what the scene has on stays so."""
    settings = getattr(scene, "selenite", None)
    if settings is not None:
        settings.bake |= options.bake
        settings.approximate |= options.approximate
