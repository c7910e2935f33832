# SPDX-License-Identifier: GPL-3.0-or-later
"""Gains beside fields, and halves of the photos: pure functions of pictures."""

from __future__ import annotations

import math

import numpy as np
import pytest

from selenite.report.gain_level import Change, _with_wider, change_of, level_error
from selenite.report.halves import halves

PICTURE = np.full((8, 10, 3), 0.4)
ONES = np.ones_like(PICTURE)


def test_a_field_that_gives_all_light_and_a_gain_compensate_for_each_other() -> None:
    found = change_of([PICTURE] * 2, [PICTURE] * 2, ONES, free=True)
    assert found.gain == pytest.approx(-1) and found.left == pytest.approx(0, abs=1e-12)
    known = change_of([PICTURE] * 2, [PICTURE] * 2, ONES, free=False)
    assert (known.gain, known.left) == (0, pytest.approx(1))


def test_what_a_field_does_not_light_holds_its_brightness() -> None:
    """Half of the picture follows the field: the best gain takes up a half, a quarter is left."""
    slope = PICTURE.copy()
    slope[:, 5:] = 0
    found = change_of([PICTURE] * 2, [slope] * 2, ONES, free=True)
    assert (found.gain, found.left) == (pytest.approx(-0.5), pytest.approx(0.25))


def test_noise_of_renders_leaves_nothing() -> None:
    draw = np.random.default_rng(1)
    pictures = [PICTURE + draw.normal(0, 0.1, PICTURE.shape) for _ in range(2)]
    found = change_of(pictures, pictures, ONES, free=True)
    assert found.gain == pytest.approx(-1, abs=0.05) and found.left < 0.01


def test_only_the_priors_of_gains_hold_a_brightness_that_they_compensate_for() -> None:
    free = [(Change(-1, 0), 0.1)] * 4
    assert level_error(free, [True] * 4) == pytest.approx(0.7 / 2)
    # One photo of known gain, with a tenth of it unexplained in 100 blocks.
    known = [*free, (Change(0, 1), 0.1)]
    assert level_error(known, [True] * 4 + [False]) == pytest.approx(0.01, rel=0.01)


def test_the_error_of_a_level_joins_that_of_the_gain() -> None:
    row = {"gain": (2.0, 2.0, 1.0), "gain_interval_90": [(1.8, 2 / 0.9), (2.0, 2.0), (1.0, 1.0)]}
    found = _with_wider(row, 0.3)["gain_interval_90"]
    wide = math.exp(math.hypot(math.log(1 / 0.9), 1.645 * 0.3))
    assert found[0] == pytest.approx((2 / wide, 2 * wide))
    assert found[2] == pytest.approx((math.exp(-1.645 * 0.3), math.exp(1.645 * 0.3)))


def test_halves_that_want_other_texels() -> None:
    """One half sees all texels a tenth brighter than rendered, the other a tenth darker; of the
    upper ones, the first sees nothing."""
    renders = np.ones((6, 8))
    first, second = 1.1 * renders, 0.9 * renders
    upper = renders.copy()
    upper[:3] = 0
    found = halves((first * upper, upper), (second, renders))
    assert found.mean == pytest.approx(math.log(1.1 / 0.9))
    assert found.texels == pytest.approx(math.log(1.1 / 0.9))
    assert found.both == pytest.approx(0.5)
    assert np.isnan(found.difference[:3]).all()
    assert found.difference[3:] == pytest.approx(math.log(1.1 / 0.9))


def test_halves_that_agree_on_the_mean_alone() -> None:
    renders = np.ones((6, 8))
    pattern = np.where(np.arange(8) % 2, 1.2, 0.8) * renders
    found = halves((pattern, renders), (2 - pattern, renders))
    assert found.mean == pytest.approx(0, abs=1e-9)
    assert found.texels == pytest.approx(math.log(1.2 / 0.8))


def test_halves_without_a_common_texel_are_not_compared() -> None:
    left = np.ones((4, 8))
    left[:, 4:] = 0
    found = halves((left, left), (1 - left, 1 - left))
    assert found.as_json() == {"mean": None, "texels": None, "seen_by_both": 0.0}
    assert "no texel is seen by both" in found.sentence("Body:base_color_texture")
