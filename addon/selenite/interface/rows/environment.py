# SPDX-License-Identifier: GPL-3.0-or-later
"""The row and the result of the panel that are the image of the world: size, start, file."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, IntProperty

from ...environments import sphere
from ...fit.field_kinds import field_kind
from ...fit.fields.environment import (
    LEAST_SIZE,
    MOST_SIZE,
    USUAL_SIZE,
    environment_unknown,
    usual_maximum,
)
from ...fit.request import UnknownRequest
from ...fit.settings import FitSettings
from ...problems import BadInput
from ...scene_read.values import Owner, SceneValues
from .starts import chosen_file

PROJECTION_ITEMS = (
    ("equirect", "Panorama", "Equirectangular, twice as wide as high", 0),
    ("mirror_ball", "Mirror Ball", "A photo of a mirror ball along +Y, cropped to the ball", 1),
)
#: Of a row; see properties.SeleniteRow.
SIZE = IntProperty(
    name="Texels",
    default=USUAL_SIZE,
    min=LEAST_SIZE,
    max=MOST_SIZE,
    description="Directions of the world's image: 128 are 16 x 8, 512 are 32 x 16",
)
PROJECTION = EnumProperty(
    name="Projection", items=PROJECTION_ITEMS, description="What the file to start from shows"
)
PROPERTIES = ("environment_size", "projection")
NAME = "environment"


def is_environment(row: bpy.types.PropertyGroup) -> bool:
    """Whether a row or a result is the image of the world."""
    return row.parameter == NAME and row.kind == "world"


def describe(row: bpy.types.PropertyGroup, values: SceneValues, owner: Owner) -> None:
    """Fills what the list says of it, and why it cannot be fitted, if it cannot."""
    image = values.world.image
    row.width, row.unit, row.help = 3, "1", field_kind(NAME).help
    row.value = "no image" if image is None else f"{image.shape[1]} x {image.shape[0]}"
    row.reason = ""
    try:
        request = UnknownRequest(owner.name, NAME, grid=str(LEAST_SIZE))
        environment_unknown(values, request, [], FitSettings(), "")
    except BadInput as error:
        row.reason = "; ".join(f"{item.cause}: {item.cure}" for item in error.problems)


def reset(row: bpy.types.PropertyGroup, values: SceneValues) -> None:
    """The usual size; from the scene's image, or from its colour where it has none."""
    world = values.world
    row.grid_from = "new" if world.image is None else "scene"
    row.environment_size, row.projection = USUAL_SIZE, "equirect"
    row.start = world.color if world.image is None else sphere.mean(world.image)
    row.minimum, row.maximum = 0.0, usual_maximum(world)


def shown(row: bpy.types.PropertyGroup) -> list[str]:
    """The properties of a row that count now."""
    place = ["grid_path", "projection"] if row.grid_from == "file" else []
    return ["grid_from", *place, "environment_size"]


def requested(row: bpy.types.PropertyGroup, values: SceneValues, title: str) -> dict[str, object]:
    """What of the row's request is about an image. Raises BadInput."""
    own = values.world.image
    words = ("image", "panorama or a mirror ball")
    found: dict[str, object] = {"size": row.environment_size}
    found["grid"] = chosen_file(row, words, title, has_own=own is not None)
    if row.grid_from == "file":
        found["projection"] = row.projection
    elif row.grid_from == "new" and own is not None and not row.use_start:
        found["start"] = sphere.mean(own)
    return found


def fitted(scene: bpy.types.Scene) -> str:
    """The file of the scene's result; "" where there is none."""
    found = (row.grid_file for row in scene.selenite.results if is_environment(row))
    return next(found, "")
