# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite fit --fit Body:base_color_texture`: from a photo to an image file and its coverage."""

from pathlib import Path

import bpy
import made_scenes as made
import numpy as np
import pytest
from command_line import command
from made_images import decoded, encoded

from selenite import native
from selenite.fit import fields
from selenite.fit.request import UnknownRequest
from selenite.fit.settings import FitSettings
from selenite.scene_read.blend_file import open_blend
from selenite.scene_read.build import build

pytestmark = pytest.mark.blender

NAME = "Body:base_color_texture"


def truth():
    """(4, 4, 3) sRGB: red above, blue below, brighter to the right."""
    pixels = np.empty((4, 4, 3), np.float32)
    pixels[:2], pixels[2:] = (0.8, 0.3, 0.3), (0.3, 0.4, 0.8)
    return pixels * np.linspace(0.7, 1.1, 4, dtype=np.float32)[None, :, None]


def requested(**values):
    """The one field of the open scene that is asked for so, or what is wrong."""
    problems = []
    found = fields.choose(
        made.read(), [UnknownRequest(*NAME.split(":"), **values)], [], FitSettings(), problems
    )
    return found[0] if found else str([item.line() for item in problems])


def picture(path, pixels):
    native.image().write_png(str(path), decoded(pixels), bit_depth=16)
    return str(path)


@pytest.fixture
def photo(tmp_path):
    """A board in a file, and its picture with the true image."""
    made.board()
    path = made.save(tmp_path / "scene.blend")
    field = requested(grid=picture(tmp_path / "truth.png", truth()))
    film = native.core().render(
        build(fields.with_fields(made.read(), [field])), "Camera", 24, 24, 1024, seed=99
    )
    native.image().write_exr(str(tmp_path / "photo.exr"), film.image)
    return path, str(tmp_path / "photo.exr")


def fit(capsys, tmp_path, photo, *more):
    return command(
        capsys, "fit", photo[0], "--fit", NAME, "--photo", f"Camera={photo[1]}", "--height", "24",
        "--threads", "1", "--out", str(tmp_path / "out"), *more,
    )  # fmt: skip


def test_a_fit_finds_the_image_and_the_saved_scene_shows_it(photo, tmp_path, capsys):
    saved = tmp_path / "fitted.blend"
    status, report, _ = fit(
        capsys, tmp_path, photo, "--grid", f"{NAME}=4", "--iterations", "120", "--spp", "8",
        "--save", str(saved), "--check-in-cycles",
    )  # fmt: skip
    assert status == 0, report
    row = report["parameters"][NAME]
    assert row["texels"] == [4, 4]
    assert row["files"] == ["Body_base_color.png", "Body_base_color_coverage.png"]
    assert row["seen"] == 1
    assert report["model"].startswith("surface")
    found, _, about = native.image().read(f"{report['folder']}/{row['files'][0]}", as_linear=False)
    assert about["bit_depth"] == 16
    assert np.abs(found - truth()).max() < 0.05
    assert np.allclose(row["value"], decoded(found).mean(axis=(0, 1)), atol=1e-4)
    ours = report["cycles"]["photos"]["Camera"]["native_against_cycles"]
    assert abs(ours["relative_bias"]) < 6 * ours["relative_bias_noise"] + 0.005
    # The open file is as it was; the saved one has the image.
    assert not made.socket(bpy.data.materials["Body"], "base_color").is_linked
    open_blend(str(saved))
    values = made.read()
    assert not values.problems
    texture = values.materials[0].maps["base_color"].texture
    assert np.abs(texture.pixels - found).max() < 1e-4
    assert texture.encoded


