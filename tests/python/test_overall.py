# SPDX-License-Identifier: GPL-3.0-or-later
"""One share of a whole run, which never falls, and the time left in words."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from made_results import made_progress, with_changes  # noqa: E402

from selenite.fit import overall  # noqa: E402
from selenite.fit.overall import Overall, Shown, time_text  # noqa: E402

WEIGHTS = [{"multi-start": 1.0, "descent": 4.0, "refinement": 3.0, "comparison": 2.0}]
NEW = made_progress(phase="multi-start")


def run_of(
    monkeypatch: pytest.MonkeyPatch,
    weights: list[dict[str, float]],
    descents: list[tuple[int, bool]],
) -> Overall:
    """Of a plan with these weights of phases, and iterations that are expected."""
    monkeypatch.setattr(overall, "_weights", lambda _plan: weights)
    monkeypatch.setattr(overall, "_descents", lambda _plan, _weights: descents)
    return Overall(None)  # type: ignore[arg-type]


def test_share_grows_through_all_phases_and_never_falls(monkeypatch: pytest.MonkeyPatch) -> None:
    run = run_of(monkeypatch, WEIGHTS, [(15, False)])
    seen = []
    for fraction in (0.0, 0.5, 1.0):
        seen.append(run.update(with_changes(NEW, phase_fraction=fraction)).fraction)
    assert seen[-1] == pytest.approx(0.098)
    for iteration in range(0, 41):
        state = with_changes(NEW, phase="descent", iteration=iteration, own_iteration=iteration)
        seen.append(run.update(state).fraction)
    assert 0.45 < seen[-1] < 0.49  # the length is a guess: it waits below the end of the phase
    # A comparison may be followed by another refinement, whose share begins anew.
    for phase, fraction in (
        ("refinement", 0.0), ("refinement", 1.0), ("comparison", 0.5), ("refinement", 0.1),
        ("comparison", 0.2), ("comparison", 1.0),
    ):  # fmt: skip
        seen.append(run.update(with_changes(NEW, phase=phase, phase_fraction=fraction)).fraction)
    seen += [run.finishing(0.0).fraction, run.finishing(1.0).fraction]
    assert seen == sorted(seen) and seen[-1] == 1.0
    assert seen[-2] == pytest.approx(0.98)


def test_stages_follow_one_another(monkeypatch: pytest.MonkeyPatch) -> None:
    stage = {"multi-start": 0.0, "descent": 1.0, "refinement": 0.0, "comparison": 0.0}
    run = run_of(monkeypatch, [stage, stage], [(10, True), (10, True)])
    first = run.update(with_changes(NEW, phase="descent", iteration=5, own_iteration=5)).fraction
    second = run.update(
        with_changes(NEW, phase="descent", iteration=15, own_iteration=5, stage=1)
    ).fraction
    assert first == pytest.approx(0.98 / 4) and second == pytest.approx(0.98 * 3 / 4)


def test_time_left_is_that_of_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    run = run_of(monkeypatch, WEIGHTS, [(10, True)])
    shown = run.update(with_changes(NEW, seconds=1.0, phase_fraction=0.5))
    assert shown.left is None and "nan" not in shown.text
    for share in range(0, 101):  # a run of 1000 s in all: the refinement is from 490 s to 784 s
        state = with_changes(NEW, phase="refinement", phase_fraction=share / 100)
        shown = run.update(with_changes(state, seconds=490 + 2.94 * share))
    assert shown.left == pytest.approx(216, rel=0.05)
    assert shown.text == "78 %, refinement, 4 min left"


def test_a_refinement_after_steps_that_converged_is_said_to_be_good_enough(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    run = run_of(monkeypatch, WEIGHTS * 2, [(10, True)] * 2)
    refined = with_changes(NEW, phase="refinement", stage=1, iteration=12, iterations=40)
    assert "good enough, refining" in run.update(refined).text
    for other in ({"iteration": 40}, {"stage": 0}, {"phase": "descent"}):
        assert "good enough" not in run.update(with_changes(refined, **other)).text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (None, ""), (math.nan, ""), (12.0, "less than 1 min left"), (61.0, "2 min left"),
        (3590.0, "1 h 0 min left"), (29679.0, "8 h 15 min left"),
    ],
)  # fmt: skip
def test_time_in_hours_and_minutes(seconds: float | None, text: str) -> None:
    assert time_text(seconds) == text
    assert "nan" not in Shown(0.5, seconds, "descent").text
