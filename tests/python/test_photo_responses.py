# SPDX-License-Identifier: GPL-3.0-or-later
"""Responses of a camera, as they are written, and which code values count."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from selenite import native
from selenite.capture.prepared import Capture, read_captures
from selenite.capture.request import CaptureRequest
from selenite.capture.response import read_response
from selenite.problems import Problem
from selenite.scene_read.values import CameraValues, SceneValues

WIDTH, HEIGHT = 8, 6
CAMERA = CameraValues(
    name="Front", matrix=np.eye(4), kind="PERSP", lens_mm=50.0, sensor_width=36.0,
    sensor_height=24.0, sensor_fit="AUTO", shift_x=0.0, shift_y=0.0, ortho_scale=6.0,
    clip_start=0.1, clip_end=100.0, pixel_aspect_x=1.0, pixel_aspect_y=1.0, width=WIDTH,
    height=HEIGHT,
)  # fmt: skip
#: Light in the photo's columns, and the sRGB code values of its file.
LIGHT = np.linspace(0.05, 0.8, WIDTH)
CODES = native.image().srgb_encode(LIGHT.astype(np.float32)).astype(np.float64)


def photo(folder: Path) -> str:
    pixels = np.repeat(np.tile(LIGHT, (HEIGHT, 1))[..., None], 3, axis=-1).astype(np.float32)
    native.image().write_png(str(folder / "photo.png"), pixels, 16)
    return str(folder / "photo.png")


def read(folder: Path, **asked: object) -> Capture:
    problems: list[Problem] = []
    request = CaptureRequest("Front", photo(folder), **asked)  # type: ignore[arg-type]
    found = read_captures(SceneValues(cameras=[CAMERA]), [request], HEIGHT, problems, [], {})
    assert not problems
    return found[0]


def test_light_is_what_the_response_makes_of_code_values(tmp_path: Path) -> None:
    table = tmp_path / "camera.csv"
    table.write_text("code value, light\n0, 0\n0.5, 0.1\n1, 2\n")
    for response, expected in (
        ("auto", LIGHT),
        ("srgb", LIGHT),
        ("linear", CODES),
        ("gamma:2.2", CODES**2.2),
        (str(table), np.interp(CODES, [0, 0.5, 1], [0, 0.1, 2])),
    ):
        got = read(tmp_path, response=response).reference
        np.testing.assert_allclose(got[0, :, 1], expected, rtol=1e-3, err_msg=response)


def test_channels_may_have_responses_of_their_own(tmp_path: Path) -> None:
    table = tmp_path / "camera.csv"
    table.write_text("0;0;0;0\n1;1;0.5;2\n")
    got = read(tmp_path, response=str(table)).reference
    np.testing.assert_allclose(got[2], CODES[:, None] * [1, 0.5, 2], rtol=1e-3)


def test_code_values_outside_of_the_clip_levels_do_not_count(tmp_path: Path) -> None:
    weight = read(tmp_path, clip=(0.4, 0.8)).weight
    np.testing.assert_array_equal(weight[0] > 0, (CODES >= 0.4) & (CODES <= 0.8))


def test_a_table_says_nothing_beyond_its_rows(tmp_path: Path) -> None:
    table = tmp_path / "camera.csv"
    table.write_text("0.4 0.1\n0.8 0.9\n")
    weight = read(tmp_path, response=str(table)).weight
    np.testing.assert_array_equal(weight[0] > 0, (CODES >= 0.4) & (CODES <= 0.8))


@pytest.mark.parametrize(
    "text, cause",
    [
        ("0,0\n", "1 rows"),
        ("0,0\n0.5,0.2\n0.4,0.3\n", "line 3 does not rise"),
        ("0,0.2\n0.5,0.1\n", "line 2 does not rise"),
        ("0,0\n255,1\n", "divide code values"),
        ("0,0\n1,nan\n", "not finite"),
        ("0,0\n1,-1\n", "below 0"),
        ("0,0\nhalf,1\n", "line 2 holds 'half,1'"),
        ("0,0,0\n1,1,1\n", "has 3 numbers"),
        ("0,0\n1,1,1,1\n", "has 4 numbers"),
    ],
)
def test_what_is_no_table_is_a_problem(tmp_path: Path, text: str, cause: str) -> None:
    table = tmp_path / "camera.csv"
    table.write_text(text)
    problems: list[Problem] = []
    assert read_response(str(table), problems) is None
    assert problems[0].object == f"Response '{table}'"
    assert cause in problems[0].cause


@pytest.mark.parametrize(
    "text, cause",
    [
        ("gamma:", "exponent"),
        ("gamma:0", "exponent"),
        ("gamma:nan", "exponent"),
        ("sRGB", "it does not exist"),
        ("none.csv", "it does not exist"),
    ],
)
def test_what_is_no_response_is_a_problem(text: str, cause: str) -> None:
    problems: list[Problem] = []
    assert read_response(text, problems) is None
    assert cause in problems[0].cause
    assert "gamma:2.2" in problems[0].cure
