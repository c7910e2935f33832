# SPDX-License-Identifier: GPL-3.0-or-later
"""How a photo was taken and what of it counts: kept with its row, drawn below it. Enum numbers and
names must not change."""

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    IntVectorProperty,
    StringProperty,
)

from ...capture.background import TOLERANCE
from ...capture.request import MOST_ERODED
from ..pictures import mask
from ..texts import field

BACKGROUND_ITEMS = (
    ("NONE", "Counts", "Nothing is taken for background", 0),
    ("BORDER", "From the Border", "What joins the photo's border in one colour does not count", 1),
    ("COLOR", "By Colour", "What has a colour does not count", 2),
)
RESPONSE_ITEMS = (
    ("AUTO", "By File", "Colour profile and format of the file", 0),
    ("SRGB", "sRGB", "The sRGB curve", 1),
    ("LINEAR", "Linear", "Code values are proportional to light", 2),
    ("GAMMA", "Power", "Light is a power of the code value", 3),
    ("TABLE", "Table", "A CSV of code values and light", 4),
)
GAIN_ITEMS = (
    ("NONE", "None", "Exposure and white balance are those of the scene", 0),
    ("SCALAR", "Exposure", "The fit finds one factor for the photo", 1),
    ("RGB", "Exposure and White Balance", "The fit finds a factor for each channel", 2),
)
#: In their order in the panel.
LENS = ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4", "p1", "p2", "p3", "p4", "b2")
_MOST_PIXELS = 100_000


def _lens(name: str, default: float, text: str, digits: int = 5) -> FloatProperty:
    return FloatProperty(name=name, default=default, precision=digits, description=text)


class SeleniteCapturePhoto(bpy.types.PropertyGroup):
    """Of one photo; the keys of docs/guide/captures.md."""

    expanded: BoolProperty(name="How It Was Taken", description="Mask, response, size and lens")
    exclude_path: StringProperty(
        name="Exclude", subtype="FILE_PATH", description="Picture whose white pixels do not count"
    )
    use_silhouette: BoolProperty(
        name="Silhouette",
        description="Only what the camera sees of the fitted objects counts",
    )
    silhouette: IntProperty(
        name="Eroded",
        default=1,
        min=0,
        max=MOST_ERODED,
        description="Pixels of the comparison that are taken off its rim",
    )
    background: EnumProperty(
        name="Background", items=BACKGROUND_ITEMS, description="What of the photo does not count"
    )
    background_color: FloatVectorProperty(
        name="Colour", subtype="COLOR", size=3, min=0.0, max=1.0, description="Of the background"
    )
    tolerance: FloatProperty(
        name="Tolerance",
        default=TOLERANCE,
        min=0.001,
        max=1.0,
        description="Largest difference of a channel, in sRGB code values from 0 to 1",
    )
    response: EnumProperty(
        name="Response", items=RESPONSE_ITEMS, description="How code values became of light"
    )
    gamma: FloatProperty(
        name="Exponent",
        default=2.2,
        min=0.1,
        max=10.0,
        description="Light is the code value to this power",
    )
    response_path: StringProperty(
        name="Table", subtype="FILE_PATH", description="CSV of code values and light"
    )
    use_clip: BoolProperty(
        name="Clip Levels", description="Only code values between two levels count"
    )
    clip: FloatVectorProperty(
        name="Lowest and Highest",
        size=2,
        default=(0.01, 0.99),
        min=0.0,
        soft_max=1.0,
        description="Code values that count, 1 at the top of integers",
    )
    gain: EnumProperty(name="Gain", items=GAIN_ITEMS, description="Factor on the render")
    align: BoolProperty(
        name="Align", description="The fit finds a shift and roll of the photo within 4 pixels"
    )
    hold_out: BoolProperty(
        name="Hold Out",
        description="The fit does not see this photo; the result says how well it renders it",
    )
    use_size: BoolProperty(
        name="Own Size", description="The photo has another shape than the scene, or is cropped"
    )
    size: IntVectorProperty(
        name="Whole Photo",
        size=2,
        default=(1920, 1080),
        min=1,
        max=_MOST_PIXELS,
        description="Width and height of the whole photo in pixels",
    )
    use_crop: BoolProperty(name="Cropped", description="The file holds a part of the photo")
    crop: IntVectorProperty(
        name="Left, Top, Right, Bottom",
        size=4,
        default=(0, 0, 1920, 1080),
        min=0,
        max=_MOST_PIXELS,
        description="What the file holds, in pixels of the whole photo from its top left corner",
    )
    use_pixel_aspect: BoolProperty(
        name="Own Pixel Aspect", description="Its pixels have another shape than the scene's"
    )
    pixel_aspect: FloatProperty(
        name="Width / Height", default=1.0, min=0.01, max=100.0, description="Of a pixel"
    )
    use_distortion: BoolProperty(name="Distortion", description="The lens distorts the photo")
    undistorted: BoolProperty(
        name="Undistorted",
        description="The photo is free of the distortion that an import has kept with its camera",
    )
    fx: _lens("Focal Length X", 1000.0, "In pixels of the whole photo", 1)
    fy: _lens("Focal Length Y", 1000.0, "In pixels of the whole photo", 1)
    cx: _lens("Centre X", 960.0, "Principal point in pixels from the left", 1)
    cy: _lens("Centre Y", 540.0, "Principal point in pixels from the top", 1)
    k1: _lens("K1", 0.0, "Radial")
    k2: _lens("K2", 0.0, "Radial")
    k3: _lens("K3", 0.0, "Radial")
    k4: _lens("K4", 0.0, "Radial")
    p1: _lens("P1", 0.0, "Tangential, in Metashape's order")
    p2: _lens("P2", 0.0, "Tangential, in Metashape's order")
    p3: _lens("P3", 0.0, "Tangential, of the slope's square")
    p4: _lens("P4", 0.0, "Tangential, of the slope's fourth power")
    b2: _lens("B2", 0.0, "Skew in pixels of the whole photo")


def draw(layout: bpy.types.UILayout, photo: bpy.types.PropertyGroup) -> None:
    """A box that opens; what is switched off shows its switch alone."""
    box = layout.box()
    box.prop(photo, "expanded", icon="TRIA_DOWN" if photo.expanded else "TRIA_RIGHT", emboss=False)
    if not photo.expanded:
        return
    column = box.column()
    field(column, photo, "exclude_path")
    _switched(column, photo, "use_silhouette", "silhouette")
    field(column, photo, "background")
    if photo.background == "COLOR":
        field(column, photo, "background_color")
    if photo.background != "NONE":
        field(column, photo, "tolerance")
    mask.draw(box)
    column = box.column()
    field(column, photo, "response")
    if photo.response in {"GAMMA", "TABLE"}:
        field(column, photo, "gamma" if photo.response == "GAMMA" else "response_path")
    _switched(column, photo, "use_clip", "clip")
    field(column, photo, "gain")
    field(column, photo, "align")
    field(column, photo, "hold_out")
    _switched(column, photo, "use_size", "size")
    if photo.use_size:
        _switched(column, photo, "use_crop", "crop")
    _switched(column, photo, "use_pixel_aspect", "pixel_aspect")
    _switched(column, photo, "use_distortion", *LENS)
    if not photo.use_distortion:
        field(column, photo, "undistorted")


def _switched(
    column: bpy.types.UILayout, photo: bpy.types.PropertyGroup, switch: str, *names: str
) -> None:
    field(column, photo, switch)
    for name in names if getattr(photo, switch) else ():
        field(column, photo, name)


CLASSES = (SeleniteCapturePhoto,)
