# SPDX-License-Identifier: GPL-3.0-or-later
"""Size, crop and pixel aspect of a photo: which part of its camera's picture the file holds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from selenite.capture.request import CaptureRequest
from selenite.capture.window import WHOLE, PhotoWindow, cropped_camera, projection, window_of
from selenite.problems import Problem
from selenite.scene_read.values import CameraValues

#: The scene renders 3:2.
CAMERA = CameraValues(
    name="Front", matrix=np.eye(4), kind="PERSP", lens_mm=50.0, sensor_width=36.0,
    sensor_height=24.0, sensor_fit="AUTO", shift_x=0.05, shift_y=-0.02, ortho_scale=6.0,
    clip_start=0.1, clip_end=100.0, pixel_aspect_x=1.0, pixel_aspect_y=1.0, width=300, height=200,
)  # fmt: skip


def window(
    file_size: tuple[int, int], orientation: int = 1, **asked: object
) -> tuple[PhotoWindow | None, list[Problem]]:
    problems: list[Problem] = []
    request = CaptureRequest("Front", "a.png", **asked)  # type: ignore[arg-type]
    return window_of(CAMERA, request, file_size, orientation, problems), problems


def good(file_size: tuple[int, int], **asked: object) -> PhotoWindow:
    found, problems = window(file_size, **asked)
    assert found is not None and not problems
    return found


def test_without_a_word_the_photo_is_what_the_scene_renders() -> None:
    found = good((600, 400))
    assert found.fractions == WHOLE
    assert found.aspect == 1.5
    # The width of a smaller photo is rounded; the camera takes 3:2 all the same.
    assert good((100, 67)).aspect == 1.5


def test_a_portrait_photo_needs_its_size() -> None:
    found, (problem,) = window((400, 600))
    assert found is None
    assert problem.cause == "it is 400 x 600 pixels, camera 'Front' renders 300 x 200"
    assert "'size', [400, 600]" in problem.cure
    found = good((400, 600), size=(400, 600))
    assert found.aspect == pytest.approx(2 / 3)


def test_exif_orientation_is_named_where_the_shape_is_wrong() -> None:
    _, (problem,) = window((400, 600), orientation=6)
    assert "Exif orientation is 6" in problem.cause
    found, problems = window((600, 400), orientation=3)
    assert found is not None and not problems


def test_a_crop_is_a_part_of_its_size() -> None:
    found = good((100, 50), size=(400, 600), crop=(300, 100, 400, 150))
    assert found.fractions == (0.75, 1 / 6, 1.0, 0.25)
    # The file may hold it in other pixels.
    assert good((50, 25), size=(400, 600), crop=(300, 100, 400, 150)) == found


@pytest.mark.parametrize(
    "asked, cause, cure",
    [
        ({"crop": (0, 0, 10, 10)}, "unknown size", "'size'"),
        ({"size": (400, 600)}, "it is 100 x 50 pixels, by its 'size'", "'crop'"),
        ({"size": (400, 600), "crop": (0, 0, 50, 50)}, "by its 'crop'", "'crop'"),
        ({"size": (400, 600), "crop": (350, 0, 450, 50)}, "no part of 400 x 600", "x0 < x1"),
        ({"size": (400, 600), "crop": (100, 0, 100, 50)}, "no part of 400 x 600", "x0 < x1"),
        ({"size": (0, 600)}, "0 x 600", "at least 1"),
    ],
)
def test_what_does_not_agree_is_a_problem(asked: dict[str, object], cause: str, cure: str) -> None:
    found, (problem,) = window((100, 50), **asked)
    assert found is None
    assert problem.object == "Photo 'a.png'"
    assert cause in problem.cause
    assert cure in problem.cure


def test_pixels_that_are_not_square_are_wider() -> None:
    """200 x 200 pixels that are 1.5 times as wide as high are the scene's 3:2."""
    found = good((200, 200), pixel_aspect=1.5)
    assert found.aspect == pytest.approx(1.5)
    seen = projection(CAMERA, found)
    assert seen.focal[1] == pytest.approx(1.5 * seen.focal[0])


@pytest.mark.parametrize(
    "fit, size, focal",
    [
        # 50 mm against 36 mm of the longer side, or of the width, or 24 mm of the height.
        ("AUTO", (600, 400), 600 * 50 / 36),
        ("AUTO", (400, 600), 600 * 50 / 36),
        ("HORIZONTAL", (400, 600), 400 * 50 / 36),
        ("VERTICAL", (600, 400), 400 * 50 / 24),
    ],
)
def test_focal_lengths_are_those_of_blender_at_that_size(
    fit: str, size: tuple[int, int], focal: float
) -> None:
    camera = replace(CAMERA, sensor_fit=fit)
    found = projection(camera, good(size, size=size))
    assert found.focal == pytest.approx((focal, focal))
    # A shift of the lens moves the picture by a share of the side that the sensor fits.
    side = focal / (camera.lens_mm / (24.0 if fit == "VERTICAL" else 36.0))
    assert found.centre[0] == pytest.approx(size[0] / 2 - 0.05 * side)
    assert found.centre[1] == pytest.approx(size[1] / 2 - 0.02 * side)


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
@pytest.mark.parametrize("fit", ["AUTO", "HORIZONTAL", "VERTICAL"])
def test_a_crop_is_a_camera_of_its_own(kind: str, fit: str) -> None:
    """Its pixels have the slopes that they have in the whole photo."""
    camera = replace(CAMERA, sensor_fit=fit, kind=kind)
    size, crop = (400, 600), (120, 30, 330, 90)
    whole = projection(camera, good(size, size=size))
    part = good((210, 60), size=size, crop=crop)
    own = cropped_camera(camera, part.aspect, part.fractions)
    seen = projection(own, PhotoWindow((210, 60), (0, 0, 210, 60), 210 / 60))
    for x, y in ((0, 0), (210, 0), (13, 60)):
        for axis, pixel, start in ((0, x, crop[0]), (1, y, crop[1])):
            expected = (pixel + start - whole.centre[axis]) / whole.focal[axis]
            assert (pixel - seen.centre[axis]) / seen.focal[axis] == pytest.approx(expected)
