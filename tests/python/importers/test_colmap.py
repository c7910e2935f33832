# SPDX-License-Identifier: GPL-3.0-or-later
"""COLMAP models in text and binary, of all versions."""

from __future__ import annotations

import struct
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from selenite.importers.read import read_reconstruction
from selenite.importers.reconstruction import ReconstructionError

sys.path.insert(0, str(Path(__file__).parent))

from colmap_files import (  # noqa: E402
    LENSES,
    MODELS,
    POINT,
    write_binary,
    write_rigs,
    write_rigs_as_text,
    write_text,
)
from known import MOST, Known, known, worst  # noqa: E402

WRITERS = {"text": write_text, "binary": write_binary}


@pytest.mark.parametrize("form", WRITERS)
@pytest.mark.parametrize("model", MODELS)
def test_reprojection_in_every_model(tmp_path: Path, form: str, model: str) -> None:
    cameras = known(lens=LENSES[model])
    WRITERS[form](tmp_path / "dense", cameras, model)
    found = read_reconstruction(tmp_path / "dense")
    assert worst(found, cameras) < MOST
    np.testing.assert_array_equal(found.points, [POINT])
    assert found.name == "dense" and found.remarks == ()


@pytest.mark.parametrize("form", WRITERS)
def test_a_part_of_the_model_or_its_project_will_do(tmp_path: Path, form: str) -> None:
    cameras = known(lens=LENSES["PINHOLE"])
    folder = tmp_path / "project" / "sparse" / "0"
    WRITERS[form](folder, cameras, "PINHOLE")
    suffix = ".txt" if form == "text" else ".bin"
    assert worst(read_reconstruction(folder / f"images{suffix}"), cameras) < MOST
    found = read_reconstruction(tmp_path / "project")
    assert worst(found, cameras) < MOST and found.name == "project"


def test_other_models_of_a_project_are_told(tmp_path: Path) -> None:
    cameras = known(lens=LENSES["PINHOLE"])
    for number in (0, 1, 3):
        write_binary(tmp_path / "sparse" / str(number), cameras, "PINHOLE")
    assert read_reconstruction(tmp_path).remarks == ("other models of it are not read: 1, 3",)
    assert read_reconstruction(tmp_path / "sparse" / "3").remarks == ()


def test_coordinates_of_a_million_metres_keep_their_digits(tmp_path: Path) -> None:
    cameras = known(lens=LENSES["OPENCV"], at=1e6)
    write_binary(tmp_path, cameras, "OPENCV")
    assert worst(read_reconstruction(tmp_path), cameras, 1e6) < MOST


def in_rigs(cameras: list[Known]) -> tuple[list[Known], np.ndarray, np.ndarray]:
    """Pairs, the second of each where the rig has it; the pose of the second in the rig."""
    turn, moved = cameras[1].rotation, np.array([0.1, -0.05, 0.02])
    found = []
    for one in cameras[::2]:
        # x_second = turn (R x + t) + moved
        rotation = turn @ one.rotation
        centre = -rotation.T @ (turn @ one.translation + moved)
        found += [one, replace(one, label=f"second/{one.label}", rotation=rotation, centre=centre)]
    return found, turn, moved


@pytest.mark.parametrize("form", WRITERS)
def test_frames_decide_where_a_camera_of_a_rig_is(tmp_path: Path, form: str) -> None:
    """What images say instead is another pose, which would be seen."""
    cameras, turn, moved = in_rigs(known(4, LENSES["PINHOLE"]))
    elsewhere = [replace(one, centre=one.centre + 0.25) for one in cameras]
    WRITERS[form](tmp_path, elsewhere, "PINHOLE")
    (write_rigs_as_text if form == "text" else write_rigs)(tmp_path, cameras[::2], turn, moved)
    found = read_reconstruction(tmp_path)
    by_label = {camera.label: camera for camera in found.cameras}
    for one in cameras:
        matrix = by_label[one.label].camera_to_world
        np.testing.assert_allclose(matrix[:3, :3], one.rotation.T, atol=1e-12)
        np.testing.assert_allclose(matrix[:3, 3], one.centre, atol=1e-12)
    (remark,) = found.remarks
    assert remark.startswith("images 'IMG_0000.JPG', ") and "its pose is that of its" in remark


