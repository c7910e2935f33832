# SPDX-License-Identifier: GPL-3.0-or-later
"""The parameters with a value at every place, by name."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class FieldKind:
    """`parameter`: its name among those of its owner. `use`: what it gives (of a grid the key of
    `MaterialValues.grids`). `channels`: where it starts as a constant. `single`: the parameter in
    whose place it stands, "" for none. `help`: one sentence."""

    parameter: str
    use: str
    channels: int
    single: str
    help: str

    @property
    def of(self) -> str:
        """The kind of its owner, as in the table of parameters."""
        return "world" if self.is_environment else "material"

    @property
    def is_image(self) -> bool:
        """Whether it lies on a surface."""
        return self.use == "base_color"

    @property
    def is_grid(self) -> bool:
        """Whether it lies in a medium."""
        return self.use in ("albedo", "density")

    @property
    def is_environment(self) -> bool:
        """Whether it lies around the scene: the image of the world."""
        return self.use == "environment"


KINDS = {
    kind.parameter: kind
    for kind in (
        FieldKind(
            "albedo_grid", "albedo", 3, "albedo", "Albedo at each voxel of a grid over the object"
        ),
        FieldKind(
            "density_grid", "density", 1, "", "Number at each voxel that multiplies extinction"
        ),
        FieldKind(
            "base_color_texture", "base_color", 3, "base_color",
            "Base colour at each texel of an image on the surface",
        ),
        FieldKind(
            "environment", "environment", 3, "color",
            "Light from each direction of the world, as an image that its strength multiplies",
        ),
    )
}  # fmt: skip
#: Parameter with one value -> the field that takes its place.
IN_PLACE_OF = {kind.single: kind.parameter for kind in KINDS.values() if kind.single}
