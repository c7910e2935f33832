# SPDX-License-Identifier: GPL-3.0-or-later
"""What the .blend keeps of a result. Enum numbers and names must not change."""

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    StringProperty,
)

from ..rows.properties import KIND_ITEMS

#: The names are those of report.findings.
SURENESS_ITEMS = (
    ("UNKNOWN", "Interval Not Known", "How sure the value is was not computed", 0),
    ("SURE", "Determined", "The photos determine it well", 1),
    ("WEAK", "Weak", "Known roughly, at its bound, or the photos are far from explained", 2),
    ("OPEN", "Not Determined", "Other values explain the photos as well", 3),
)


def _fitted_colour(row: bpy.types.PropertyGroup) -> tuple[float, float, float]:
    return tuple(row.value)


def _keep_colour(_row: bpy.types.PropertyGroup, _colour: tuple[float, float, float]) -> None:
    """A click on the swatch changes nothing; without this Blender would draw it in grey."""


class SeleniteResult(bpy.types.PropertyGroup):
    """One fitted parameter. `original` is what stood in the scene before Apply."""

    owner: StringProperty()
    kind: EnumProperty(items=KIND_ITEMS)
    datablock: StringProperty()
    library: StringProperty()
    parameter: StringProperty()
    width: IntProperty(default=1)
    start: FloatVectorProperty(size=3, precision=4)
    value: FloatVectorProperty(size=3, precision=4)
    original: FloatVectorProperty(size=3, precision=4)
    text: StringProperty(description="Start and fitted value")
    unit: StringProperty()
    is_vector: BoolProperty(description="The three numbers are no colour")
    sureness: EnumProperty(items=SURENESS_ITEMS, default="UNKNOWN")
    has_interval: BoolProperty(description="`low` and `high` hold the 90 % interval")
    low: FloatVectorProperty(size=3, precision=4)
    high: FloatVectorProperty(size=3, precision=4)
    bar_low: FloatProperty(description="Low end of the interval, 0 to 1 of the bounds")
    bar_high: FloatProperty(description="High end of the interval, 0 to 1 of the bounds")
    swatch: FloatVectorProperty(
        name="Fitted Colour",
        size=3,
        subtype="COLOR",
        min=0.0,
        soft_max=1.0,
        get=_fitted_colour,
        set=_keep_colour,
        description="Fitted colour, linear Rec. 709",
    )
    grid_file: StringProperty(
        description="The fitted grid (.npy) or image (.png or .exr), if this is one"
    )
    grid_to_unit: StringProperty(description="World to the unit cube over which a grid lies (JSON)")


CLASSES = (SeleniteResult,)
