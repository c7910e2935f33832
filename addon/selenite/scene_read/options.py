# SPDX-License-Identifier: GPL-3.0-or-later
"""What becomes of materials that cannot be read: settings of a scene."""

from __future__ import annotations

from dataclasses import dataclass

import bpy


@dataclass(frozen=True)
class ReadingOptions:
    """bake: Cycles bakes outputs of nodes that are not read into images. approximate: what still
    cannot be read is rendered as the nearest thing that can."""

    bake: bool = False
    approximate: bool = False


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
