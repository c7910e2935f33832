# SPDX-License-Identifier: GPL-3.0-or-later
"""What another photo adds: linear algebra on paper, directions in words."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "addon"))

from selenite.information import fisher  # noqa: E402
from selenite.information.fisher import FisherInformation, Noise  # noqa: E402
from selenite.next_camera import report  # noqa: E402
from selenite.next_camera.candidates import Candidate, looking_at  # noqa: E402

UNIT = np.ones(2)


def known(normal: Any, ratio: float = 1.0, doubt: float = 0.0) -> FisherInformation:
    """Information without noise in it, every residual having the variance ratio / weight."""
    matrix = np.asarray(normal, float)
    return FisherInformation(matrix, np.full_like(matrix, doubt), ratio * matrix, ratio, ratio)


def errors(*photos: Information) -> np.ndarray:
    return fisher.errors([fisher.precision(item) for item in photos], UNIT)


def test_errors_are_the_roots_of_the_inverse() -> None:
    matrix = np.array([[4.0, 1.0], [1.0, 2.0]]) * 1e4
    prior = np.diag(1 / (0.29 * UNIT) ** 2)
    expected = np.sqrt(np.diag(np.linalg.inv(matrix / 3 + prior)))
    assert errors(known(matrix, ratio=3.0)) == pytest.approx(expected)


def test_two_equal_photos_halve_the_variance() -> None:
    one = known([[1e6, 2e5], [2e5, 3e6]])
    before, after = errors(one), errors(one, one)
    assert after / before == pytest.approx(np.full(2, np.sqrt(0.5)), rel=1e-3)


def test_a_photo_with_a_blind_spot_is_helped_by_one_without() -> None:
    front, back = known(np.diag([1e6, 0.0])), known(np.diag([0.0, 1e6]))
    before = errors(front)
    assert fisher.determined(before, UNIT).tolist() == [True, False]
    assert before[1] == pytest.approx(0.29)  # as wide as the bounds leave it
    groups = [[0], [1]]
    gains = [fisher.gain(before, errors(front, other), groups) for other in (front, back)]
    assert gains[0] == pytest.approx(np.log(2) / 4, rel=1e-3)
    assert gains[1] == pytest.approx(np.log(0.29 / 0.001) / 2, rel=1e-3)


def test_what_makes_up_for_each_other_is_not_determined_until_a_photo_tells_them_apart() -> None:
    together = known(np.full((2, 2), 1e6))
    apart = known(np.array([[1e6, -1e6], [-1e6, 1e6]]))
    before = errors(together)
    assert not fisher.determined(before, UNIT).any()
    after = errors(together, apart)
    assert after == pytest.approx([1e-3 / np.sqrt(2)] * 2, rel=1e-3)


@pytest.mark.parametrize("value", [-1e4, 1e4])
def test_information_within_its_own_noise_counts_as_none(value: float) -> None:
    noise = known(np.diag([1e6, value]), doubt=(5e3) ** 2)
    assert errors(noise)[1] == pytest.approx(0.29)
    assert errors(known(np.diag([1e6, 0.0])), noise)[1] == pytest.approx(0.29)
    clear = known(np.diag([1e6, 1e4]), doubt=(1e3) ** 2)
    assert errors(clear)[1] == pytest.approx(0.01, rel=2e-3)


def test_another_photo_never_makes_anything_less_known() -> None:
    """200 photos with noise of the size of what they say."""
    rng = np.random.default_rng(3)
    base = known([[1e6, 2e5], [2e5, 3e6]])
    before = errors(base)
    for _ in range(200):
        normal = np.diag([1e6, 3e6]) + 1e6 * rng.standard_normal((2, 2))
        other = FisherInformation((normal + normal.T) / 2, np.full((2, 2), 1e12), normal, 0.5, 2.0)
        assert (errors(base, other) <= before * (1 + 1e-9)).all()


def test_noise_in_the_spread_stays_inside_what_it_can_be() -> None:
    matrix = 1e4 * np.eye(2)
    wild = FisherInformation(matrix, np.zeros((2, 2)), np.diag([-5.0, 1e9]), 0.5, 2.0)
    expected = np.sqrt(np.array([0.5, 2.0]) / 1e4)
    assert errors(wild) == pytest.approx(expected, rel=2e-3)


def test_a_gain_counts_parameters_and_not_channels_and_has_no_unit() -> None:
    before, after = np.array([0.2, 0.2, 0.2, 0.2]), np.array([0.2, 0.2, 0.2, 0.1])
    groups = [[0, 1, 2], [3]]
    found = fisher.gain(before, after, groups)
    assert found == pytest.approx(np.log(2) / 2)
    scale = np.array([1.0, 1.0, 1.0, 3.0])
    assert fisher.gain(scale * before, scale * after, groups) == pytest.approx(found)


def test_cross_products_of_halves_have_no_bias_of_noise() -> None:
    """Noise of standard deviation 3 on a slope of 1, 200 pictures of 48 x 48: mean of the
    information within 5 standard errors; without the halves it would be ten times as much."""
    rng = np.random.default_rng(5)
    weight, picture = np.ones((48, 48)), np.ones((48, 48, 3))
    noise = Noise(spp=64.0, relative=0.01, pixels=1.0)
    variance = np.zeros((48, 48, 3))

    def information_at(deviation: float) -> FisherInformation:
        halves = [1 + deviation * rng.standard_normal((1, 48, 48, 3)) for _ in range(2)]
        return fisher.information((halves[0], halves[1]), variance, picture, weight, noise)

    exact = information_at(0.0)
    assert exact.relative_doubt() == 0
    found = [information_at(3.0) for _ in range(200)]
    values = np.array([item.normal[0, 0] for item in found])
    error = values.std() / np.sqrt(len(values))
    assert abs(values.mean() - exact.normal[0, 0]) < 5 * error
    reported = np.sqrt(np.mean([item.doubt[0, 0] for item in found]))
    assert 0.5 < reported / values.std() < 2  # cautious: channels may vary together


def test_information_is_that_of_the_formula() -> None:
    """Slope 2 everywhere, brightness 1.3 with the share of the mean: n pixels of three channels."""
    weight, picture = np.ones((10, 20)), np.ones((10, 20, 3))
    weight[:, 15:] = 0  # as if they were not there
    halves = np.full((1, 10, 20, 3), 2.0)
    noise = Noise(spp=100.0, relative=0.02, pixels=4.0)
    variance = np.full((10, 20, 3), 0.5)
    found = fisher.information((halves, halves), variance, picture, weight, noise)
    v = 0.5 / 100 + (0.02 * 1.3) ** 2
    w = 1 / (0.5 / 64 + (0.05 * 1.3) ** 2)
    assert found.normal[0, 0] == pytest.approx(4 * w)
    # A slope in all channels, whose noise goes together: three channels are no more than one.
    assert found.spread[0, 0] == pytest.approx(4 * w**2 * v / (4 * 150))
    error = fisher.errors([fisher.precision(found)], np.array([4.0]))[0]
    assert error == pytest.approx(np.sqrt(v / (4 * 4 * 150)), rel=1e-3)
    red = halves * [1.0, 0.0, 0.0]
    found = fisher.information((red, red), variance, picture, weight, noise)
    assert fisher.errors([fisher.precision(found)], np.array([4.0]))[0] == pytest.approx(
        error, rel=1e-3
    )


def test_passes_over_one_picture_are_weighed_by_their_samples() -> None:
    first, second = known([[4.0]], doubt=1.0), known([[8.0]], doubt=1.0)
    both = first.mean(second, 0.25)
    assert both.normal[0, 0] == pytest.approx(5.0)
    assert both.doubt[0, 0] == pytest.approx(0.75**2 + 0.25**2)
    assert known([[0.0]], doubt=1.0).relative_doubt() == np.inf
    assert known([[0.0]]).relative_doubt() == 0  # not seen at all: no samples change that


def test_a_blur_keeps_what_is_even_to_the_border() -> None:
    even = np.full((3, 5, 2), 7.0)
    assert fisher.blurred(even, 2) == pytest.approx(even)
    ramp = np.arange(6.0).reshape(1, 6, 1)
    expected = [0.5, 1.0, 2.0, 3.0, 4.0, 4.5]
    assert fisher.blurred(ramp, 1).ravel() == pytest.approx(expected)


def place(azimuth: float, elevation: float, existing: bool = False) -> Candidate:
    camera: Any = SimpleNamespace(name="Side", matrix=np.eye(4))
    return Candidate(camera, azimuth, elevation, existing)


@pytest.mark.parametrize(
    ("candidate", "words"),
    [
        (place(0, 38), "from the side of 'Front', 38° up"),
        (place(-90, 12), "90° to the left of 'Front', 12° up"),
        (place(90.4, 0), "90° to the right of 'Front', level"),
        (place(180, -20), "from behind, opposite 'Front', 20° down"),
        (place(45, 85), "from straight above"),
        (place(45, 10, existing=True), "camera 'Side'"),
    ],
)
def test_directions_are_told_in_words(candidate: Candidate, words: str) -> None:
    assert report.where(candidate, "Front") == words


@pytest.mark.parametrize("position", [(3.0, 4.0, 5.0), (0.0, 0.0, 2.0), (1.0, 0.0, -7.0)])
def test_a_camera_looks_at_the_centre_and_stands_upright(position: tuple[float, ...]) -> None:
    centre = np.array([1.0, -2.0, 0.5])
    matrix = looking_at(np.array(position) + centre, centre)
    turn = matrix[:3, :3]
    assert turn.T @ turn == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1)
    towards = -np.array(position) / np.linalg.norm(position)
    assert -turn[:, 2] == pytest.approx(towards)
    assert turn[2, 0] == pytest.approx(0)  # the horizon is level
    assert turn[2, 1] >= -1e-12


def test_a_difference_beyond_noise_is_found_and_noise_is_not() -> None:
    """20 renders of a photo that is 3 % off; their own noise is 20 % a half, bright paths more."""
    rng = np.random.default_rng(8)
    render = np.full((40, 40, 3), 0.5)
    pattern = np.where(np.indices((40, 40)).sum(axis=0) % 2, 1.0, -1.0)[..., None]
    level = 0.5 + 0.3 * 0.5  # brightness, with what keeps it away from 0
    off = render + 0.03 * level * pattern
    weight = np.ones((40, 40))

    def found(photo: np.ndarray, bright: float) -> float:
        values = []
        for _ in range(20):
            noise = 0.1 * rng.standard_normal((2, *render.shape))
            noise[:, 5:9, 5:9] += bright * rng.standard_normal((2, 4, 4, 3))
            variance = np.full(render.shape, 2 * 0.1**2)
            variance[5:9, 5:9] += 2 * bright**2
            halves = (render + noise[0], render + noise[1])
            values.append(fisher.relative_square(halves, variance, photo, weight))
        return float(np.mean(values))

    error = 0.1**2 / level**2 / np.sqrt(20 * 4800)  # of products of two halves, plain mean
    assert found(render, 0.0) == pytest.approx(0.0, abs=5 * error)
    assert found(off, 0.0) == pytest.approx(0.03**2, rel=0.02, abs=5 * error)
    # Without the weights the bright places alone would have 100 times this error.
    assert found(off, 10.0) == pytest.approx(0.03**2, rel=0.05, abs=20 * error)


def test_the_weakest_direction_tells_what_more_samples_are_needed_for() -> None:
    one = known([[100.0, 0.0], [0.0, 4.0]], doubt=1.0)
    assert fisher.weakest([one]) == pytest.approx(4.0)
    assert fisher.weakest([one, one]) == pytest.approx(4.0 * np.sqrt(2))
    assert fisher.weakest([known(np.diag([1.0, 0.0]))]) == 0
