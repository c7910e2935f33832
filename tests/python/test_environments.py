# SPDX-License-Identifier: GPL-3.0-or-later
"""Environment images: sizes, energy while they are resampled, photos of mirror balls."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("numpy", reason="NumPy is not installed")

from selenite.environments import bright_spots, mirror_ball, sphere  # noqa: E402


def turned_about_z(angle: float) -> np.ndarray:
    """(3, 3)"""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def room(rows: int = 64) -> np.ndarray:
    """A dim room with a lamp of one pixel, 50000 times as bright."""
    image = np.random.default_rng(1).random((rows, 2 * rows, 3)).astype(np.float32)
    image[rows // 3, rows // 5] = (30000, 50000, 20000)
    return image


@pytest.mark.parametrize(
    ("count", "size"),
    [(8, (2, 4)), (128, (8, 16)), (512, (16, 32)), (2048, (32, 64)), (200, (10, 20))],
)
def test_the_nearest_grid_is_twice_as_wide_as_high(count: int, size: tuple[int, int]) -> None:
    assert sphere.grid_of(count) == size


def test_every_grid_is_its_own_nearest() -> None:
    for count in range(8, 2049):
        rows, columns = sphere.grid_of(count)
        assert sphere.grid_of(rows * columns) == (rows, columns)
        assert abs(rows * columns - count) <= 4 * rows + 2


def test_directions_are_those_of_the_pixels() -> None:
    d = sphere.directions(8, 16)
    row, column = sphere.places(d, 8, 16)
    assert (row == np.arange(8)[:, None]).all() and (column == np.arange(16)).all()
    # The top is +Z; columns begin at -X and go by +Y.
    assert d[0, :, 2].min() > 0.9
    np.testing.assert_allclose(sphere.directions(1, 4)[0, :, :2], [
        [-(0.5**0.5), 0.5**0.5], [0.5**0.5, 0.5**0.5], [0.5**0.5, -(0.5**0.5)],
        [-(0.5**0.5), -(0.5**0.5)],
    ], atol=1e-12)  # fmt: skip
    assert sphere.solid_angles(8, 16).sum() * 16 == pytest.approx(4 * np.pi)


@pytest.mark.parametrize("angle", [0.0, 0.3, 2.5])
@pytest.mark.parametrize("rows", [2, 8, 11, 32])
def test_resampling_keeps_the_mean_over_the_sphere(angle: float, rows: int) -> None:
    image = room()
    found = sphere.resampled(image, turned_about_z(angle), rows, 2 * rows)
    # Pixels belong to the texel of their centre, so that texels vary in size by a few of them.
    bound = 1e-5 if 64 % rows == 0 and not angle else 0.04
    assert sphere.mean(found) == pytest.approx(sphere.mean(image), rel=bound)


def test_a_lamp_goes_to_where_the_mapping_turns_it() -> None:
    image = np.zeros((32, 64, 3), np.float32)
    image[12, 20] = 100
    to_map = turned_about_z(1.0)
    found = sphere.resampled(image, to_map, 8, 16)
    place = np.unravel_index(found[..., 0].argmax(), (8, 16))
    direction = to_map.T @ sphere.directions(32, 64)[12, 20]
    assert place == tuple(int(x) for x in sphere.places(direction, 8, 16))
    assert np.count_nonzero(found[..., 0]) == 1


def test_a_coarse_image_becomes_finer_without_a_change() -> None:
    image = np.random.default_rng(2).random((2, 4, 3)).astype(np.float32)
    found = sphere.resampled(image, np.eye(3), 8, 16)
    np.testing.assert_allclose(found, image.repeat(4, axis=0).repeat(4, axis=1), rtol=1e-6)


def test_lookups_interpolate_between_pixels_and_over_the_seam() -> None:
    image = np.random.default_rng(3).random((8, 16, 3)).astype(np.float32)
    np.testing.assert_allclose(sphere.looked_up(image, sphere.directions(8, 16)), image, atol=1e-5)
    equator = np.array([[-1.0, 1e-9, 0.0], [-1.0, -1e-9, 0.0]])  # both sides of the seam
    between = image[3:5, [0, -1]].mean(axis=(0, 1))
    np.testing.assert_allclose(sphere.looked_up(image, equator), [between] * 2, atol=1e-5)


def ball_photo(image: np.ndarray, size: int) -> np.ndarray:
    """A mirror ball that a far camera on -Y sees, by reflection at each pixel of its disc."""
    u = (np.arange(size) + 0.5) / size * 2 - 1
    x, z = np.meshgrid(u, -u)
    y = -np.sqrt(np.maximum(1 - x**2 - z**2, 0))
    normal = np.stack([x, y, z], axis=-1)
    view = np.array([0.0, 1.0, 0.0])
    mirrored = view - 2 * (normal @ view)[..., None] * normal
    inside = (x**2 + z**2 <= 1)[..., None]
    return np.where(inside, sphere.looked_up(image, mirrored), 0).astype(np.float32)


def test_a_photo_of_a_mirror_ball_gives_the_room_back() -> None:
    d = sphere.directions(64, 128)
    image = np.stack([1 + d[..., 0], 1 + 0.5 * d[..., 2], 2 - d[..., 1]], axis=-1)
    photo = ball_photo(image.astype(np.float32), 400)
    found = mirror_ball.equirectangular(photo)
    assert found.shape == (200, 400, 3)
    e = sphere.directions(200, 400)
    true = np.stack([1 + e[..., 0], 1 + 0.5 * e[..., 2], 2 - e[..., 1]], axis=-1)
    error = np.abs(found - true).max(axis=-1)
    seen = e[..., 1] < 0.9  # the rim of the ball is left out, where a pixel is a wide cone
    assert error[seen].max() < 0.05
    assert mirror_ball.why_not(photo) == ""
    assert "400 x 300 pixels are no square" in mirror_ball.why_not(photo[:300])


def irradiance(image: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(3,): of a surface that faces `normal`, under an interpolated image."""
    d = sphere.directions(256, 512)
    light = sphere.looked_up(image.astype(np.float64), d)
    weight = sphere.solid_angles(256, 512)[:, None] * np.maximum(d @ normal, 0)
    return np.asarray((light * weight[..., None]).sum(axis=(0, 1)))


