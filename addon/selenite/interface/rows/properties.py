# SPDX-License-Identifier: GPL-3.0-or-later
"""What the .blend keeps of the list of parameters. Enum numbers and names must not change."""

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ...fit.fields.grids import MOST_BY_NUMBER, USUAL_SIZE
from ...fit.fields.images import MOST_TEXELS, USUAL_TEXELS
from . import environment as environment_rows

GRID_ITEMS = (
    ("new", "New", "One value everywhere, in as many voxels or texels as asked for", 0),
    ("scene", "Scene", "The grid of the Volume object, the image of the input", 1),
    ("file", "File", "A grid from a .npy or .vol file, an image from a picture", 2),
)
UNSEEN_ITEMS = (
    ("auto", "Usual", "Filled where the image starts as one colour, else as they were", 0),
    ("keep", "As They Were", "At the value that they start from", 1),
    ("fill", "Filled from Around", "Smoothly, from the texels nearby that photos see", 2),
)
KIND_ITEMS = (
    ("material", "Material", "", 0), ("light", "Light", "", 1), ("world", "World", "", 2),
    ("object", "Object", "", 3),
)  # fmt: skip


class SeleniteOwner(bpy.types.PropertyGroup):
    """A material, an object, a lamp or the world: a group of the list. `name` is that of the
    owner."""

    kind: EnumProperty(items=KIND_ITEMS)
    material: PointerProperty(type=bpy.types.Material)
    tip: StringProperty(description="Tooltip of the row")


class SeleniteRow(bpy.types.PropertyGroup):
    """A parameter that can be fitted: tick, start, box constraint and step."""

    enabled: BoolProperty(name="Fit", default=False, description="Fit this parameter")
    kind: EnumProperty(items=KIND_ITEMS)
    material: PointerProperty(type=bpy.types.Material)
    light: PointerProperty(type=bpy.types.Light)
    object: PointerProperty(type=bpy.types.Object)
    owner: StringProperty(description="Name of the owner as on the command line")
    parameter: StringProperty(description="Name of the parameter as on the command line")
    unit: StringProperty()
    help: StringProperty()
    width: IntProperty(default=1)
    label: StringProperty(description="The input's own name, in the language of the interface")
    tip: StringProperty(description="Tooltip of the row")
    value: StringProperty(description="Value in the scene when the list was last refreshed")
    current: FloatVectorProperty(
        name="Value",
        size=3,
        subtype="COLOR",
        min=0.0,
        soft_max=1.0,
        description="Colour in the scene when the list was last refreshed",
    )
    is_colour: BoolProperty(description="The value is a colour and not a fixed texture")
    is_vector: BoolProperty(description="The three numbers are no colour")
    usual: BoolProperty(description="It is fitted unless another one is ticked")
    note: StringProperty(description="What the value means, where that needs another unit")
    reason: StringProperty(description="Why this parameter cannot be fitted")
    use_start: BoolProperty(
        name="Own Start", default=False, description="Start elsewhere than at the scene's value"
    )
    start: FloatVectorProperty(name="Start", size=3, precision=3, description="First value")
    minimum: FloatProperty(name="Minimum", precision=4, description="Smallest value of the fit")
    maximum: FloatProperty(name="Maximum", precision=4, description="Largest value of the fit")
    learning_rate: FloatProperty(
        name="Rate", default=0.03, min=1e-6, max=1.0, precision=4, description="Step of the fit"
    )
    grid_from: EnumProperty(
        name="Start From", items=GRID_ITEMS, description="Where a grid or an image starts"
    )
    voxels: IntProperty(
        name="Voxels",
        default=USUAL_SIZE,
        min=1,
        max=MOST_BY_NUMBER,
        description="Voxels along the longest side of the object",
    )
    texels: IntProperty(
        name="Texels",
        default=USUAL_TEXELS,
        min=1,
        max=MOST_TEXELS,
        description="Texels along each side of the image",
    )
    grid_path: StringProperty(
        name="File",
        subtype="FILE_PATH",
        description="Grid (.npy or .vol) or picture (such as .png or .exr) to start from",
    )
    unseen: EnumProperty(
        name="Unseen",
        items=UNSEEN_ITEMS,
        description="What becomes of texels or vertices that no photo sees",
    )
    environment_size: environment_rows.SIZE
    projection: environment_rows.PROJECTION


CLASSES = (SeleniteOwner, SeleniteRow)
