# SPDX-License-Identifier: GPL-3.0-or-later
"""transforms.json with intrinsics that frames share or have of their own."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from selenite.importers.read import read_reconstruction
from selenite.importers.reconstruction import ReconstructionError

sys.path.insert(0, str(Path(__file__).parent))

from known import FLIP, FULL, HEIGHT, MOST, WIDTH, Known, Lens, known, picture, worst  # noqa: E402


def lens_of(lens: Lens) -> dict[str, float]:
    return {
        "w": WIDTH, "h": HEIGHT, "fl_x": lens.fx, "fl_y": lens.fy, "cx": lens.cx, "cy": lens.cy,
        "k1": lens.k1, "k2": lens.k2, "k3": lens.k3, "p1": lens.p1, "p2": lens.p2,
    }  # fmt: skip


def frame(one: Known) -> dict[str, Any]:
    """Its axes are OpenGL's."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = one.rotation.T @ FLIP, one.centre
    return {"file_path": one.label, "transform_matrix": matrix.tolist()}


def document(cameras: list[Known], **shared: Any) -> dict[str, Any]:
    return {**shared, "frames": [frame(one) for one in cameras]}


def written(folder: Path, content: Any) -> Path:
    path = folder / "transforms.json"
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return path


def test_reprojection_with_shared_intrinsics(tmp_path: Path) -> None:
    path = written(tmp_path, document(known(), camera_model="OPENCV", **lens_of(FULL)))
    found = read_reconstruction(path)
    assert worst(found, known()) < MOST and found.remarks == ()
    assert worst(read_reconstruction(tmp_path), known()) < MOST
    assert found.cameras[0].photo == "IMG_0000.JPG"


def test_reprojection_with_intrinsics_of_each_frame(tmp_path: Path) -> None:
    cameras = [replace(one, lens=replace(FULL, fx=500.0 + 10 * number, k1=-0.02 * number))
               for number, one in enumerate(known())]  # fmt: skip
    content = document(cameras, fl_x=1.0, w=2, k1=0.5)
    for entry, one in zip(content["frames"], cameras, strict=True):
        entry.update(lens_of(one.lens))
    assert worst(read_reconstruction(written(tmp_path, content)), cameras) < MOST


def test_coordinates_of_a_million_metres_keep_their_digits(tmp_path: Path) -> None:
    path = written(tmp_path, document(known(at=1e6), **lens_of(FULL)))
    assert worst(read_reconstruction(path), known(at=1e6), 1e6) < MOST


def test_an_angle_of_view_and_the_photos_will_do(tmp_path: Path) -> None:
    lens = Lens(500.0, 500.0)
    cameras = [replace(one, label=f"./train/r_{number}")
               for number, one in enumerate(known(3, lens))]  # fmt: skip
    for number in range(3):
        picture(tmp_path / "train" / f"r_{number}.png")
    content = document(cameras, camera_angle_x=2 * math.atan(WIDTH / 2 / lens.fx))
    assert worst(read_reconstruction(written(tmp_path, content)), cameras) < MOST


def test_data_sets_are_parted_into_files(tmp_path: Path) -> None:
    """As those of NeRF: no ending of photos, one angle of view, several files in a folder."""
    cameras = [replace(one, label=f"./train/r_{number}", lens=Lens(520.0, 520.0))
               for number, one in enumerate(known())]  # fmt: skip
    for one in cameras:
        picture(tmp_path / f"{one.label}.png")
    content = document(cameras, camera_angle_x=2 * math.atan(WIDTH / 2 / 520))
    path = tmp_path / "transforms_train.json"
    path.write_text(json.dumps(content))
    for source in (path, tmp_path):
        assert worst(read_reconstruction(source), cameras) < MOST
    path.with_name("transforms_test.json").write_text(json.dumps(content))
    with pytest.raises(ReconstructionError, match="transforms_test.json and transforms_train.json"):
        read_reconstruction(tmp_path)
    written(tmp_path, content)  # which comes before its parts
    assert worst(read_reconstruction(tmp_path), cameras) < MOST


def test_points_of_nerfstudio_are_read(tmp_path: Path) -> None:
    content = document(known(), ply_file_path="points.ply", **lens_of(FULL))
    path = written(tmp_path, content)
    assert len(read_reconstruction(path).points) == 0
    head = "ply\nformat ascii 1.0\nelement vertex 2\n"
    head += "".join(f"property float {name}\n" for name in "xyz")
    (tmp_path / "points.ply").write_text(head + "end_header\n1 2 3\n4 5 6\n")
    found = read_reconstruction(path)
    assert found.points.tolist() == [[1, 2, 3], [4, 5, 6]] and found.remarks == ()
    content["ply_file_path"] = "../points.ply"
    (tmp_path / "in").mkdir()
    assert len(read_reconstruction(written(tmp_path / "in", content)).points) == 0


def test_photos_may_lie_in_another_folder(tmp_path: Path) -> None:
    (tmp_path / "poses").mkdir()
    picture(tmp_path / "photos" / "IMG_0000.jpg")
    content = document(known(1, Lens()), fl_x=520.0)
    path = written(tmp_path / "poses", content)
    found = read_reconstruction(path, pictures=[tmp_path / "photos"])
    assert worst(found, known(1, Lens())) < MOST
    with pytest.raises(
        ReconstructionError, match=r"size of its photo is not known.*give their folder"
    ):
        read_reconstruction(path)