def test_suns_hold_the_light_that_is_taken_out() -> None:
    image = np.full((32, 64, 3), 0.3, np.float32)
    image[8:10, 40:42] = (90, 60, 30)  # high up
    image[20, 0] = image[20, 63] = (10, 20, 40)  # over the seam
    found, rest = bright_spots.suns(image, 4)
    assert len(found) == 2
    np.testing.assert_allclose(rest, 0.3, rtol=1e-5)
    high, low = found
    assert high.irradiance[0] > high.irradiance[2] and low.irradiance[2] > low.irradiance[0]
    for sun in found:
        before, after = (irradiance(item, np.array(sun.direction)) for item in (image, rest))
        others = sum(
            np.array(item.irradiance) * max(0.0, float(np.dot(item.direction, sun.direction)))
            for item in found
        )
        np.testing.assert_allclose(before - after, others, rtol=0.02)
    d = sphere.directions(32, 64)[8:10, 40:42].mean(axis=(0, 1))
    assert np.dot(high.direction, d / np.linalg.norm(d)) > 0.9999
    # Two texels of 5.6 degrees, and what interpolation adds at their rims.
    assert np.degrees(high.angle) == pytest.approx(2 * 5.6, rel=0.35)
    assert np.dot(low.direction, (-1, 0, low.direction[2])) > 0.999 - low.direction[2] ** 2


def test_no_more_suns_than_asked_for_and_none_without_a_spot() -> None:
    image = np.full((16, 32, 3), 0.3, np.float32)
    assert bright_spots.suns(image, 4)[0] == []
    for column, radiance in ((3, 40), (12, 90), (22, 60)):
        image[5, column] = radiance
    found, rest = bright_spots.suns(image, 2)
    assert len(found) == 2 and rest[5, 3, 0] == 40
    assert found[0].irradiance[0] / found[1].irradiance[0] == pytest.approx(90 / 60, rel=0.01)


def test_what_is_not_known_of_a_sphere_is_continued_smoothly() -> None:
    rows, columns = 8, 16
    image = np.zeros((rows, columns, 3), np.float32)
    image[:4] = np.random.default_rng(3).uniform(0.5, 1.5, (4, columns, 3))
    known = np.zeros((rows, columns), bool)
    known[:4] = True
    found = sphere.continued(image, known)
    assert np.array_equal(found[:4], image[:4])
    # Between the least and the largest value beside it, and ever smoother away from there.
    edge = image[3]
    assert (found[4:] >= edge.min(axis=0)).all() and (found[4:] <= edge.max(axis=0)).all()
    assert (np.diff(found[3:].std(axis=1), axis=0) < 0).all()
    assert np.allclose(found[-1].mean(axis=0), edge.mean(axis=0), rtol=1e-4)
    # The first column is beside the last one.
    turned = sphere.continued(np.roll(image, 5, axis=1), known)
    assert np.allclose(turned, np.roll(found, 5, axis=1), atol=1e-6)
    for same in (np.zeros_like(known), np.ones_like(known)):
        assert sphere.continued(image, same) is image
