# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos that a lens distorts are undistorted as they are read."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from selenite import native
from selenite.capture.prepared import Capture, read_captures
from selenite.capture.request import CaptureRequest
from selenite.problems import Problem
from selenite.scene_read.lens import CameraLens, LensDistortion
from selenite.scene_read.values import CameraValues, SceneValues

WIDTH, HEIGHT = 480, 320
#: 36 mm of sensor: a focal length of 400 pixels, and a centre off the middle.
CAMERA = CameraValues(
    name="Front", matrix=np.eye(4), kind="PERSP", lens_mm=30.0, sensor_width=36.0,
    sensor_height=24.0, sensor_fit="HORIZONTAL", shift_x=0.01, shift_y=-0.005, ortho_scale=6.0,
    clip_start=0.1, clip_end=100.0, pixel_aspect_x=1.0, pixel_aspect_y=1.0, width=WIDTH,
    height=HEIGHT,
)  # fmt: skip
CENTRE = (WIDTH / 2 - 0.01 * WIDTH, HEIGHT / 2 - 0.005 * WIDTH)
#: Up to 9 pixels at the corners.
LENS = LensDistortion(
    fx=400.0, fy=400.0, cx=CENTRE[0], cy=CENTRE[1], k1=-0.12, k2=0.05, k3=-0.01, p1=0.002, p2=-0.003
)
#: Where the ideal picture has dots, in its pixels.
ACROSS, DOWN = np.arange(30.0, 451, 60), np.arange(22.0, 300, 55)
DOTS = np.stack(np.meshgrid(ACROSS, DOWN), -1).reshape(-1, 2)
SIGMA = 3.0


def opencv_distorted(points: np.ndarray, lens: LensDistortion = LENS) -> np.ndarray:
    """(n, 2) ideal pixels to those of the photo, by OpenCV's formulas with its p1 and p2; the
    coefficients that it has not as Metashape's manual has them."""
    p1, p2 = lens.p2, lens.p1
    x, y = ((points - (lens.cx, lens.cy)) / (lens.fx, lens.fy)).T
    r2 = x**2 + y**2
    radial = 1 + lens.k1 * r2 + lens.k2 * r2**2 + lens.k3 * r2**3 + lens.k4 * r2**4
    more = 1 + lens.p3 * r2 + lens.p4 * r2**2
    xd = x * radial + (2 * p1 * x * y + p2 * (r2 + 2 * x**2)) * more
    yd = y * radial + (p1 * (r2 + 2 * y**2) + 2 * p2 * x * y) * more
    return np.stack([xd * lens.fx + yd * lens.b2 + lens.cx, yd * lens.fy + lens.cy], -1)


def ideal_of(points: np.ndarray, lens: LensDistortion = LENS) -> np.ndarray:
    """The inverse, by fixed-point iteration."""
    found = points.copy()
    for _ in range(40):
        found += points - opencv_distorted(found, lens)
    assert np.abs(opencv_distorted(found, lens) - points).max() < 1e-9
    return found


def dots_at(points: np.ndarray) -> np.ndarray:
    """The ideal picture at (n, 2) places: grey with bright Gaussian dots."""
    across = np.exp(-((points[:, :1] - ACROSS) ** 2) / (2 * SIGMA**2)).sum(1)
    down = np.exp(-((points[:, 1:] - DOWN) ** 2) / (2 * SIGMA**2)).sum(1)
    return 0.1 + 0.8 * across * down


def photo(
    folder: Path, size: tuple[int, int] = (WIDTH, HEIGHT), lens: LensDistortion = LENS
) -> str:
    """What the lens makes of the picture, each pixel the mean of 2 x 2 points in it."""
    steps = (np.arange(2) + 0.5) / 2
    total = np.zeros((size[1], size[0]))
    for dx in steps:
        for dy in steps:
            x, y = np.meshgrid(np.arange(size[0]) + dx, np.arange(size[1]) + dy)
            places = np.stack([x * WIDTH / size[0], y * HEIGHT / size[1]], -1).reshape(-1, 2)
            total += dots_at(ideal_of(places, lens)).reshape(total.shape) / 4
    pixels = np.repeat(total[..., None], 3, axis=-1).astype(np.float32)
    native.image().write_exr(str(folder / "photo.exr"), pixels)
    return str(folder / "photo.exr")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> str:
    return photo(tmp_path_factory.mktemp("whole"))


def read(
    path: str, height: int, warnings: list[str] | None = None, **asked: object
) -> tuple[list[Capture], list[Problem]]:
    problems: list[Problem] = []
    asked.setdefault("distortion", LENS)
    request = CaptureRequest("Front", path, **asked)  # type: ignore[arg-type]
    scene = SceneValues(cameras=[CAMERA])
    said = [] if warnings is None else warnings
    return read_captures(scene, [request], height, problems, said, {}), problems


