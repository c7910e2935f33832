# SPDX-License-Identifier: GPL-3.0-or-later
"""Which file of a folder is the photo of which camera, and where a reconstruction is placed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from selenite.importers.lens import blender_lens, intrinsics_of
from selenite.importers.photo_folder import files_by_path, match_masks, match_photos, short_name
from selenite.importers.placement import Placement, placement_of, plane_rotation, why_no_plane
from selenite.importers.reconstruction import (
    Intrinsics,
    ReconstructedCamera,
    ReconstructedMesh,
    Reconstruction,
)
from selenite.problems import Problem
from selenite.scene_read.lens import LensDistortion


def camera(label: str, photo: str = "", place: tuple = (0, 0, 0)) -> ReconstructedCamera:
    matrix = np.eye(4)
    matrix[:3, 3] = place
    return ReconstructedCamera(label, matrix, photo=photo)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    def add(*names: str) -> Path:
        for name in names:
            file = tmp_path / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.touch()
        return tmp_path

    return add  # type: ignore[return-value]


@pytest.mark.parametrize(
    ("label", "photo", "file"),
    [
        ("IMG_1", "", "IMG_1.jpg"),
        ("IMG_1.JPG", "", "img_1.jpg"),
        ("img_1", "", "deep/er/IMG_1.TIF"),
        ("C:\\shots\\IMG_1.JPG", "", "IMG_1.png"),
        ("/photos/shots/IMG_1", "", "IMG_1.exr"),
        ("camera 7", "shots/IMG_1.jpg", "IMG_1.jpg"),
        ("IMG.1", "", "IMG.1.jpg"),
        ("Stra\u00dfe", "", "STRASSE.jpg"),
        ("Cafe\u0301", "", "caf\u00e9.png"),
    ],
)
def test_a_label_finds_its_photo(folder, label: str, photo: str, file: str) -> None:
    problems: list[Problem] = []
    here = folder(file, "other.jpg", "notes.txt")
    found = match_photos([camera(label, photo)], here, problems)
    assert found.files == {label: here / file} and not problems
    assert found.left == ("other.jpg",) and found.without == ()


def test_the_folder_counts_where_names_repeat(folder) -> None:
    names = ("left/0001.jpg", "right/0001.jpg", "left/0002.jpg")
    here = folder(*names, "thumbs/0002.jpg")
    problems: list[Problem] = []
    cameras = [camera(name, f"/data/{name}") for name in names]
    found = match_photos(cameras, here, problems)
    assert {label: path.relative_to(here).as_posix() for label, path in found.files.items()} == {
        name: name for name in names
    }
    assert found.left == ("thumbs/0002.jpg",) and not problems


def test_two_files_that_match_equally_well_are_a_problem(folder) -> None:
    here = folder("a/IMG.jpg", "b/IMG.jpg")
    problems: list[Problem] = []
    found = match_photos([camera("IMG")], here, problems)
    assert found.files == {} and found.without == ("IMG",)
    (problem,) = problems
    assert "'a/IMG.jpg', 'b/IMG.jpg'" in problem.line()


def test_the_ending_decides_between_a_raw_pair(folder) -> None:
    here = folder("IMG.jpg", "IMG.tif")
    problems: list[Problem] = []
    assert match_photos([camera("IMG.TIF")], here, problems).files["IMG.TIF"].name == "IMG.tif"
    assert not problems


def test_two_cameras_of_one_photo_are_a_problem(folder) -> None:
    problems: list[Problem] = []
    match_photos([camera("IMG"), camera("img.jpg")], folder("IMG.jpg"), problems)
    assert [problem.object for problem in problems] == ["Photo of camera 'img.jpg'"]


@pytest.mark.parametrize("mask", ["IMG.png", "IMG.jpg.png", "IMG_mask.png", "img-mask.tif"])
def test_masks_are_called_as_programs_call_them(folder, mask: str) -> None:
    problems: list[Problem] = []
    here = folder(mask)
    found = match_masks([camera("IMG", "IMG.jpg")], here, problems)
    assert found.files == {"IMG": here / mask} and not problems


def test_what_the_file_names_is_taken_from_its_folder_only(folder) -> None:
    here = folder("images/1.png", "outside.png", "in/images/2.png", "in/images/side/3.jpg")
    names = {
        "a": "./images/2",
        "b": "../outside.png",
        "c": "/etc/passwd",
        "d": "",
        "e": "side/3.jpg",
    }
    assert files_by_path(names, here / "in") == {
        "a": (here / "in/images/2.png").resolve(),
        "e": (here / "in/images/side/3.jpg").resolve(),
    }


def test_a_missing_folder_is_a_problem(tmp_path: Path) -> None:
    problems: list[Problem] = []
    match_photos([camera("a")], tmp_path / "none", problems)
    assert "it is no folder" in problems[0].line()


def test_names_of_objects() -> None:
    assert short_name("C:\\shots\\IMG_1.JPG") == "IMG_1"
    assert short_name("cam/0001.png") == "0001"
    assert short_name("IMG.1") == "IMG.1"
    assert short_name(".png") == ".png"


def reconstruction(offset: np.ndarray) -> Reconstruction:
    rng = np.random.default_rng(1)
    points = rng.normal(size=(50, 3)) + offset
    mesh = ReconstructedMesh("m", points, np.array([[0, 1, 2]]))
    return Reconstruction("r", (camera("a", place=tuple(offset + 3.0)),), (mesh,))


def test_the_origin_stays_unless_it_is_far() -> None:
    near = placement_of(reconstruction(np.array([20.0, 0.0, 0.0])), 1.0)
    assert not near.offset.any()
    found = reconstruction(np.array([4e6, -1e6, 5e5]))
    far = placement_of(found, 1.0)
    assert np.abs(far.points(found.meshes[0].positions)).max() < 10
    back = far.points(found.meshes[0].positions) @ far.to_file()[:3, :3].T + far.to_file()[:3, 3]
    assert np.abs(back - found.meshes[0].positions).max() < 1e-9
    single = far.points(found.meshes[0].positions).astype(np.float32)
    assert np.abs(single - far.points(found.meshes[0].positions)).max() < 1e-6


def test_y_up_and_scale() -> None:
    placed = placement_of(reconstruction(np.zeros(3)), 0.1, up="Y")
    assert np.allclose(placed.points(np.array([[0.0, 1.0, 0.0]])), [[0, 0, 0.1]])
    assert np.linalg.det(placed.rotation) == pytest.approx(1)
    matrix = placed.camera(np.eye(4))
    assert np.allclose(matrix[:3, 2], placed.rotation @ [0, 0, -1])


@pytest.mark.parametrize("seed", range(5))
def test_ground_becomes_level_below_the_cameras(seed: int) -> None:
    rng = np.random.default_rng(seed)
    found = reconstruction(rng.normal(size=3) * 1e5)
    ground = list(rng.normal(size=(3, 3)) - 3 + found.meshes[0].positions.mean(axis=0))
    placed: Placement = placement_of(found, 2.0, ground=ground)
    assert np.abs(placed.points(np.array(ground))[:, 2]).max() < 1e-9
    assert placed.camera(found.cameras[0].camera_to_world)[2, 3] > 0
    assert np.allclose(placed.rotation @ placed.rotation.T, np.eye(3), atol=1e-12)


def test_opposite_normals_have_a_rotation() -> None:
    points = [np.array(p, float) for p in ((0, 0, 0), (1, 0, 0), (0, 1, 0))]
    assert np.allclose(plane_rotation(points, np.array([0, 0, -1.0])) @ [0, 0, -1], [0, 0, 1])
    assert why_no_plane([np.zeros(3), np.ones(3), 2 * np.ones(3)])
    assert why_no_plane(points) == ""


def test_a_lens_goes_both_ways() -> None:
    """capture.window turns Blender's numbers into pixels; here they come from pixels."""
    from selenite.capture.window import PhotoWindow, projection
    from selenite.scene_read.values import CameraValues

    true = LensDistortion(410.0, 400.0, 143.0, 260.5)
    lens = blender_lens(Intrinsics(300, 500, true))
    values = CameraValues(
        name="c", matrix=np.eye(4), kind="PERSP", lens_mm=lens.lens, sensor_width=36.0,
        sensor_height=24.0, sensor_fit="HORIZONTAL", shift_x=lens.shift_x, shift_y=lens.shift_y,
        ortho_scale=1.0, clip_start=0.1, clip_end=10.0, pixel_aspect_x=1.0, pixel_aspect_y=1.0,
        width=300, height=500,
    )  # fmt: skip
    seen = projection(values, PhotoWindow((300, 500), (0, 0, 300, 500), 0.6 * lens.pixel_aspect))
    assert seen.focal == pytest.approx((true.fx, true.fy))
    assert seen.centre == pytest.approx((true.cx, true.cy))


@pytest.mark.parametrize("size", [(400, 300), (300, 400)])
def test_a_field_of_view_is_that_of_the_shorter_side(size: tuple[int, int]) -> None:
    found = intrinsics_of(ReconstructedCamera("c", np.eye(4), field_of_view=np.pi / 2), size)
    assert found.lens.fx == found.lens.fy == pytest.approx(150)
    assert (found.lens.cx, found.lens.cy) == (size[0] / 2, size[1] / 2)