def test_frames_that_agree_are_not_remarked_on(tmp_path: Path) -> None:
    cameras, turn, moved = in_rigs(known(4, LENSES["PINHOLE"]))
    write_binary(tmp_path, cameras, "PINHOLE")
    write_rigs(tmp_path, cameras[::2], turn, moved)
    assert read_reconstruction(tmp_path).remarks == ()


def test_a_model_that_is_not_browns_is_told(tmp_path: Path) -> None:
    cameras = known(lens=LENSES["PINHOLE"])
    write_text(tmp_path, cameras, "PINHOLE")
    path = tmp_path / "cameras.txt"
    more = "2 OPENCV_FISHEYE 640 480 500 500 320 240 0 0 0 0\n3 NEW_ONE 640 480 1 2 3\n"
    path.write_text(path.read_text() + more)
    images = tmp_path / "images.txt"
    lines = "8 1 0 0 0 0 0 0 2 fish.jpg\n\n9 1 0 0 0 0 0 0 3 new.jpg\n\n"
    images.write_text(images.read_text() + lines)
    found = read_reconstruction(tmp_path)
    assert worst(found, cameras) < MOST
    assert found.remarks == (
        "camera 'fish.jpg': its model OPENCV_FISHEYE is not Brown's",
        "camera 'new.jpg': its model NEW_ONE is not known",
    )


def test_names_may_have_spaces_and_folders(tmp_path: Path) -> None:
    cameras = [replace(one, label=f"left side/{one.label}") for one in known(2, LENSES["PINHOLE"])]
    for form, write in WRITERS.items():
        write(tmp_path / form, cameras, "PINHOLE")
        assert worst(read_reconstruction(tmp_path / form), cameras) < MOST


def test_ten_thousand_cameras_are_read(tmp_path: Path) -> None:
    one = known(1, LENSES["PINHOLE"])[0]
    cameras = [replace(one, label=f"c{number}") for number in range(10_000)]
    for form, write in WRITERS.items():
        write(tmp_path / form, cameras, "PINHOLE")
        assert len(read_reconstruction(tmp_path / form).cameras) == 10_000


@pytest.mark.parametrize(
    ("name", "old", "new", "cause"),
    [
        ("cameras.txt", "PINHOLE 640", "PINHOLE 0", "0 pixels"),
        ("cameras.txt", "PINHOLE 640", "PINHOLE many", "no whole number"),
        ("cameras.txt", "521.5", "nan", "no usable number"),
        ("cameras.txt", "521.5", "0", "fx is 0"),
        ("cameras.txt", " 233.5", "", "4 parameters, not 3"),
        ("cameras.txt", "1 PINHOLE", "5 PINHOLE", "no camera 1"),
        ("cameras.txt", "# Cameras\n", "1 PINHOLE 1 1 1 1 1 1\n", "camera 1 comes twice"),
        ("images.txt", "IMG_0001.JPG", "IMG_0000.JPG", "comes twice"),
        ("images.txt", "\n2 ", "\n1 ", "image 1 comes twice"),
        ("images.txt", " 1 IMG_0001.JPG", "", "10 at least"),
        ("images.txt", "# Images", "9 0 0 0 0 0 0 0 1 x\n\n", "quaternion is 0"),
        ("images.txt", "# Images", "9 1 0 0 0 0 inf 0 1 x\n\n", "no usable number"),
        ("images.txt", "# Images", "9 1 0 0 0 0 x 0 1 x\n\n", "are no numbers"),
        ("images.txt", "\n\n2 ", "\n2 ", "it is not that of the features"),
        ("images.txt", "3 4 7", "3 4", "it is not that of the features"),
        ("points3D.txt", "0.25", "nan", "no usable number"),
        ("points3D.txt", "0.25 -0.5 0.125 255 0 9 0.5 2 1", "1", "4 at least"),
    ],
)  # fmt: skip
def test_a_broken_text_model_is_refused(
    tmp_path: Path, name: str, old: str, new: str, cause: str
) -> None:
    write_text(tmp_path, known(2, LENSES["PINHOLE"]), "PINHOLE")
    path = tmp_path / name
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(ReconstructionError) as caught:
        read_reconstruction(tmp_path)
    error = caught.value
    assert cause in error.cause and error.cure and "\n" not in str(error)


