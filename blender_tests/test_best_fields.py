# SPDX-License-Identifier: GPL-3.0-or-later
"""The best voxels, not the last ones: in the grid's files, in result.json and in the pictures."""

from pathlib import Path

import made_scenes as made
import numpy as np
import pytest
import recording_fit
from command_line import command

from selenite import grid_files, native

pytestmark = pytest.mark.blender

NAME, SHAPE = "Smoke:albedo_grid", (3, 3, 3, 3)


@pytest.fixture
def done(tmp_path, capsys, monkeypatch):
    """(what was recorded, the command's report) of a fit of an albedo grid of 3 x 3 x 3 voxels."""
    made.smoke()
    scene = made.save(tmp_path / "scene.blend")
    photo = made.photo(tmp_path / "photo.exr", value=0.25)
    recorded = recording_fit.install(monkeypatch, shapes={NAME: SHAPE})
    status, report, printed = command(
        capsys, "fit", scene, f"--fit={NAME}", f"--grid={NAME}=3", f"--photo=Camera={photo}",
        "--height=12", "--picture-spp=64", "--seed=5", f"--out={tmp_path / 'fits'}",
    )  # fmt: skip
    assert status == 0, printed
    return recorded, report


def test_files_and_result_have_the_best_voxels(done):
    recorded, report = done
    best = recorded.fit.fields(recording_fit.BEST)[NAME]
    row, folder = report["parameters"][NAME], Path(report["folder"])
    np.testing.assert_array_equal(grid_files.read(str(folder / row["files"][0])), best)
    assert row["value"] == pytest.approx(best.mean(axis=(0, 1, 2)), abs=1e-6)
    assert row["initial"] == pytest.approx([0.5] * 3)
    assert report["best_iteration"] == recording_fit.BEST_ITERATION


def test_the_optimised_picture_is_of_the_best_voxels(done):
    """The same picture again, made by hand: the same seed draws the same paths."""
    recorded, report = done
    initial, optimised = recorded.pictures
    best = recorded.fit.fields(recording_fit.BEST)[NAME]
    film = native.core().render(
        initial.scene.with_grid("Smoke", "albedo", best), "Camera", *optimised.size, 64, seed=5,
        frame=optimised.frame,
    )  # fmt: skip
    shown = native.image().read(str(Path(report["folder"]) / "Camera_optimised.exr"))[0]
    np.testing.assert_allclose(shown, film.image, rtol=1e-5, atol=1e-6)
    last = recorded.fit.fields(recording_fit.LAST)[NAME]
    other = native.core().render(
        initial.scene.with_grid("Smoke", "albedo", last), "Camera", *optimised.size, 64, seed=5
    )
    assert np.abs(other.image - shown).max() > 0.05
