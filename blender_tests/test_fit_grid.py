# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite fit --fit Body:albedo_grid`: from a photo to .vol and .npy."""

import bpy
import made_scenes as made
import numpy as np
import pytest
from command_line import command

from selenite import grid_files, native
from selenite.fit import fields
from selenite.fit.request import UnknownRequest
from selenite.fit.settings import FitSettings
from selenite.scene_read.build import build

pytestmark = pytest.mark.blender


def requested(**values):
    """The one field of the open scene that is asked for so."""
    problems = []
    found = fields.choose(
        made.read(), [UnknownRequest("Smoke", "albedo_grid", **values)], [], FitSettings(), problems
    )
    return found[0] if found else [item.line() for item in problems]


@pytest.fixture
def photo(tmp_path):
    """The scene in a file, and its picture with an upper half of albedo 0.9, a lower one of 0.2."""
    made.smoke()
    path = made.save(tmp_path / "scene.blend")
    truth = np.full((4, 4, 4, 3), 0.2, np.float32)
    truth[:, 2:] = 0.9
    grid_files.write_npy(tmp_path / "truth.npy", truth)
    field = requested(grid=str(tmp_path / "truth.npy"))
    scene = build(fields.with_fields(made.read(), [field]))
    film = native.core().render(scene, "Camera", 32, 24, 512, seed=99)
    native.image().write_exr(str(tmp_path / "photo.exr"), film.image)
    return path, tmp_path / "photo.exr", truth


def fit(capsys, tmp_path, path, picture, *more):
    return command(
        capsys, "fit", path, "--fit", "Smoke:albedo_grid", "--photo", f"Camera={picture}",
        "--height", "12", "--threads", "1", "--out", str(tmp_path / "out"), *more,
    )  # fmt: skip


def test_a_fit_tells_the_halves_apart_and_writes_both_files(photo, tmp_path, capsys):
    path, picture, truth = photo
    status, report, _ = fit(
        capsys, tmp_path, path, picture, "--grid", "Smoke:albedo_grid=4", "--iterations", "40",
        "--spp", "8", "--seed", "3",
    )  # fmt: skip
    assert status == 0, report
    folder = tmp_path / "out" / report["folder"]
    row = report["parameters"]["Smoke:albedo_grid"]
    assert row["voxels"] == [4, 4, 4]
    assert row["files"] == ["Smoke_albedo.npy", "Smoke_albedo.vol"]
    found = grid_files.read(str(folder / "Smoke_albedo.npy"))
    assert np.array_equal(found, grid_files.read(str(folder / "Smoke_albedo.vol")))
    assert np.allclose(row["value"], found.mean(axis=(0, 1, 2)), atol=1e-5)
    assert found.min() >= 0
    assert found.max() <= 1
    # The camera looks down on z: what it sees best is the inner part of the two halves in y.
    upper, lower = found[1:3, 2, 1:3].mean(), found[1:3, 1, 1:3].mean()
    # Two thirds of the true contrast at least: some of it goes into voxels that hardly show.
    assert upper - lower == pytest.approx(0.7, abs=0.23), (upper, lower)
    assert (upper, lower) == pytest.approx((0.9, 0.2), abs=0.15)
    history = np.genfromtxt(folder / "history.csv", delimiter=",", names=True)
    assert history["loss"][-1] < 0.2 * history["loss"][0]
    assert "Smokealbedo_grid_meanr" in history.dtype.names
    assert (folder / "Camera_optimised.exr").is_file()


def test_a_run_file_repeats_the_fit(photo, tmp_path, capsys):
    path, picture, _ = photo
    words = ("--start", "Smoke:albedo_grid=0.4", "--grid", "Smoke:albedo_grid=3")
    status, first, _ = fit(
        capsys, tmp_path, path, picture, "--iterations", "3", "--bounds",
        "Smoke:albedo_grid=0.1,0.8", *words,
    )  # fmt: skip
    assert status == 0, first
    run = tmp_path / "out" / first["folder"] / "run.json"
    status, second, _ = command(capsys, "fit", str(run), "--out", str(tmp_path / "again"))
    assert status == 0, second
    one, two = (grid_files.read(f"{item['folder']}/Smoke_albedo.npy") for item in (first, second))
    assert np.array_equal(one, two)
    assert one.shape == (3, 3, 3, 3)
    assert np.ptp(one) > 0


def test_the_grid_lies_over_the_object_and_starts_at_its_albedo():
    made.smoke(colour=0.5)
    bpy.context.object.location = (3, 0, -1)
    bpy.context.object.scale = (2, 1, 0.5)
    field = requested()
    assert field.start.values.shape == (4, 8, 16, 3)
    assert np.allclose(field.start.values, 0.5)
    low, high = field.box()
    assert np.allclose(low, (1, -1, -1.5), atol=1e-5)
    assert np.allclose(high, (5, 1, -0.5), atol=1e-5)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"grid": "0"}, "give 1 to 512"),
        ({"grid": "/nowhere/grid.vol"}, "cannot be read"),
        ({"start": (2.0,)}, "in [0, 1]"),
        ({"minimum": 0.5, "maximum": 0.5}, "not an interval inside [0, 1]"),
        ({"learning_rate": 0.0}, "learning rate is 0.0"),
    ],
)
def test_what_cannot_be_fitted_is_refused_by_name(values, words):
    made.smoke()
    text = str(requested(**values))
    assert "Smoke:albedo_grid" in text or "grid.vol" in text
    assert words in text


def test_a_material_without_medium_has_no_albedo_grid():
    made.studio()
    problems = []
    request = UnknownRequest("Body", "albedo_grid")
    assert not fields.choose(made.read(), [request], [], FitSettings(), problems)
    assert "has no medium" in problems[0].line()