def centres(picture: np.ndarray, dots: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Centroids of what is brighter than the ground around each of the dots; picture and dots
    show so many pixels, and so do the results."""
    rows, columns = picture.shape
    y, x = np.mgrid[:rows, :columns] + 0.5
    x, y = x * size[0] / columns, y * size[1] / rows
    found = []
    for dot in dots:
        near = (np.abs(x - dot[0]) < 5 * SIGMA) & (np.abs(y - dot[1]) < 5 * SIGMA)
        light = np.where(near, np.maximum(picture - 0.1, 0), 0)
        found.append([(light * x).sum() / light.sum(), (light * y).sum() / light.sum()])
    return np.array(found)


@pytest.mark.parametrize("height", [HEIGHT, HEIGHT // 2, 127])
def test_dots_are_where_the_camera_renders_them(whole: str, height: int) -> None:
    moved = np.linalg.norm(opencv_distorted(DOTS) - DOTS, axis=1)
    assert moved.max() > 5
    (capture,), problems = read(whole, height)
    assert not problems
    picture = capture.reference[..., 0].astype(np.float64)
    assert np.abs(centres(picture, DOTS, (WIDTH, HEIGHT)) - DOTS).max() < 0.05


#: Each moves some dot by more than a third of a pixel.
UNUSUAL = replace(LENS, b2=12.0, k4=0.08, p3=1.5, p4=-2.5)


@pytest.mark.parametrize("name", ["b2", "k4", "p3", "p4"])
def test_skew_and_high_orders_are_undone(tmp_path: Path, name: str) -> None:
    lens = replace(LENS, p1=0.01, p2=-0.01, **{name: getattr(UNUSUAL, name)})
    without = replace(lens, **{name: 0.0})
    moved = opencv_distorted(DOTS, lens) - opencv_distorted(DOTS, without)
    assert np.linalg.norm(moved, axis=1).max() > 0.33
    path = photo(tmp_path, lens=lens)
    (capture,), problems = read(path, HEIGHT, distortion=lens)
    assert not problems
    shown = capture.weight[DOTS[:, 1].astype(int), DOTS[:, 0].astype(int)] > 0
    picture = capture.reference[..., 0].astype(np.float64)
    found = centres(picture, DOTS[shown], (WIDTH, HEIGHT))
    assert shown.mean() > 0.8 and np.abs(found - DOTS[shown]).max() < 0.05


def kept(lens: LensDistortion, size: tuple[int, int] = (WIDTH, HEIGHT)) -> SceneValues:
    """A scene whose camera keeps the lens of its import."""
    return SceneValues(cameras=[replace(CAMERA, lens=CameraLens(size, lens))])


@pytest.mark.parametrize("scale", [1, 2])
def test_a_photo_gets_the_lens_of_its_camera(whole: str, scale: int) -> None:
    """Which is that of a calibration at any size: here twice the photo's too."""
    scene = kept(LENS.at_scale(scale, scale), (scale * WIDTH, scale * HEIGHT))
    problems, warnings = list[Problem](), list[str]()
    requests = [CaptureRequest("Front", whole), CaptureRequest("Front", whole)]
    captures = read_captures(scene, requests, HEIGHT, problems, warnings, {})
    assert not problems and len(captures) == 2
    picture = captures[0].reference[..., 0].astype(np.float64)
    assert np.abs(centres(picture, DOTS, (WIDTH, HEIGHT)) - DOTS).max() < 0.05
    (remark,) = [text for text in warnings if "kept by the import" in text]
    assert remark.startswith("Lens of 'Front', kept") and "is undone in the photos" in remark


def test_a_photo_may_say_that_it_is_free_of_the_lens(whole: str) -> None:
    """Or that its lens is another one."""
    request = CaptureRequest.from_json({"camera": "Front", "photo": whole, "distortion": False})
    assert CaptureRequest.from_json(request.as_json()) == request
    plain = read_captures(kept(LENS), [request], HEIGHT, [], [], {})[0]
    stored = native.image().read(whole)[0]
    assert np.abs(plain.reference - stored).max() < 1e-6
    own = replace(request, distortion=LENS)
    other = kept(replace(LENS, k1=0.3))
    (capture,) = read_captures(other, [own], HEIGHT, [], [], {})
    picture = capture.reference[..., 0].astype(np.float64)
    assert np.abs(centres(picture, DOTS, (WIDTH, HEIGHT)) - DOTS).max() < 0.05


def test_a_photo_of_another_shape_keeps_what_its_lens_did(whole: str) -> None:
    """And is told, as the calibration cannot be of its pixels."""
    warnings: list[str] = []
    scene = kept(LENS, (WIDTH, WIDTH))
    (capture,) = read_captures(scene, [CaptureRequest("Front", whole)], HEIGHT, [], warnings, {})
    assert np.abs(capture.reference - native.image().read(whole)[0]).max() < 1e-6
    assert "the photos have another shape than its calibration" in warnings[0]


def test_a_photo_in_other_pixels_is_undistorted_alike(tmp_path: Path) -> None:
    """The lens is that of the whole photo, of which the file is a smaller copy."""
    path = photo(tmp_path, (WIDTH // 2, HEIGHT // 2))
    (capture,), problems = read(path, HEIGHT // 2, size=(WIDTH, HEIGHT))
    assert not problems
    picture = capture.reference[..., 0].astype(np.float64)
    assert np.abs(centres(picture, DOTS, (WIDTH, HEIGHT)) - DOTS).max() < 0.05


def test_a_crop_is_undistorted_as_part_of_its_photo(tmp_path: Path, whole: str) -> None:
    pixels = native.image().read(whole)[0]
    crop = (90, 60, 330, 260)
    part = np.ascontiguousarray(pixels[crop[1] : crop[3], crop[0] : crop[2]])
    native.image().write_exr(str(tmp_path / "part.exr"), part)
    (capture,), problems = read(str(tmp_path / "part.exr"), 200, size=(WIDTH, HEIGHT), crop=crop)
    assert not problems
    inside = (DOTS > (110, 80)).all(1) & (DOTS < (310, 240)).all(1)
    assert inside.sum() == 6
    shifted = DOTS[inside] - crop[:2]
    found = centres(capture.reference[..., 0].astype(np.float64), shifted, (240, 200))
    assert np.abs(found - shifted).max() < 0.05


def test_what_the_photo_does_not_show_has_no_weight(whole: str) -> None:
    """A lens with k1 > 0 spreads the picture: its rim is outside of the photo."""
    lens = replace(LENS, k1=0.3, k2=0.0, k3=0.0, p1=0.0, p2=0.0)
    (capture,), problems = read(whole, HEIGHT, distortion=lens)
    assert not problems
    assert (capture.weight[[0, 0, -1, -1], [0, -1, 0, -1]] == 0).all()
    assert capture.weight[HEIGHT // 2, WIDTH // 2] == 1
    # Of the corner: r = .75, so the photo holds what is below .75 = r (1 + .3 r^2), r = .65.
    assert 0.7 < capture.mask_share < 0.95


def test_where_the_model_folds_back_nothing_is_seen(whole: str) -> None:
    lens = replace(LENS, k1=-1.0, k2=0.0, k3=0.0, p1=0.0, p2=0.0)
    (capture,), problems = read(whole, HEIGHT, distortion=lens)
    assert not problems
    # r (1 - r^2) grows up to r = .577, 231 pixels from the centre.
    y, x = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    radius = np.hypot(x - CENTRE[0], y - CENTRE[1])
    assert (capture.weight[radius > 233] == 0).all()
    assert (capture.weight[radius < 150] > 0.999).all()


def test_a_lens_of_another_camera_is_named(whole: str) -> None:
    warnings: list[str] = []
    read(whole, 32, warnings)
    assert not warnings
    read(whole, 32, warnings, distortion=replace(LENS, fx=800.0, fy=800.0))
    assert "focal lengths 800.0, 800.0" in warnings[0]
    assert "camera 400.0, 400.0" in warnings[0]


def test_a_lens_that_folds_within_the_picture_is_named(whole: str) -> None:
    """As from coefficients for pixels, or for another order of powers. A rim is no fault."""
    warnings: list[str] = []
    straight = replace(LENS, k2=0.0, k3=0.0, p1=0.0, p2=0.0)
    read(whole, HEIGHT, warnings, distortion=replace(straight, k1=-0.62))  # from r = .73 of .75
    assert not warnings
    read(whole, HEIGHT, warnings, distortion=replace(straight, k1=-1.0))
    assert "lies where its distortion folds back" in warnings[0]


def test_a_lens_whose_photo_shows_nothing_is_refused(whole: str) -> None:
    found, problems = read(whole, HEIGHT, distortion=replace(LENS, cx=48000.0))
    assert not found
    assert problems[0].cause == "by its distortion it shows nothing of what camera 'Front' takes"
    assert problems[0].cure.startswith("give fx, fy, cx, cy in pixels of the whole photo")


def test_an_orthographic_camera_has_no_lens(whole: str) -> None:
    problems: list[Problem] = []
    request = CaptureRequest("Front", whole, distortion=LENS)
    scene = SceneValues(cameras=[replace(CAMERA, kind="ORTHO")])
    assert not read_captures(scene, [request], 32, problems, [], {})
    assert "orthographic" in problems[0].cause
