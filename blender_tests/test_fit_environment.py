# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite fit --fit World:environment`: from photos to an Environment Texture."""

from pathlib import Path

import bpy
import made_scenes as made
import numpy as np
import pytest
from command_line import command

from selenite import native
from selenite.environments import sphere
from selenite.fit import fields
from selenite.fit.request import UnknownRequest
from selenite.fit.settings import FitSettings
from selenite.scene_read.blend_file import open_blend
from selenite.scene_read.build import build

pytestmark = pytest.mark.blender

NAME = "World:environment"
#: Rows of the saved image for each of two fitted ones, see write_back.environments.
FINER = 101
DIRECTIONS = 8


def truth():
    """(2, 4, 3): light from the right and from above, bluish from below."""
    values = np.full((2, 4, 3), 0.1, np.float32)
    values[0, 1] = (0.9, 0.8, 0.6)
    values[0, 2] = (0.4, 0.4, 0.5)
    values[1] = (0.1, 0.15, 0.3)
    return values


@pytest.fixture
def photos(tmp_path):
    """A metal ball in a hidden room, from two sides; the scene's file, and the arguments."""
    made.studio(base_color=(0.9, 0.9, 0.9), roughness=0.4)
    made.socket(bpy.data.materials["Body"], "base_color")
    bpy.data.materials["Body"].node_tree.nodes["Principled BSDF"].inputs[
        "Metallic"
    ].default_value = 1
    side = made.camera("Side")
    side.location, side.rotation_euler = (5.0, 0.0, 0.0), (np.pi / 2, 0.0, np.pi / 2)
    path = made.save(tmp_path / "scene.blend")
    values = made.read()
    (field,) = fields.choose(
        values, [UnknownRequest(*NAME.split(":"), size=DIRECTIONS)], [], FitSettings(), []
    )
    scene = build(field.in_scene(values)).with_environment(truth())
    words = []
    for name in ("Camera", "Side"):
        film = native.core().render(scene, name, 32, 24, 512, seed=99)
        native.image().write_exr(str(tmp_path / f"{name}.exr"), film.image)
        words += ["--photo", f"{name}={tmp_path / name}.exr"]
    return path, words


def fit(capsys, tmp_path, photos, *more):
    return command(
        capsys, "fit", photos[0], *photos[1], "--height", "24", "--threads", "1", "--picture-spp",
        "16", "--out", str(tmp_path / "out"), *more,
    )  # fmt: skip


