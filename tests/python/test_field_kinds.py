# SPDX-License-Identifier: GPL-3.0-or-later
"""The parameters that an image can give, against the native table."""

from selenite import parameters
from selenite.fit.field_kinds import IMAGES, KINDS

#: Read as constants alone.
CONSTANT = {"transmission_roughness", "subsurface_anisotropy", "albedo"}


def test_every_parameter_of_a_surface_between_0_and_1_has_an_image() -> None:
    rows = parameters.of("material")
    wanted = {row.name: row.width for row in rows if (row.lower, row.upper) == (0, 1)}
    wanted = {name: width for name, width in wanted.items() if name not in CONSTANT}
    assert wanted | {"emission_color": 3} == IMAGES


def test_an_image_stands_in_place_of_its_parameter() -> None:
    for name, channels in IMAGES.items():
        kind = KINDS[f"{name}_texture"]
        assert (kind.single, kind.channels, kind.of) == (name, channels, "material")
        assert kind.is_image
        assert kind.is_surface
    assert KINDS["vertex_colors"].of == "object"
