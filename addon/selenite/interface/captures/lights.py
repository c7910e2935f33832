# SPDX-License-Identifier: GPL-3.0-or-later
"""Which lights were on when a photo was taken: kept with its row, drawn below it."""

import bpy

from .controls import draw_part, properties_of_group


class SeleniteCaptureLights(bpy.types.PropertyGroup):
    """The light state of a photo."""

    __annotations__ = properties_of_group("lights")


def draw(layout: bpy.types.UILayout, lights: bpy.types.PropertyGroup) -> None:
    """What the state needs, and no more."""
    draw_part(layout, lights, "lights")


CLASSES = (SeleniteCaptureLights,)