def test_a_fit_finds_the_room_and_the_saved_scene_has_it(photos, tmp_path, capsys):
    saved = tmp_path / "fitted.blend"
    status, report, err = fit(
        capsys, tmp_path, photos, "--fit", NAME, "--environment-size", str(DIRECTIONS),
        "--iterations", "40", "--spp", "16", "--save", str(saved),
    )  # fmt: skip
    assert status == 0, err
    row = report["parameters"][NAME]
    assert row["texels"] == [4, 2]
    assert row["files"] == ["World_environment.exr", "World_environment.png"]
    assert "shown" in report and "now takes its light from image" in report["shown"][0]
    found = native.image().read(f"{report['folder']}/{row['files'][0]}")[0]
    assert row["value"] == pytest.approx(sphere.mean(found), rel=1e-3)
    error = np.abs(found - truth())
    print(error.mean(), error.max())
    assert error.mean() < 0.05  # of the start 0.33
    # The open file is as it was; the saved one has the image.
    assert made.read().world.image is None
    open_blend(str(saved))
    values = made.read()
    assert not values.problems
    # In finer rows, for Cycles, each fitted texel stands in the middle of its own.
    np.testing.assert_array_equal(
        values.world.image[FINER // 2 :: FINER, FINER // 2 :: FINER], found
    )
    # History: the mean over the sphere, iteration by iteration.
    head, *rows = Path(report["folder"], "history.csv").read_text().splitlines()
    columns = head.split(",")
    last = dict(zip(columns, rows[-1].split(","), strict=True))
    assert float(last[f"{NAME} mean.r"]) > 0.2
    # What it renders is what the result folder shows.
    out = tmp_path / "again.exr"
    status, _, err = command(
        capsys, "render", photos[0], "--result", report["folder"], "--capture", "Camera",
        "--spp", "16", "--out", str(out),
    )  # fmt: skip
    assert status == 0, err
    shown = native.image().read(str(out))[0]
    kept = native.image().read(f"{report['folder']}/Camera_optimised.exr")[0]
    # A fit draws paths in dark directions too: on the ball the noise is another one.
    assert np.abs(shown - kept).mean() < 0.01 * kept.mean()
    assert (shown == kept).all(axis=-1).mean() > 0.5  # where the camera sees the world


def test_what_nothing_reflects_continues_what_is_seen(photos, tmp_path, capsys):
    """A ground hides the lower half of a room that is darker than the start."""
    bpy.ops.mesh.primitive_plane_add(size=200, location=(0, 0, -1.5))
    bpy.context.object.data.materials.append(made.material("Ground", base_color=(0.5, 0.5, 0.5)))
    path = made.save(tmp_path / "ground.blend")
    values = made.read()
    request = UnknownRequest(*NAME.split(":"), size=128)
    (field,) = fields.choose(values, [request], [], FitSettings(), [])
    room = np.full((8, 16, 3), 0.2, np.float32)
    room[2, 4] = 3.0
    scene = build(field.in_scene(values)).with_environment(room)
    words = []
    for name in ("Camera", "Side"):
        film = native.core().render(scene, name, 32, 24, 256, seed=98)
        native.image().write_exr(str(tmp_path / f"{name}.exr"), film.image)
        words += ["--photo", f"{name}={tmp_path / name}.exr"]
    status, report, err = fit(
        capsys, tmp_path, (path, words), "--fit", NAME, "--environment-size", "128", "--start",
        f"{NAME}=1", "--iterations", "8", "--spp", "8",
    )  # fmt: skip
    assert status == 0, err
    row = report["parameters"][NAME]
    assert 0.4 < row["seen"] < 0.8
    found = native.image().read(f"{report['folder']}/{row['files'][0]}")[0]
    hidden, near = found[6:], found[4:6]
    assert near.min() <= hidden.min() and hidden.max() <= near.max()
    assert hidden[-1].std() < 0.2 * near.std()


def test_refusals_name_the_cure_and_write_nothing(photos, tmp_path, capsys):
    asked = [
        (("--fit", f"{NAME},strength"), "fit World:environment alone"),
        (("--fit", f"{NAME},color"), "fit one of them"),
        (("--fit", NAME, "--environment-size", "4"), "give 8 to 2048"),
        (("--fit", "Body:roughness", "--environment-size", "32"), "add --fit World:environment"),
        (("--fit", NAME, "--environment", "/no.exr"), "cannot be read (it does not exist)"),
        (("--fit", NAME, "--environment-projection", "mirror_ball"), "add --environment FILE"),
    ]
    for words, cure in asked:
        status, _, err = fit(capsys, tmp_path, photos, *words)
        assert status == 2 and cure in err, (words, err)
    assert not (tmp_path / "out").exists()


def test_a_run_goes_on_from_its_own_file(photos, tmp_path, capsys):
    """The run.json of a fit has all that the arguments said of the environment."""
    room = tmp_path / "room.exr"
    native.image().write_exr(str(room), np.full((40, 80, 3), 0.4, np.float32))
    words = ("--iterations", "2", "--spp", "2", "--search", "off")
    status, report, err = fit(
        capsys, tmp_path, photos, "--fit", NAME, "--environment", str(room), "--environment-size",
        "32", *words,
    )  # fmt: skip
    assert status == 0, err
    assert report["parameters"][NAME]["texels"] == [8, 4]
    assert report["parameters"][NAME]["initial"] == pytest.approx([0.4] * 3, rel=1e-5)
    run = f"{report['folder']}/run.json"
    status, again, err = command(capsys, "fit", run, "--out", str(tmp_path / "again"))
    assert status == 0, err
    one, two = (
        native.image().read(f"{item['folder']}/World_environment.exr")[0]
        for item in (report, again)
    )
    np.testing.assert_array_equal(one, two)


def test_the_colour_may_be_fitted_first(photos, tmp_path, capsys):
    status, report, err = fit(
        capsys, tmp_path, photos, "--fit", f"{NAME},color", "--environment-size", "8",
        "--stages", "colours-first", "--iterations", "12", "--spp", "4",
        "--save", str(tmp_path / "out.blend"),
    )  # fmt: skip
    assert status == 0, err
    assert set(report["parameters"]) == {NAME, "World:color"}
    open_blend(str(tmp_path / "out.blend"))
    assert made.read().world.image.shape == (2 * FINER, 4 * FINER, 3)