def test_report_and_history_tell_the_same_mean(photo, tmp_path, capsys):
    """Also where texels that no photo sees are as before, which changes the mean of the file."""
    bpy.data.objects["Camera"].data.ortho_scale = 1.2  # part of the board
    scene = made.save(tmp_path / "part.blend")
    status, report, said = fit(
        capsys, tmp_path, (scene, photo[1]), "--grid", f"{NAME}=8", "--iterations", "15",
        "--unseen", f"{NAME}=keep",
    )  # fmt: skip
    assert status == 0, report
    row = report["parameters"][NAME]
    history = np.genfromtxt(f"{report['folder']}/history.csv", delimiter=",", names=True)
    means = np.stack([history[f"Bodybase_color_texture_mean{c}"] for c in "rgb"], axis=1)
    assert np.allclose(means[0], row["initial"], atol=1e-6)
    assert np.allclose(means[history["iteration"] == report["best_iteration"]], row["value"])
    line = next(line for line in said.splitlines() if line.startswith(f"{NAME}, mean red"))
    assert line.split()[-2:] == ["0.5", f"{row['value'][0]:.4g}"]
    kept, _, _ = native.image().read(f"{report['folder']}/{row['files'][0]}")
    assert row["seen"] < 0.7 and np.abs(kept.mean(axis=(0, 1)) - row["value"]).max() > 0.02


def test_too_few_iterations_are_reported_with_the_cure(photo, tmp_path, capsys):
    words = ("--grid", f"{NAME}=4", "--tolerance", "0", "--spp", "8", "--iterations")
    status, report, said = fit(capsys, tmp_path, photo, *words, "8")
    assert status == 0, report
    (reported,) = [text for text in report["warnings"] if "still falling" in text]
    assert f"warning: {reported}" in said
    assert "give more Iterations, such as 16" in reported
    assert reported in (Path(report["folder"]) / "log.txt").read_text(encoding="utf-8")
    status, report, said = fit(capsys, tmp_path, photo, *words, "120")
    assert (status, report["stopped_because"]) == (0, "all iterations done")
    assert "still falling" not in said


def test_a_run_file_repeats_the_fit(photo, tmp_path, capsys):
    status, first, _ = fit(
        capsys, tmp_path, photo, "--iterations", "3", "--grid", f"{NAME}=3", "--start",
        f"{NAME}=0.4", "--bounds", f"{NAME}=0.1,0.8", "--unseen", f"{NAME}=keep",
    )  # fmt: skip
    assert status == 0, first
    run = f"{first['folder']}/run.json"
    status, second, _ = command(capsys, "fit", run, "--out", str(tmp_path / "again"))
    assert status == 0, second
    one, two = (
        native.image().read(f"{item['folder']}/Body_base_color.png", as_linear=False)[0]
        for item in (first, second)
    )
    assert np.array_equal(one, two)
    assert one.shape == (3, 3, 3)
    assert np.ptp(one) > 0


def test_colour_then_texture_starts_the_image_at_the_fitted_colour(photo, tmp_path, capsys):
    status, report, _ = fit(
        capsys, tmp_path, photo, "--fit", "Body:base_color,roughness", "--grid", f"{NAME}=4",
        "--stages", "colours-first", "--iterations", "10", "--spp", "8",
    )  # fmt: skip
    assert status == 0, report
    first, second = report["stages"]
    assert first["parameters"] == ["Body:base_color"]
    assert sorted(second["parameters"]) == [NAME, "Body:roughness"]
    colour = np.array(report["parameters"]["Body:base_color"]["value"])
    linear = decoded(truth())
    assert (linear.min(axis=(0, 1)) < colour).all()
    assert (colour < linear.max(axis=(0, 1))).all()
    history = np.genfromtxt(f"{report['folder']}/history.csv", delimiter=",", names=True)
    rows = history[history["stage"] == 2]
    means = [rows[f"Bodybase_color_texture_mean{c}"][0] for c in "rgb"]
    assert np.allclose(means, colour, atol=1e-4)


