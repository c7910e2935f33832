# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos as people have them, beside a COLMAP model: names, folders, sizes and kinds."""

from __future__ import annotations

import sys
import unicodedata
from dataclasses import replace
from pathlib import Path

import pytest
from PIL import Image

from selenite.importers.plan import ImportPlan, ImportRequest, make_plan
from selenite.importers.read import read_reconstruction
from selenite.problems import BadInput

sys.path.insert(0, str(Path(__file__).parent))

from colmap_files import LENSES, write_binary  # noqa: E402
from known import HEIGHT, WIDTH, known, picture  # noqa: E402


def planned(
    folder: Path, labels: list[str], photos: str | None = "photos", masks: str | None = None
) -> ImportPlan:
    """Of a model in `folder` whose cameras have these labels."""
    cameras = known(len(labels), LENSES["OPENCV"])
    named = [replace(one, label=label) for one, label in zip(cameras, labels, strict=True)]
    write_binary(folder / "model", named, "OPENCV")
    places = {"photos": photos, "masks": masks}
    given = {name: folder / place if place else None for name, place in places.items()}
    request = ImportRequest(folder / "model", **given)
    return make_plan(request, read_reconstruction)


def photos_of(plan: ImportPlan, folder: Path) -> dict[str, str]:
    """By label, relative to the folder of the photos."""
    return {
        item.label: Path(item.capture.photo).relative_to(folder / "photos").as_posix()
        for item in plan.cameras
        if item.capture is not None
    }


def test_names_have_accents_spaces_and_equal_names_in_folders(tmp_path: Path) -> None:
    """Accents as letters of their own, as macOS writes them."""
    labels = ["été/Größe 1.jpg", "cam b/日本 2.JPG", "it's (3).png", "a/0001.jpg", "b/0001.jpg"]
    files = {label: unicodedata.normalize("NFD", label) for label in labels}
    for file in files.values():
        picture(tmp_path / "photos" / file)
    plan = planned(tmp_path, labels)
    assert photos_of(plan, tmp_path) == files
    assert plan.without_photo == () == plan.without_camera
    names = [item.name for item in plan.cameras]
    assert sorted(names) == sorted({"Größe 1", "日本 2", "it's (3)", "0001", "0001-2"})


@pytest.mark.parametrize(
    ("labels", "files"),
    [
        (["left/a.jpg", "right/b.jpg"], ["a.jpg", "b.jpg"]),
        (["C:\\pics\\s 1\\a.jpg", "C:\\pics\\s 2\\a.jpg"], ["s 1/a.jpg", "s 2/a.jpg"]),
        (["a", "b.JPG"], ["a.png", "b.tif"]),
        (["a.CR2", "b.heic"], ["a.tif", "b.jpg"]),
    ],
)
def test_photos_are_found_wherever_and_as_whatever_they_are(
    tmp_path: Path, labels: list[str], files: list[str]
) -> None:
    for file in files:
        picture(tmp_path / "photos" / file)
    found = photos_of(planned(tmp_path, labels), tmp_path)
    assert found == dict(zip(labels, files, strict=True))


def test_a_photo_counts_as_it_is_stored(tmp_path: Path) -> None:
    """Of another size, or to be shown on its side, as programs of reconstruction read it."""
    labels = ["whole.jpg", "half.jpg", "turned.jpg"]
    picture(tmp_path / "photos" / "whole.jpg")
    picture(tmp_path / "photos" / "half.jpg", WIDTH // 2, HEIGHT // 2)
    turned = Image.Exif()
    turned[0x0112] = 6
    Image.new("RGB", (WIDTH, HEIGHT)).save(tmp_path / "photos" / "turned.jpg", exif=turned)
    plan = planned(tmp_path, labels)
    assert len(photos_of(plan, tmp_path)) == 3
    assert {item.capture and item.capture.size for item in plan.cameras} == {(WIDTH, HEIGHT)}


def test_a_photo_that_lies_on_its_side_is_told(tmp_path: Path) -> None:
    turned = Image.Exif()
    turned[0x0112] = 6
    (tmp_path / "photos").mkdir()
    Image.new("RGB", (HEIGHT, WIDTH)).save(tmp_path / "photos" / "a.jpg", exif=turned)
    with pytest.raises(BadInput) as caught:
        planned(tmp_path, ["a.jpg"])
    (problem,) = caught.value.problems
    assert "lies on its side; its Exif orientation is 6" in problem.cause


def test_photos_that_are_not_read_are_told(tmp_path: Path) -> None:
    for file in ("a.webp", "b.HEIC", "c.jpg"):
        (tmp_path / "photos").mkdir(exist_ok=True)
        if file == "c.jpg":
            picture(tmp_path / "photos" / file)
        else:
            (tmp_path / "photos" / file).write_bytes(b"?")
    plan = planned(tmp_path, ["a.webp", "b.HEIC", "c.jpg"])
    assert "not read, so convert them to PNG or TIFF: 'a.webp', 'b.HEIC'" in plan.warnings
    assert "cameras without a photo: 'a.webp', 'b.HEIC'" in plan.warnings


def test_without_photos_the_folder_is_asked_for(tmp_path: Path) -> None:
    plan = planned(tmp_path, ["a.jpg"], photos=None)
    assert "cameras without a photo: 'a.jpg'; give the folder of the photos" in plan.warnings


@pytest.mark.parametrize(
    ("name", "masks"),
    [("{}_mask.png", "photos"), ("{}.jpg.png", "photos"), ("masks/{}.png", "photos/masks")],
)
def test_masks_may_lie_among_the_photos(tmp_path: Path, name: str, masks: str) -> None:
    """No photo is taken for its own mask. Without their folder, they are told."""
    labels = ["a.jpg", "b.jpg"]
    for label in labels:
        picture(tmp_path / "photos" / label)
        picture(tmp_path / "photos" / name.format(label[0]))
    plan = planned(tmp_path, labels, masks=masks)
    found = [item.capture and item.capture.mask for item in plan.cameras]
    assert found == [str(tmp_path / "photos" / name.format(label[0])) for label in labels]
    assert plan.without_camera == () and not [one for one in plan.warnings if "photo" in one]
    plan = planned(tmp_path, labels)
    files = "', '".join(name.format(label[0]) for label in labels)
    remark = f"masks among the photos: '{files}'; give their folder as that of masks"
    assert [one for one in plan.warnings if "photo" in one] == [remark]


def test_the_case_decides_between_equal_names_and_hidden_files_are_passed_over(
    tmp_path: Path,
) -> None:
    labels = ["IMG_1.JPG", "img_1.jpg"]
    for label in labels:
        picture(tmp_path / "photos" / label)
    (tmp_path / "photos" / "._IMG_1.JPG").write_bytes(b"?")
    plan = planned(tmp_path, labels)
    assert photos_of(plan, tmp_path) == {label: label for label in labels}
    assert plan.without_camera == ()
