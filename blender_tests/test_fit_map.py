# SPDX-License-Identifier: GPL-3.0-or-later
"""Images of other parameters than the base colour: found, written as numbers, shown by nodes."""

import bpy
import made_scenes as made
import numpy as np
import pytest
from command_line import command

from selenite import native
from selenite.fit import fields
from selenite.fit.request import UnknownRequest
from selenite.fit.settings import FitSettings
from selenite.scene_read import hosts
from selenite.scene_read.blend_file import open_blend
from selenite.scene_read.build import build

pytestmark = pytest.mark.blender

NAME = "Body:alpha_texture"


def board(**values):
    """A dark board, so that light between its faces is next to nothing."""
    return made.board(**{"base_color": (0.1, 0.1, 0.1), "roughness": 0.5} | values)


def inputs():
    return made.principled(bpy.data.materials["Body"]).inputs


def field_of(name, **values):
    problems = []
    request = UnknownRequest(*name.split(":"), **values)
    found = fields.choose(made.read(), [request], [], FitSettings(), problems)
    return found[0] if found else str([item.line() for item in problems])


def truth():
    """(4, 4, 1): between 0.1 and 0.7."""
    return np.linspace(0.1, 0.7, 16, dtype=np.float32).reshape(4, 4, 1)


def test_a_fit_finds_the_numbers_and_the_saved_scene_shows_them(tmp_path, capsys):
    board()
    path = made.save(tmp_path / "scene.blend")
    field = field_of(NAME, grid="4").starting_at(truth())
    film = native.core().render(
        build(fields.with_fields(made.read(), [field])), "Camera", 24, 24, 1024, seed=99
    )
    native.image().write_exr(str(tmp_path / "photo.exr"), film.image)
    saved = tmp_path / "fitted.blend"
    status, report, _ = command(
        capsys, "fit", path, "--fit", NAME, "--photo", f"Camera={tmp_path / 'photo.exr'}",
        "--height", "24", "--threads", "1", "--out", str(tmp_path / "out"), "--iterations", "150",
        "--spp", "8", "--grid", f"{NAME}=4", "--save", str(saved), "--check-in-cycles",
    )  # fmt: skip
    assert status == 0, report
    row = report["parameters"][NAME]
    assert row["files"] == ["Body_alpha.png", "Body_alpha_coverage.png"]
    found, _, about = native.image().read(f"{report['folder']}/{row['files'][0]}", as_linear=False)
    assert about["bit_depth"] == 16
    assert np.abs(found[..., :1] - truth()).max() < 0.05
    ours = report["cycles"]["photos"]["Camera"]["native_against_cycles"]
    assert abs(ours["relative_bias"]) < 6 * ours["relative_bias_noise"] + 0.005
    open_blend(str(saved))
    image = inputs()["Alpha"].links[0].from_node.image
    assert hosts.is_data(image)
    texture = made.read().materials[0].maps["alpha"].texture
    assert not texture.encoded
    assert np.abs(texture.pixels - found).max() < 1e-4


def test_a_coloured_image_of_a_number_starts_as_its_luminance(tmp_path):
    item = board()
    native.image().write_png(str(tmp_path / "gloss.png"), np.full((2, 2, 3), (0.2, 0.5, 0.9), "f4"))
    tree = item.data.materials[0].node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.load(str(tmp_path / "gloss.png"))
    tree.links.new(node.outputs["Color"], made.socket(item.data.materials[0], "roughness"))
    field = field_of("Body:roughness_texture")
    assert field.values.shape == (2, 2, 1)
    assert not field.texture.encoded
    expected = 0.2126729 * 0.2 + 0.7151522 * 0.5 + 0.0721750 * 0.9
    assert np.allclose(field.values, expected, atol=0.005)
    before = native.core().render(build(made.read()), "Camera", 24, 24, 64).image
    with_field = build(fields.with_fields(made.read(), [field]))
    after = native.core().render(with_field, "Camera", 24, 24, 64).image
    assert np.allclose(after, before, rtol=1e-3)


def test_two_images_of_a_material_are_fitted_together(tmp_path, capsys):
    board()
    path = made.save(tmp_path / "scene.blend")
    names = ["Body:base_color_texture", NAME]
    wanted = [field_of(name, grid="2") for name in names]
    shown = build(fields.with_fields(made.read(), wanted))
    film = native.core().render(shown, "Camera", 24, 24, 256, seed=99)
    native.image().write_exr(str(tmp_path / "photo.exr"), film.image)
    status, report, _ = command(
        capsys, "fit", path, "--fit", "Body:base_color_texture,alpha_texture",
        "--photo", f"Camera={tmp_path / 'photo.exr'}", "--height", "24", "--threads", "1",
        "--out", str(tmp_path / "out"), "--iterations", "10", "--spp", "4",
        *(text for name in names for text in ("--grid", f"{name}=2")),
        "--save", str(tmp_path / "fitted.blend"),
    )  # fmt: skip
    assert status == 0, report
    assert {name: report["parameters"][name]["texels"] for name in names} == {
        name: [2, 2] for name in names
    }
    assert not any(inputs()[name].is_linked for name in ("Base Color", "Alpha"))  # as it was
    open_blend(str(tmp_path / "fitted.blend"))
    assert {*made.read().materials[0].maps} == {"base_color", "alpha"}
