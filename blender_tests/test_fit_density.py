# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite fit --fit Body:density_grid`: alone, beside the albedos, from a file."""

import made_scenes as made
import numpy as np
import pytest
from command_line import command

from selenite import grid_files, native
from selenite.fit import fields
from selenite.fit.request import UnknownRequest
from selenite.fit.settings import FitSettings
from selenite.fit.unknowns import Unknown
from selenite.parameters import table
from selenite.scene_read.build import build

pytestmark = pytest.mark.blender


def requested(parameter="density_grid", **values):
    """The one field of the open scene that is asked for so, or what is wrong with it."""
    problems = []
    request = UnknownRequest("Smoke", parameter, **values)
    found = fields.choose(made.read(), [request], [], FitSettings(), problems)
    return found[0] if found else [item.line() for item in problems]


def fit(capsys, tmp_path, path, picture, *more):
    return command(
        capsys, "fit", path, "--photo", f"Camera={picture}", "--height", "12", "--threads", "1",
        "--out", str(tmp_path / "out"), *more,
    )  # fmt: skip


@pytest.fixture
def photo(tmp_path):
    """Smoke in a file, and its picture where the upper half is thick and the lower one thin."""
    made.smoke()
    path = made.save(tmp_path / "scene.blend")
    truth = np.full((4, 4, 4, 1), 0.2, np.float32)
    truth[:, 2:] = 1.6
    grid_files.write_npy(tmp_path / "truth.npy", truth)
    field = requested(grid=str(tmp_path / "truth.npy"))
    scene = build(fields.with_fields(made.read(), [field]))
    film = native.core().render(scene, "Camera", 32, 24, 512, seed=99)
    native.image().write_exr(str(tmp_path / "photo.exr"), film.image)
    return path, tmp_path / "photo.exr"


def test_a_fit_tells_thick_from_thin_and_writes_both_files(photo, tmp_path, capsys):
    status, report, _ = fit(
        capsys, tmp_path, *photo, "--fit", "Smoke:density_grid", "--grid", "Smoke:density_grid=4",
        "--iterations", "80", "--spp", "8", "--seed", "3",
    )  # fmt: skip
    assert status == 0, report
    folder = tmp_path / "out" / report["folder"]
    row = report["parameters"]["Smoke:density_grid"]
    assert row["voxels"] == [4, 4, 4]
    assert row["initial"] == [1.0]
    assert (row["minimum"], row["maximum"]) == (0, 10)
    assert row["files"] == ["Smoke_density.npy", "Smoke_density.vol"]
    found = grid_files.read(str(folder / "Smoke_density.npy"))
    assert np.array_equal(found, grid_files.read(str(folder / "Smoke_density.vol")))
    assert found.shape == (4, 4, 4, 1)
    assert found.min() >= 0
    # The camera looks down on z: what it sees best is the inner part of the two halves in y.
    upper, lower = found[1:3, 2, 1:3].mean(), found[1:3, 1, 1:3].mean()
    # Two thirds of the true contrast at least: some of it goes into voxels that hardly show.
    assert upper - lower == pytest.approx(1.4, abs=0.46), (upper, lower)
    assert (upper, lower) == pytest.approx((1.6, 0.2), abs=0.3)
    history = np.genfromtxt(folder / "history.csv", delimiter=",", names=True)
    assert history["loss"][-1] < 0.2 * history["loss"][0]
    assert "Smokedensity_grid_mean" in history.dtype.names


def test_both_grids_together_and_a_run_file_repeats_them(photo, tmp_path, capsys):
    status, first, _ = fit(
        capsys, tmp_path, *photo, "--fit", "Smoke:density_grid,albedo_grid", "--iterations", "3",
        "--grid", "Smoke:density_grid=3", "--grid", "Smoke:albedo_grid=2",
        "--start", "Smoke:density_grid=0.5", "--bounds", "Smoke:density_grid=0,0.6",
    )  # fmt: skip
    assert status == 0, first
    run = str(tmp_path / "out" / first["folder"] / "run.json")
    status, second, _ = command(capsys, "fit", run, "--out", str(tmp_path / "again"))
    assert status == 0, second
    for use, shape in (("density", (3, 3, 3, 1)), ("albedo", (2, 2, 2, 3))):
        one, two = (
            grid_files.read(f"{item['folder']}/Smoke_{use}.npy") for item in (first, second)
        )
        assert np.array_equal(one, two)
        assert one.shape == shape
        assert np.ptp(one) > 0
        if use == "density":
            assert one.max() <= np.float32(0.6)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"start": (-1.0,)}, "give one number from 0 up"),
        ({"start": (1.0, 2.0, 3.0)}, "give one number from 0 up"),
        ({"minimum": 2.0, "maximum": 1.0}, "bounds [2, 1]"),
        ({"maximum": float("inf")}, "give bounds such as 0 and 10"),
        ({"grid": "colours.npy"}, "holds colours"),
        ({"grid": "negative.npy"}, "holds -0.5"),
    ],
)
def test_what_cannot_be_fitted_is_refused_by_name(tmp_path, values, words):
    made.smoke()
    grid_files.write_npy(tmp_path / "colours.npy", np.ones((2, 2, 2, 3), np.float32))
    grid_files.write_npy(tmp_path / "negative.npy", np.full((2, 2, 2, 1), -0.5, np.float32))
    if "grid" in values:
        values = {"grid": str(tmp_path / values["grid"])}
    text = str(requested(**values))
    assert "Smoke:density_grid" in text
    assert words in text


def test_steps_count_in_the_densities_of_the_start():
    made.smoke()
    field = requested(start=(40.0,))
    assert field.maximum == 400
    assert field.native().learning_rate == pytest.approx(40 * 0.03)
    empty = requested(start=(0.0,))
    assert empty.maximum == 10
    assert empty.native().learning_rate == pytest.approx(0.03)


def test_extinction_beside_it_is_remarked():
    made.smoke()
    extinction = Unknown("Smoke", table()["material", "extinction"], (2.0,) * 3, 0.1, 10, 0.03)
    (text,) = fields.remarks([requested()], [extinction])
    assert "Smoke:density_grid" in text
    assert "only its product" in text
    assert not fields.remarks([requested("albedo_grid")], [extinction])