@pytest.mark.parametrize("name", ["cameras", "images", "points3D", "rigs", "frames"])
def test_a_binary_file_of_any_length_but_its_own_is_refused(tmp_path: Path, name: str) -> None:
    cameras, turn, moved = in_rigs(known(4, LENSES["PINHOLE"]))
    write_binary(tmp_path, cameras, "PINHOLE")
    write_rigs(tmp_path, cameras[::2], turn, moved)
    path = tmp_path / f"{name}.bin"
    whole = path.read_bytes()
    for length in range(len(whole)):
        path.write_bytes(whole[:length])
        with pytest.raises(ReconstructionError, match=rf"{name}.bin: .*it ends"):
            read_reconstruction(tmp_path)
    path.write_bytes(whole + b"\0")
    with pytest.raises(ReconstructionError, match="1 bytes follow"):
        read_reconstruction(tmp_path)


@pytest.mark.parametrize(
    ("name", "at", "form", "value", "cause"),
    [
        ("cameras", 0, "<Q", 1 << 60, "it ends before the last"),
        ("cameras", 12, "<i", 99, "model 99 is not known"),
        ("cameras", 12, "<i", 5, "ends in the midst"),
        ("cameras", 16, "<Q", 1 << 40, "pixels a side"),
        ("cameras", 32, "<d", float("nan"), "no usable number"),
        ("images", 0, "<Q", 1 << 60, "it ends before the last"),
        ("images", 12, "<4d", (0, 0, 0, 0), "quaternion is 0"),
        ("images", 44, "<d", float("inf"), "no usable number"),
        ("images", 68, "<I", 9, "no camera 9"),
        ("points3D", 0, "<Q", 1 << 50, "it ends before the last"),
        ("points3D", 16, "<d", float("nan"), "no usable number"),
        ("points3D", 51, "<Q", 1 << 62, "ends in the midst"),
        ("rigs", 12, "<I", 1 << 31, "it ends before the last"),
        ("rigs", 16, "<i", 7, "rig 1 has no camera 1"),
        ("frames", 12, "<I", 3, "rig 3, which is missing"),
        ("frames", 16, "<4d", (0, 0, 0, 0), "quaternion is 0"),
    ],
)
def test_a_broken_binary_model_is_refused(
    tmp_path: Path, name: str, at: int, form: str, value: object, cause: str
) -> None:
    cameras, turn, moved = in_rigs(known(4, LENSES["PINHOLE"]))
    write_binary(tmp_path, cameras, "PINHOLE")
    write_rigs(tmp_path, cameras[::2], turn, moved)
    path = tmp_path / f"{name}.bin"
    data = bytearray(path.read_bytes())
    struct.pack_into(form, data, at, *(value if isinstance(value, tuple) else (value,)))
    path.write_bytes(data)
    with pytest.raises(ReconstructionError) as caught:
        read_reconstruction(tmp_path)
    assert cause in caught.value.cause and caught.value.cure


def test_a_model_without_images_is_refused(tmp_path: Path) -> None:
    write_text(tmp_path, known(2, LENSES["PINHOLE"]), "PINHOLE")
    (tmp_path / "images.txt").unlink()
    with pytest.raises(ReconstructionError, match=r"images.txt: it is missing; give a whole"):
        read_reconstruction(tmp_path)
