# SPDX-License-Identifier: GPL-3.0-or-later
"""When a fit counts as arrived: bench/synthetic/curves.py."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bench"))

from synthetic import race_report  # noqa: E402
from synthetic.cases import make  # noqa: E402
from synthetic.curves import Curve, at_smallest  # noqa: E402


def curve(*errors: float) -> Curve:
    """An answer every two seconds."""
    return Curve(2.0 * np.arange(1, len(errors) + 1), np.array(errors))


def test_a_fit_has_arrived_with_its_first_answer_below_the_level() -> None:
    assert curve(0.4, 0.04, 0.2, 0.03).reached(0.05) == 4.0
    assert curve(0.4, 0.05).reached(0.05) is None


def test_a_fit_has_converged_where_no_later_answer_leaves_the_level() -> None:
    assert curve(0.4, 0.04, 0.2, 0.03).converged(0.05) == 8.0
    assert curve(0.04, 0.03).converged(0.05) == 2.0
    assert curve(0.04, 0.06).converged(0.05) is None


def test_a_run_that_ends_inside_by_chance_has_not_converged() -> None:
    assert curve(0.4, 0.4, 0.4, 0.03).converged(0.05, hold=0.25) is None
    assert curve(0.4, 0.03, 0.03).converged(0.05, hold=0.5) == 4.0
    assert curve(0.4, 0.03, 0.03).converged(0.05, hold=0.6) is None


def test_the_late_share_looks_at_the_last_quarter_of_the_time() -> None:
    assert curve(0.01, 0.01, 0.01, 0.01, 0.4, 0.4, 0.01, 0.4).late_share(0.05) == pytest.approx(
        1 / 3
    )


def test_an_error_that_is_no_number_is_not_below_any_level() -> None:
    assert curve(float("nan"), 0.04).reached(0.05) == 4.0
    assert curve(0.04, float("nan")).converged(0.05) is None


def test_a_curve_that_goes_back_in_time_is_refused() -> None:
    with pytest.raises(ValueError, match="ascend"):
        Curve(np.array([2.0, 1.0]), np.array([0.1, 0.1]))


def test_the_answer_of_the_smallest_loss_counts_from_when_it_was_seen() -> None:
    # The loss of two independent renders may fall below 0: its size counts.
    errors, losses = np.array([0.5, 0.1, 0.3, 0.2]), np.array([9.0, -1.0, 4.0, 0.5])
    assert at_smallest(errors, losses).tolist() == [0.5, 0.1, 0.1, 0.2]


def test_compilation_is_taken_from_every_time_of_a_row_and_told() -> None:
    found = {"seconds": [3.0, 4.0, 5.0], "errors": [0.2, 0.01, 0.01], "losses": [1.0, 0.5, 2.0]}
    found |= {"start_error": 0.9, "compiling": 2.5}
    row = race_report.row(make("glass", 0), "Mitsuba 2x4", found, Path("curve.json"))
    assert row["reached"] == row["converged"] == 1.5
    assert row["compiling"] == 2.5
    # The loss of an iteration is that of the values before its step: 1.0 of the start.
    assert row["last_error_smallest_loss"] == 0.2
    assert row["converged_smallest_loss"] == ""
