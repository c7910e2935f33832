# SPDX-License-Identifier: GPL-3.0-or-later
"""The parameters with a value at every place, by name."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Family(Enum):
    """Kinds that are read, started, listed and written alike."""

    GRID = "grid"
    IMAGE = "image"
    NODE_IMAGE = "image of a node"
    COLORS = "colours of a mesh"
    SHAPE = "shape of a mesh"
    ENVIRONMENT = "image of the world"


#: What each family is of, as in the table of parameters.
_OWNERS = {
    Family.GRID: "material",
    Family.IMAGE: "material",
    Family.NODE_IMAGE: "material",
    Family.COLORS: "object",
    Family.SHAPE: "object",
    Family.ENVIRONMENT: "world",
}


@dataclass(frozen=True)
class FieldKind:
    """`parameter`: its name among those of its owner. `use`: what it gives (of a grid the key of
    `MaterialValues.grids`, of an image that of `MaterialValues.maps`). `channels`: where it starts
    as a constant. `single`: the parameter in whose place it stands, "" for none. `help`: one
    sentence. `label`: what the panel calls it, "" where that follows from its use. `starts`: words
    that `--grid` takes beside a number and a file. `bounds`: the usual ones of the panel. `rate`:
    the usual learning rate, 0 where it is the fit's."""

    parameter: str
    family: Family
    use: str
    channels: int
    single: str
    help: str
    label: str = ""
    starts: tuple[str, ...] = ()
    bounds: tuple[float, float] = (0.0, 1.0)
    rate: float = 0.0

    @property
    def of(self) -> str:
        """The kind of its owner, as in the table of parameters."""
        return _OWNERS[self.family]

    @property
    def is_image(self) -> bool:
        """Whether it is an image on a surface."""
        return self.family in (Family.IMAGE, Family.NODE_IMAGE)

    @property
    def is_of_mesh(self) -> bool:
        """Whether an object owns it."""
        return self.of == "object"

    @property
    def is_shape(self) -> bool:
        """Whether it gives the shape of an object's mesh."""
        return self.family is Family.SHAPE

    @property
    def is_surface(self) -> bool:
        """Whether photos see some of its places and not others."""
        return self.is_image or self.family is Family.COLORS

    @property
    def is_of_body(self) -> bool:
        """Whether it is an image on a surface, or belongs to a mesh: `write_back.surfaces` shows
        these."""
        return self.is_image or self.is_of_mesh

    @property
    def is_grid(self) -> bool:
        """Whether it lies in a medium."""
        return self.family is Family.GRID

    @property
    def is_environment(self) -> bool:
        """Whether it lies around the scene: the image of the world."""
        return self.family is Family.ENVIRONMENT


#: Parameters of a surface that an image can give, with the numbers of a texel.
IMAGES = {
    "base_color": 3, "roughness": 1, "metallic": 1, "alpha": 1, "transmission": 1,
    "specular_level": 1, "specular_tint": 3, "diffuse_roughness": 1, "coat_weight": 1,
    "coat_roughness": 1, "coat_tint": 3, "sheen_weight": 1, "sheen_roughness": 1, "sheen_tint": 3,
    "emission_color": 3, "subsurface_weight": 1,
}  # fmt: skip
#: Ends the name of the image of a node.
NODE_IMAGE = ".image"
#: In place of a file at which colours of a mesh start: a new attribute.
NEW = "new"


def _image(use: str, channels: int) -> FieldKind:
    words = use.replace("_", " ").replace("color", "colour").capitalize()
    help_text = f"{words} at each texel of an image on the surface"
    return FieldKind(f"{use}_texture", Family.IMAGE, use, channels, use, help_text)


KINDS = {
    kind.parameter: kind
    for kind in (
        FieldKind(
            "albedo_grid", Family.GRID, "albedo", 3, "albedo",
            "Albedo at each voxel of a grid over the object",
        ),
        FieldKind(
            "density_grid", Family.GRID, "density", 1, "",
            "Number at each voxel that multiplies extinction",
        ),
        *(_image(use, channels) for use, channels in IMAGES.items()),
        FieldKind(
            "vertex_colors", Family.COLORS, "vertex_colors", 3, "",
            "Colour at each vertex or corner of the object's mesh, as its colour attribute",
            label="Vertex Colors", starts=(NEW,),
        ),
        FieldKind(
            "vertex_positions", Family.SHAPE, "vertex_positions", 3, "",
            "Position of each vertex of the object's mesh, in the object's own space",
            label="Vertex Positions",
            # How far a vertex may leave the bounding box of the start, in sizes of the box; the
            # largest step, in its diagonals.
            bounds=(-0.5, 0.5), rate=0.01,
        ),
        FieldKind(
            "environment", Family.ENVIRONMENT, "environment", 3, "color",
            "Light from each direction of the world, as an image that its strength multiplies",
        ),
    )
}  # fmt: skip
#: Parameter with one value -> the field that takes its place.
IN_PLACE_OF = {kind.single: kind.parameter for kind in KINDS.values() if kind.single}


def kind_of(parameter: str) -> FieldKind | None:
    """That of a name, None if it is a parameter with one value. Every node has its own name."""
    if parameter.endswith(NODE_IMAGE):
        help_text = "Each texel of the image of a node"
        return FieldKind(parameter, Family.NODE_IMAGE, "graph", 3, "", help_text)
    return KINDS.get(parameter)


def field_kind(parameter: str) -> FieldKind:
    """The same of a name that is one's."""
    found = kind_of(parameter)
    if found is None:
        raise KeyError(parameter)
    return found
