# SPDX-License-Identifier: GPL-3.0-or-later
"""Which pixels of a photo count, and how much: alpha, mask and what is clipped, at its own size and
made smaller."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from selenite import native
from selenite.capture.prepared import Capture, read_captures
from selenite.capture.request import CaptureRequest
from selenite.problems import Problem
from selenite.scene_read.values import CameraValues, SceneValues

WIDTH, HEIGHT = 8, 6


def camera() -> CameraValues:
    return CameraValues(
        name="Front", matrix=np.eye(4), kind="PERSP", lens_mm=50.0, sensor_width=36.0,
        sensor_height=24.0, sensor_fit="AUTO", shift_x=0.0, shift_y=0.0, ortho_scale=6.0,
        clip_start=0.1, clip_end=100.0, pixel_aspect_x=1.0, pixel_aspect_y=1.0, width=WIDTH,
        height=HEIGHT,
    )  # fmt: skip


def picture(value: float = 0.5) -> np.ndarray:
    return np.full((HEIGHT, WIDTH, 3), value, np.float32)


def write(path: Path, pixels: np.ndarray) -> str:
    names = ["R", "G", "B", "A"][: pixels.shape[2]]
    native.image().write_exr(str(path), np.ascontiguousarray(pixels), channel_names=names)
    return str(path)


def read(photo: str, mask: str = "", height: int = HEIGHT) -> Capture:
    """The one capture, and nothing wrong with it."""
    problems: list[Problem] = []
    scene = SceneValues(cameras=[camera()])
    requests = [CaptureRequest("Front", photo, mask)]
    (found,) = read_captures(scene, requests, height, problems, [], {})
    assert not problems
    return found


def with_alpha(folder: Path) -> str:
    """The upper half is transparent, the lower one opaque but for a quarter."""
    alpha = np.ones((HEIGHT, WIDTH, 1), np.float32)
    alpha[: HEIGHT // 2], alpha[-1] = 0.0, 0.25
    # As OpenEXR has it: colours are multiplied by the alpha.
    return write(folder / "photo.exr", np.dstack([picture() * alpha, alpha]))


def mask_of(folder: Path, left: float, right: float) -> str:
    pixels = picture(left)
    pixels[:, WIDTH // 2 :] = right
    native.image().write_png(str(folder / "mask.png"), native.image().srgb_decode(pixels))
    return str(folder / "mask.png")


def test_a_mask_is_multiplied_with_the_alpha(tmp_path: Path) -> None:
    weight = read(with_alpha(tmp_path), mask_of(tmp_path, 1.0, 0.5)).weight
    assert (weight[: HEIGHT // 2] == 0).all(), "transparent, whatever the mask says"
    assert (weight[HEIGHT // 2] == 0).all(), "the rim of what is opaque"
    np.testing.assert_allclose(weight[HEIGHT // 2 + 1, : WIDTH // 2], 1, atol=2e-3)
    np.testing.assert_allclose(weight[HEIGHT // 2 + 1, WIDTH // 2 :], 0.5, atol=4e-3)
    np.testing.assert_allclose(weight[-1, : WIDTH // 2], 0.25, atol=2e-3)
    np.testing.assert_allclose(weight[-1, WIDTH // 2 :], 0.125, atol=2e-3)


def test_black_of_the_mask_does_not_count_and_white_does(tmp_path: Path) -> None:
    photo = write(tmp_path / "photo.exr", picture())
    assert (read(photo).weight == 1).all()
    weight = read(photo, mask_of(tmp_path, 0.0, 1.0)).weight
    rim = WIDTH // 2
    assert (weight[:, : rim + 1] == 0).all() and (weight[:, rim + 1 :] == 1).all()


def test_clipped_pixels_do_not_count(tmp_path: Path) -> None:
    pixels = picture()
    pixels[1, 2] = 1.0
    pixels[3, 4, 1] = 1.0  # one channel is enough
    native.image().write_png(str(tmp_path / "photo.png"), pixels)
    weight = read(str(tmp_path / "photo.png")).weight
    assert {tuple(place) for place in np.argwhere(weight == 0)} == {(1, 2), (3, 4)}


def test_a_small_pixel_counts_only_if_all_that_it_covers_does(tmp_path: Path) -> None:
    """Half the size: nothing of the background or of a clipped highlight bleeds into it."""
    pixels = picture()
    pixels[0, 1] = 1.0
    native.image().write_png(str(tmp_path / "photo.png"), pixels)
    found = read(str(tmp_path / "photo.png"), height=HEIGHT // 2)
    assert found.reference.shape == (HEIGHT // 2, WIDTH // 2, 3)
    assert {tuple(place) for place in np.argwhere(found.weight == 0)} == {(0, 0)}
    masked = mask_of(tmp_path, 0.0, 1.0)
    photo = picture(0.25)
    photo[:, : WIDTH // 2] = 900
    found = read(write(tmp_path / "bright.exr", photo), masked, height=2)
    counted = found.weight > 0
    assert counted.any() and not counted.all()
    np.testing.assert_allclose(found.reference[counted], 0.25, rtol=1e-5)


def test_the_fit_gets_what_was_read(tmp_path: Path) -> None:
    pixels = picture()
    pixels[..., 0], pixels[..., 2] = 0.75, 0.125
    given = read(write(tmp_path / "photo.exr", pixels)).native()
    assert (given.id, given.camera) == ("Front", "Front")
    assert given.frame == (pytest.approx(WIDTH / HEIGHT), WIDTH, HEIGHT)
    assert given.reference[0, 0] == pytest.approx([0.75, 0.5, 0.125])
