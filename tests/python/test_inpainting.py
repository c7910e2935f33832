# SPDX-License-Identifier: GPL-3.0-or-later
"""Texels that no photo sees, filled from those around them."""

import numpy as np
import pytest

from selenite.fit.fields.images import inpainted
from selenite.fit.fields.seen import seen


@pytest.mark.parametrize("shape", [(1, 1), (7, 5), (16, 16), (33, 2)])
def test_what_is_known_stays_and_one_colour_fills_all(shape):
    random = np.random.default_rng(3)
    values = random.uniform(0, 1, (*shape, 3)).astype(np.float32)
    known = random.uniform(size=shape) < 0.3
    known[0, 0] = True
    values[known] = (0.2, 0.5, 0.9)
    assert np.allclose(inpainted(values, known), (0.2, 0.5, 0.9), atol=1e-6)


def test_a_hole_takes_the_colours_of_its_own_side():
    values = np.zeros((16, 16, 3), np.float32)
    values[:, 8:] = 1
    known = np.ones((16, 16), bool)
    known[4:12, 4:12] = False
    wrong = values.copy()
    wrong[~known] = 7
    filled = inpainted(wrong, known)
    assert np.array_equal(filled[known], values[known])
    assert filled[4:12, 4].max() < 0.3
    assert filled[4:12, 11].min() > 0.7
    assert filled.min() >= 0
    assert filled.max() <= 1


def test_nothing_known_stays_as_it_is():
    values = np.full((3, 4, 3), 0.7, np.float32)
    assert np.array_equal(inpainted(values, np.zeros((3, 4), bool)), values)


def test_a_tenth_of_the_usual_coverage_counts_as_unseen():
    coverage = np.array([[1.0, 1.0, 1.0, 0.05, 0.2, 0.0]])
    assert seen(coverage).tolist() == [[True, True, True, False, True, False]]
    assert not seen(np.zeros((2, 2))).any()
