# SPDX-License-Identifier: GPL-3.0-or-later
"""Which lights were on when a photo was taken: kept with its row, drawn below it. Enum numbers and
names must not change."""

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, PointerProperty

from ...capture.request import FRAMES
from ..texts import field

LIGHT_ITEMS = (
    ("ALL", "All Lamps", "As the scene renders them", 0),
    ("LAMP", "One Lamp", "All others were off", 1),
    ("COLLECTION", "Collection", "Lamps that are not in the collection were off", 2),
    ("NONE", "No Lamp", "The world alone", 3),
)


def _is_lamp(_group: bpy.types.PropertyGroup, item: bpy.types.Object) -> bool:
    return item.type == "LIGHT"


class SeleniteCaptureLights(bpy.types.PropertyGroup):
    """The light state of a photo."""

    mode: EnumProperty(
        name="Lights", items=LIGHT_ITEMS, description="Lamps that were on when the photo was taken"
    )
    lamp: PointerProperty(
        name="Lamp", type=bpy.types.Object, poll=_is_lamp, description="The lamp that was on"
    )
    collection: PointerProperty(
        name="Collection", type=bpy.types.Collection, description="Its lamps were on"
    )
    world: BoolProperty(
        name="World", default=True, description="The world's light was on; off: it is black"
    )
    use_frame: BoolProperty(
        name="Lamps at Frame",
        description="Lamps stood where they stand at a frame of the scene; only lamps may move",
    )
    frame: IntProperty(
        name="Frame",
        default=1,
        min=FRAMES[0],
        max=FRAMES[1],
        description="Lamps stood as at this frame, and were off if they do not render there",
    )


def draw(layout: bpy.types.UILayout, lights: bpy.types.PropertyGroup) -> None:
    """What the state needs, and no more."""
    column = layout.column()
    field(column, lights, "mode")
    if lights.mode == "LAMP":
        field(column, lights, "lamp")
    elif lights.mode == "COLLECTION":
        field(column, lights, "collection")
    field(column, lights, "world")
    field(column, lights, "use_frame")
    part = column.row(align=True)
    part.enabled = lights.use_frame
    part.prop(lights, "frame")


CLASSES = (SeleniteCaptureLights,)