@pytest.mark.parametrize("name", ["IMG_0000.png", "IMG_0000_mask.png", "IMG_0000.JPG.png"])
def test_a_mask_has_the_size_of_its_photo(tmp_path: Path, name: str) -> None:
    (tmp_path / "poses").mkdir()
    picture(tmp_path / "masks" / name)
    path = written(tmp_path / "poses", document(known(1, Lens()), fl_x=520.0))
    found = read_reconstruction(path, pictures=[tmp_path / "masks"])
    assert worst(found, known(1, Lens())) < MOST


def test_a_frame_with_a_mask_alone_is_read(tmp_path: Path) -> None:
    picture(tmp_path / "masks" / "m0.png")
    content = document(known(1, Lens()), fl_x=520.0)
    content["frames"][0] = {**content["frames"][0], "file_path": None, "mask_path": "masks/m0.png"}
    (camera,) = read_reconstruction(written(tmp_path, content)).cameras
    assert (camera.label, camera.photo, camera.mask) == ("masks/m0.png", "", "masks/m0.png")


def test_a_fisheye_is_told_and_k4_is_read(tmp_path: Path) -> None:
    content = document(known(2), **lens_of(FULL))
    content["frames"][1]["camera_model"] = "OPENCV_FISHEYE"
    content["k4"] = 0.01
    found = read_reconstruction(written(tmp_path, content))
    assert found.remarks[0].startswith("camera 'IMG_0001.JPG': its camera_model OPENCV_FISHEYE")
    assert len(found.remarks) == 1 and found.cameras[0].intrinsics.lens.k4 == 0.01


def test_poses_that_nerfstudio_has_moved_are_told(tmp_path: Path) -> None:
    plain = document(known(), **lens_of(FULL))
    axes = [[0, 1, 0, 0], [1, 0, 0, 0], [0, 0, -1, 0]]
    for moved, count in (
        ({"applied_transform": axes, "ply_file_path": "points.ply"}, 1),
        ({"applied_transform": np.eye(3, 4).tolist()}, 0),
        ({"applied_scale": 0.5}, 1),
        ({"applied_scale": 1.0}, 0),
    ):
        found = read_reconstruction(written(tmp_path, {**plain, **moved}))
        assert worst(found, known()) < MOST and len(found.remarks) == count
        assert all("applied_transform" in remark for remark in found.remarks)


GOOD = document(known(2), **lens_of(FULL))


def broken(**changes: Any) -> dict[str, Any]:
    return {**GOOD, "frames": [{**GOOD["frames"][0], **changes}, GOOD["frames"][1]]}


@pytest.mark.parametrize(
    ("content", "element", "cause"),
    [
        ("{", "JSON", "no JSON"),
        ("{\x00}", "JSON", "no JSON"),
        ('{"frames": NaN}', "JSON", "NaN is no number"),
        ("{" * 100_000, "JSON", "no JSON"),
        ('{"a":' + "[" * 100_000, "JSON", "nested too deep"),
        ("{" + "[" * 600_000, "JSON", "more than"),
        ('{"a": ' + "9" * 5000 + "}", "JSON", "no JSON"),
        ({}, "frames", "missing or empty"),
        ({"frames": []}, "frames", "missing or empty"),
        ({"frames": [3]}, "frame 0", "no object"),
        (broken(file_path=3), "frame 0", "file_path is no text"),
        (broken(file_path=""), "frame 0", "no file_path"),
        (broken(file_path="a\x00b"), "frame 0", "control characters"),
        (broken(file_path="\ud800"), "frame 0", "control characters"),
        (broken(file_path="IMG_0001.JPG"), "frame 1", "comes twice"),
        (broken(transform_matrix=None), "transform_matrix", "no matrix"),
        (broken(transform_matrix=[[1, 2]] * 4), "transform_matrix", "no matrix"),
        (broken(transform_matrix=[[0, 0, 0, 0]] * 3), "transform_matrix", "unit length"),
        (broken(transform_matrix=[["a"] * 4] * 4), "transform_matrix", "'a' is no number"),
        (broken(transform_matrix=[[10**400] * 4] * 4), "transform_matrix", "too large"),
        (broken(transform_matrix=[[True] * 4] * 4), "transform_matrix", "no number"),
        (broken(fl_x=-3), "frame 0", "fx is -3"),
        (broken(fl_x="x"), "fl_x", "'x' is no number"),
        (broken(w=0), "frame 0", "0 pixels"),
        (broken(w=640.5), "frame 0", "no whole number"),
        ({**GOOD, "fl_x": None, "fl_y": None}, "frame 0", "neither fl_x nor camera_angle_x"),
        ({**GOOD, "fl_x": None, "camera_angle_x": 7}, "frame 0", "no angle of view"),
        ({**GOOD, "camera_model": "EQUIRECTANGULAR"}, "frames", "none can be used"),
    ],
)
def test_a_broken_file_is_refused(tmp_path: Path, content: Any, element: str, cause: str) -> None:
    with pytest.raises(ReconstructionError) as caught:
        read_reconstruction(written(tmp_path, content))
    error = caught.value
    assert element in error.element and cause in error.cause and error.cure
    assert "\n" not in str(error)
