# SPDX-License-Identifier: GPL-3.0-or-later
"""Masks of a photo, one by one and together: files of any size, backgrounds, and the rim."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from selenite import native
from selenite.capture.background import Background, flooded
from selenite.capture.masks import eroded
from selenite.capture.prepared import Capture, read_captures
from selenite.capture.request import CaptureRequest
from selenite.problems import Problem
from selenite.scene_read.values import CameraValues, SceneValues

WIDTH, HEIGHT = 32, 24
CAMERA = CameraValues(
    name="Front", matrix=np.eye(4), kind="PERSP", lens_mm=50.0, sensor_width=36.0,
    sensor_height=24.0, sensor_fit="AUTO", shift_x=0.0, shift_y=0.0, ortho_scale=6.0,
    clip_start=0.1, clip_end=100.0, pixel_aspect_x=1.0, pixel_aspect_y=1.0, width=WIDTH,
    height=HEIGHT,
)  # fmt: skip
#: Where the photo has an object, with a hole in it.
OBJECT = np.zeros((HEIGHT, WIDTH), bool)
OBJECT[6:18, 8:24] = True
OBJECT[10:14, 14:18] = False


def photo(folder: Path, background: float = 0.0) -> str:
    pixels = np.full((HEIGHT, WIDTH, 3), background, np.float32)
    pixels[OBJECT] = 0.4
    native.image().write_png(str(folder / "photo.png"), pixels, 16)
    return str(folder / "photo.png")


def picture(path: Path, white: np.ndarray) -> str:
    native.image().write_png(str(path), white.astype(np.float32))
    return str(path)


def read_all(
    path: str, warnings: list[str] | None = None, height: int = HEIGHT, **asked: object
) -> tuple[list[Capture], list[Problem]]:
    problems: list[Problem] = []
    request = CaptureRequest("Front", path, **asked)  # type: ignore[arg-type]
    said = [] if warnings is None else warnings
    scene = SceneValues(cameras=[CAMERA])
    return read_captures(scene, [request], height, problems, said, {}), problems


def counted(path: str, **asked: object) -> np.ndarray:
    (found,), problems = read_all(path, **asked)
    assert not problems
    assert found.mask_share == (found.weight > 0).mean()
    return found.weight > 0


def without_rim(inside: np.ndarray) -> np.ndarray:
    """Pixels all of whose 8 neighbours are inside, by its own words."""
    out = inside.copy()
    for y, x in np.argwhere(~inside):
        out[max(0, y - 1) : y + 2, max(0, x - 1) : x + 2] = False
    return out


def test_the_rim_of_a_mask_does_not_count(tmp_path: Path) -> None:
    mask = picture(tmp_path / "mask.png", OBJECT)
    np.testing.assert_array_equal(counted(photo(tmp_path), mask=mask), without_rim(OBJECT))
    assert counted(photo(tmp_path)).all(), "without a mask the photo's own border counts"


@pytest.mark.parametrize("factor", [2, 0.5])
def test_a_mask_may_have_any_size(tmp_path: Path, factor: float) -> None:
    rows, columns = round(HEIGHT * factor), round(WIDTH * factor)
    y, x = np.mgrid[:rows, :columns]
    scaled = OBJECT[(y / factor).astype(int), (x / factor).astype(int)]
    mask = picture(tmp_path / "mask.png", scaled)
    np.testing.assert_array_equal(counted(photo(tmp_path), mask=mask), without_rim(OBJECT))


def test_what_is_excluded_does_not_count(tmp_path: Path) -> None:
    hand = np.zeros_like(OBJECT)
    hand[:, 20:] = True
    exclude = picture(tmp_path / "hand.png", hand)
    np.testing.assert_array_equal(counted(photo(tmp_path), exclude=exclude), without_rim(~hand))
    mask = picture(tmp_path / "mask.png", OBJECT)
    both = counted(photo(tmp_path), mask=mask, exclude=exclude)
    np.testing.assert_array_equal(both, without_rim(OBJECT & ~hand))


@pytest.mark.parametrize("background", [0.0, 0.2, 0.9])
def test_a_background_is_found_from_the_border(tmp_path: Path, background: float) -> None:
    """The hole has its colour and does not join it."""
    found = counted(photo(tmp_path, background), background="border")
    outer = np.zeros_like(OBJECT)
    outer[6:18, 8:24] = True
    np.testing.assert_array_equal(found, without_rim(outer))


def test_a_background_is_found_by_its_colour(tmp_path: Path) -> None:
    found = counted(photo(tmp_path, 0.2), background="0.2,0.2,0.2")
    np.testing.assert_array_equal(found, without_rim(OBJECT))
    # sRGB codes of 0.4 and 0.2 are 0.180 apart.
    found = counted(photo(tmp_path, 0.2), background="0.2,0.2,0.2:0.17")
    assert found.any()
    _, problems = read_all(photo(tmp_path, 0.2), background="0.2,0.2,0.2:0.19")
    assert problems[0].cause == "its masks together leave no pixel"


def test_a_background_that_is_not_there_is_named(tmp_path: Path) -> None:
    warnings: list[str] = []
    (found,), _ = read_all(photo(tmp_path), warnings, background="0.9,0,0")
    assert (found.weight > 0).all()
    assert "no pixel of it has the colour of its background" in warnings[0]


@pytest.mark.parametrize(
    "text, cause",
    [
        ("rim", "neither border nor R,G,B"),
        ("1,2", "neither border nor R,G,B"),
        ("border:2", "not in (0, 1]"),
        ("border:", "no number"),
        ("nan,0,0", "not finite"),
        ("-1,0,0", "below 0"),
    ],
)
def test_what_is_no_background_is_a_problem(tmp_path: Path, text: str, cause: str) -> None:
    found, (problem,) = read_all(photo(tmp_path), background=text)
    assert not found
    assert cause in problem.cause
    assert "border:0.1" in problem.cure


def test_masks_that_leave_nothing_are_a_problem(tmp_path: Path) -> None:
    half = np.zeros_like(OBJECT)
    half[:, :10] = True
    mask = picture(tmp_path / "mask.png", half)
    exclude = picture(tmp_path / "exclude.png", half)
    found, (problem,) = read_all(photo(tmp_path), mask=mask, exclude=exclude)
    assert not found
    assert "no pixel" in problem.cause


def test_the_rim_of_a_narrow_mask_counts_and_that_is_said(tmp_path: Path) -> None:
    line = np.zeros_like(OBJECT)
    line[10:12] = True
    warnings: list[str] = []
    mask = picture(tmp_path / "mask.png", line)
    (found,), _ = read_all(photo(tmp_path), warnings, mask=mask)
    np.testing.assert_array_equal(found.weight > 0, line)
    assert "so narrow that its rim counts too" in warnings[0]


def test_an_exclude_file_that_is_not_there_is_a_problem(tmp_path: Path) -> None:
    _, (problem,) = read_all(photo(tmp_path), exclude=str(tmp_path / "none.png"))
    assert problem.object.startswith("Exclude '")
    assert "does not exist" in problem.cause


def test_erosion_takes_off_as_many_pixels_as_it_is_told() -> None:
    inside = np.ones((9, 9), bool)
    inside[4, 4] = False
    assert (~eroded(inside, 2)).sum() == 25
    assert (eroded(inside, 0) == inside).all()


def test_a_flood_follows_a_winding_path() -> None:
    """A spiral: every pixel of it is reached, and nothing beside it."""
    open_pixels = np.zeros((13, 13), bool)
    open_pixels[0, :] = open_pixels[:, 12] = open_pixels[12, :] = open_pixels[2:, 0] = True
    open_pixels[2, :11] = open_pixels[2:11, 10] = open_pixels[10, 2:11] = True
    open_pixels[5, 5] = True
    seeds = np.zeros_like(open_pixels)
    seeds[0, 0] = True
    expected = open_pixels.copy()
    expected[5, 5] = False
    np.testing.assert_array_equal(flooded(seeds, open_pixels), expected)


def test_background_reads_what_it_is_told() -> None:
    assert Background.from_text("border") == Background(None, 0.05)
    assert Background.from_text("0.1,0.2,0.3:0.2") == Background((0.1, 0.2, 0.3), 0.2)
