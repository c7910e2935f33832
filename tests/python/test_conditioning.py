# SPDX-License-Identifier: GPL-3.0-or-later
"""Which parameters wait for the last stage: matrices on paper."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "addon"))

from selenite.advice.information import fisher  # noqa: E402
from selenite.advice.information.conditioning import deferred  # noqa: E402

APART = [[0], [1], [2]]


def waiting(matrix: object, groups: list[list[int]] | None = None) -> list[int]:
    precision = np.asarray(matrix, float)
    return deferred([precision], np.ones(len(precision)), groups or APART)[0]


def test_what_is_determined_or_unknown_altogether_is_fitted_at_once() -> None:
    assert waiting(np.diag([1e4, 1e6, 1e3])) == []
    assert waiting(np.diag([1.0, 0.0, 5.0])) == []


def test_what_the_photos_do_not_determine_waits() -> None:
    assert waiting(np.diag([1e6, 4.0, 1e6])) == [1]
    # A colour waits as a whole for the one channel that is not known.
    assert waiting(np.diag([1e6, 1e6, 4.0]), [[0], [1, 2]]) == [1]


def test_two_that_make_up_for_each_other_wait_for_what_stands_alone() -> None:
    pair = np.full((2, 2), 1e6)
    matrix = np.zeros((3, 3))
    matrix[:2, :2], matrix[2, 2] = pair, 1e4
    assert waiting(matrix) == [0, 1]


def test_where_none_stands_alone_the_one_whose_error_grows_most_waits() -> None:
    """Third = first + second in the pictures; the second is seen best, so it grows most."""
    slopes = np.array([[1e2, 0.0], [0.0, 1e4], [1e2, 1e4]])
    matrix = slopes @ slopes.T
    together = fisher.errors([matrix], np.ones(3))
    assert not fisher.determined(together, np.ones(3)).any()
    assert waiting(matrix) in ([1], [2])
    rest = [k for k in range(3) if k not in waiting(matrix)]
    left = fisher.errors([matrix], np.ones(3), rest)
    assert fisher.determined(left, np.ones(2)).all()


def test_errors_with_the_others_known_are_those_of_the_part_alone() -> None:
    matrix = np.array([[4.0, 1.9], [1.9, 1.0]]) * 1e4
    prior = 1 / 0.29**2
    alone = fisher.errors([matrix], np.ones(2), [1])
    assert np.allclose(alone, 1 / np.sqrt(1e4 + prior))
    assert fisher.errors([matrix], np.ones(2))[1] > 3 * alone[0]
