# SPDX-License-Identifier: GPL-3.0-or-later
"""The parameters with a value at every place, by name."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class FieldKind:
    """`parameter`: its name among those of its owner. `use`: what it gives (of a grid the key of
    `MaterialValues.grids`, of an image that of `MaterialValues.maps`). `channels`: where it starts
    as a constant. `single`: the parameter in whose place it stands, "" for none. `help`: one
    sentence."""

    parameter: str
    use: str
    channels: int
    single: str
    help: str

    @property
    def of(self) -> str:
        """The kind of its owner, as in the table of parameters."""
        if self.is_mesh or self.is_shape:
            return "object"
        return "world" if self.is_environment else "material"

    @property
    def is_image(self) -> bool:
        """Whether it is an image on a surface."""
        return self.use in IMAGES or self.is_graph_image

    @property
    def is_graph_image(self) -> bool:
        """Whether it is the image of a node, not that of a parameter."""
        return self.use == GRAPH_IMAGE

    @property
    def is_mesh(self) -> bool:
        """Whether it gives the colours of an object's mesh."""
        return self.use == VERTEX_COLORS

    @property
    def is_shape(self) -> bool:
        """Whether it gives the shape of an object's mesh."""
        return self.use == VERTEX_POSITIONS

    @property
    def is_surface(self) -> bool:
        """Whether photos see some of its places and not others."""
        return self.is_image or self.is_mesh

    @property
    def is_of_body(self) -> bool:
        """Whether it is an image on a surface, or belongs to a mesh: `write_back.surfaces` shows
        these."""
        return self.is_surface or self.is_shape

    @property
    def is_grid(self) -> bool:
        """Whether it lies in a medium."""
        return self.use in ("albedo", "density")

    @property
    def is_environment(self) -> bool:
        """Whether it lies around the scene: the image of the world."""
        return self.use == "environment"


#: Parameters of a surface that an image can give, with the numbers of a texel.
IMAGES = {
    "base_color": 3, "roughness": 1, "metallic": 1, "alpha": 1, "transmission": 1,
    "specular_level": 1, "specular_tint": 3, "diffuse_roughness": 1, "coat_weight": 1,
    "coat_roughness": 1, "coat_tint": 3, "sheen_weight": 1, "sheen_roughness": 1, "sheen_tint": 3,
    "emission_color": 3, "subsurface_weight": 1,
}  # fmt: skip
VERTEX_COLORS, VERTEX_POSITIONS = "vertex_colors", "vertex_positions"
#: Ends the name of the image of a node; and what that gives.
NODE_IMAGE, GRAPH_IMAGE = ".image", "graph"


def _image(use: str, channels: int) -> FieldKind:
    words = use.replace("_", " ").replace("color", "colour").capitalize()
    help_text = f"{words} at each texel of an image on the surface"
    return FieldKind(f"{use}_texture", use, channels, use, help_text)


KINDS = {
    kind.parameter: kind
    for kind in (
        FieldKind(
            "albedo_grid", "albedo", 3, "albedo", "Albedo at each voxel of a grid over the object"
        ),
        FieldKind(
            "density_grid", "density", 1, "", "Number at each voxel that multiplies extinction"
        ),
        *(_image(use, channels) for use, channels in IMAGES.items()),
        FieldKind(
            VERTEX_COLORS, VERTEX_COLORS, 3, "",
            "Colour at each vertex or corner of the object's mesh, as its colour attribute",
        ),
        FieldKind(
            VERTEX_POSITIONS, VERTEX_POSITIONS, 3, "",
            "Position of each vertex of the object's mesh, in the object's own space",
        ),
        FieldKind(
            "environment", "environment", 3, "color",
            "Light from each direction of the world, as an image that its strength multiplies",
        ),
    )
}  # fmt: skip
#: Parameter with one value -> the field that takes its place.
IN_PLACE_OF = {kind.single: kind.parameter for kind in KINDS.values() if kind.single}


def kind_of(parameter: str) -> FieldKind | None:
    """That of a name, None if it is a parameter with one value. Every node has its own name."""
    if parameter.endswith(NODE_IMAGE):
        return FieldKind(parameter, GRAPH_IMAGE, 3, "", "Each texel of the image of a node")
    return KINDS.get(parameter)


def field_kind(parameter: str) -> FieldKind:
    """The same of a name that is one's."""
    found = kind_of(parameter)
    if found is None:
        raise KeyError(parameter)
    return found
