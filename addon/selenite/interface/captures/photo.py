# SPDX-License-Identifier: GPL-3.0-or-later
"""How a photo was taken and what of it counts: kept with its row, drawn below it."""

import bpy
from bpy.props import BoolProperty

from ..pictures import mask
from .controls import draw_part, properties_of_group


class SeleniteCapturePhoto(bpy.types.PropertyGroup):
    """Of one photo; the keys of docs/guide/captures.md."""

    __annotations__ = {
        "expanded": BoolProperty(
            name="How It Was Taken", description="Mask, response, size and lens"
        ),
        **properties_of_group("how"),
    }


def draw(layout: bpy.types.UILayout, photo: bpy.types.PropertyGroup) -> None:
    """A box that opens."""
    box = layout.box()
    box.prop(photo, "expanded", icon="TRIA_DOWN" if photo.expanded else "TRIA_RIGHT", emboss=False)
    if photo.expanded:
        draw_part(box, photo, "counts")
        mask.draw(box)
        draw_part(box, photo, "taken")


CLASSES = (SeleniteCapturePhoto,)