@pytest.mark.parametrize("unseen", ["keep", "fill"])
def test_what_no_photo_sees_is_kept_or_filled(photo, tmp_path, capsys, unseen):
    # Looked up shrunk by half, the middle of the image alone is seen.
    open_blend(photo[0])
    layer = bpy.data.objects["Board"].data.uv_layers[0]
    layer.data.foreach_set("uv", [0.3, 0.3, 0.7, 0.3, 0.7, 0.7, 0.3, 0.7])
    path = made.save(tmp_path / "middle.blend")
    status, report, _ = fit(
        capsys, tmp_path, (path, photo[1]), "--grid", f"{NAME}=16", "--iterations", "10",
        "--unseen", f"{NAME}={unseen}",
    )  # fmt: skip
    assert status == 0, report
    row = report["parameters"][NAME]
    assert 0.2 < row["seen"] < 0.45
    folder = report["folder"]
    coverage = native.image().read(f"{folder}/{row['files'][1]}", as_linear=False)[0][..., 0]
    assert coverage[0, 0] == 0
    assert coverage[7, 7] > 0.2
    found = native.image().read(f"{folder}/{row['files'][0]}", as_linear=False)[0]
    start = encoded(0.5)
    untouched = np.abs(found - start).max(axis=2) < 1e-4
    assert not untouched[6:10, 6:10].any()
    assert untouched[0, 0] == (unseen == "keep")
    if unseen == "fill":  # from what is nearest: red above, blue below
        assert found[0, 8, 0] > found[0, 8, 2] + 0.1
        assert found[15, 8, 2] > found[15, 8, 0] + 0.1


def image_of(material, pixels, encoded=True):
    """Links a packed image, (h, w, 3) as it is stored, to the base colour."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.new("own", width, height, float_buffer=not encoded)
    flipped = np.ones((height, width, 4), np.float32)
    flipped[..., :3] = pixels[::-1]
    image.pixels.foreach_set(flipped.ravel())
    image.pack()
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image, node.extension = image, "EXTEND"
    made.link(material, node.outputs["Color"])


def test_it_starts_at_the_scenes_image_a_colour_or_a_file(tmp_path):
    item = made.board()
    new = requested()
    assert (new.values.shape, new.unseen) == ((256, 256, 3), "fill")
    assert np.allclose(requested(grid="8").values, encoded(0.5))
    grey = np.round(np.full((2, 3, 3), 0.25) * 255) / 255
    image_of(item.data.materials[0], grey)
    own = requested()
    assert (own.values.shape, own.texture.extension, own.unseen) == ((2, 3, 3), "EXTEND", "keep")
    assert np.allclose(own.values, grey, atol=1e-6)
    assert own.files[0] == "Body_base_color.png"
    coloured = requested(start=(0.1, 0.2, 0.3))
    assert coloured.values.shape == (2, 3, 3)
    assert np.allclose(decoded(coloured.values)[1, 1], (0.1, 0.2, 0.3), atol=1e-5)
    larger = requested(grid="5")
    assert (larger.values.shape, larger.unseen) == ((5, 5, 3), "fill")
    file = requested(grid=picture(tmp_path / "truth.png", truth()))
    assert np.abs(file.values - truth()).max() < 1e-4
    native.image().write_exr(str(tmp_path / "linear.exr"), truth())
    linear = requested(grid=str(tmp_path / "linear.exr"))
    assert np.array_equal(linear.values, truth())
    assert linear.files[0] == "Body_base_color.exr"


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"grid": "0"}, "give 1 to 8192"),
        ({"grid": "/nowhere/wood.png"}, "cannot be read"),
        ({"start": (2.0,)}, "give 1 or 3 numbers in [0, 1]"),
        ({"minimum": 0.5, "maximum": 0.5}, "not an interval inside [0, 1]"),
        ({"learning_rate": 0.0}, "learning rate is 0.0"),
        ({"unseen": "paint"}, "give 'keep', 'fill'"),
    ],
)
def test_what_cannot_be_fitted_is_refused_by_name(values, words):
    made.board()
    text = requested(**values)
    assert NAME in text
    assert words in text


@pytest.mark.skipif(bpy.app.version < (4, 0), reason="no subsurface scattering in the model")
def test_an_image_over_subsurface_scattering_can_be_fitted():
    nodes = made.board().active_material.node_tree.nodes
    nodes["Principled BSDF"].inputs["Subsurface Weight"].default_value = 1.0
    field = requested(start=(0.6, 0.4, 0.2))
    assert not isinstance(field, str), field
    assert field.name == NAME


def test_an_object_without_uv_map_is_refused():
    item = made.board()
    item.data.uv_layers.remove(item.data.uv_layers[0])
    assert "'Board' has no UV map" in requested()
    assert "Smart UV Project" in requested()
