# SPDX-License-Identifier: GPL-3.0-or-later
"""A result in short: how sure each value is, and the sentence for the whole."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from made_results import plan_of, result_of  # noqa: E402

from selenite import native  # noqa: E402
from selenite.report import findings as module  # noqa: E402
from selenite.report.findings import OPEN, SURE, UNKNOWN, WEAK, findings  # noqa: E402


def verdict(plan: Any, result: dict[str, Any]) -> tuple[str, str]:
    return module._verdict(plan, findings(plan, result), result)


def test_a_short_interval_is_sure_and_a_long_one_weak() -> None:
    plan = plan_of("roughness", "metallic")
    result = result_of(roughness=(0.28, 0.3, 0.32), metallic=(0.1, 0.4, 0.7))
    sure, weak = findings(plan, result)
    assert (sure.sureness, weak.sureness) == (SURE, WEAK)
    assert sure.low == (0.28,) and sure.high == (0.32,)
    assert sure.bar == pytest.approx((0.28, 0.32)) and sure.place == pytest.approx(0.3)
    assert verdict(plan, result)[0] == WEAK


def test_what_photos_do_not_determine_is_open_and_has_no_interval() -> None:
    plan = plan_of("roughness", "metallic")
    result = result_of(roughness=(0.28, 0.3, 0.32), metallic=None)
    found = findings(plan, result)[1]
    assert found.sureness == OPEN and found.low == () and found.bar == (0.0, 1.0)
    icon, text = verdict(plan, result)
    assert icon == OPEN and "1 of 2 values are not determined" in text
    assert "Suggest Next Camera" in text


def test_photos_that_have_not_converged_make_every_value_weak() -> None:
    plan = plan_of("roughness")
    result = result_of(roughness=(0.28, 0.3, 0.32))
    assert findings(plan, result)[0].sureness == SURE and verdict(plan, result)[0] == SURE
    plan.captures[0].isolated = 0.07
    assert findings(plan, result)[0].sureness == WEAK
    icon, text = verdict(plan, result)
    assert icon == WEAK and "Isolated bright pixels" in text and "more samples" in text


@pytest.mark.parametrize(
    ("percent", "icon", "words", "sureness"),
    [
        (0.3, SURE, "Good match: 0.3 % of the photos' brightness is not explained", SURE),
        (0.99, SURE, "Good match: 1.0 %", SURE),
        (2.8, WEAK, "Close: 2.8 % of the photos' brightness is not explained", SURE),
        (4.9, WEAK, "Close: 4.9 %", SURE),
        (5.1, OPEN, "Wrong camera or light? 5 % of the photos' brightness", WEAK),
        (40.0, OPEN, "Wrong camera or light? 40 % of the photos' brightness", WEAK),
    ],
)
def test_the_verdict_is_by_the_size_of_the_misfit(
    percent: float, icon: str, words: str, sureness: str
) -> None:
    plan = plan_of("roughness")
    value = (percent / 100) ** 2
    misfit = {"value": value, "standard_error": value / 100, "explained": False}
    result = result_of(misfit, roughness=(0.28, 0.3, 0.32))
    assert findings(plan, result)[0].sureness == sureness
    found, text = verdict(plan, result)
    assert found == icon and text.startswith(words)
    assert ("light" in text) == (percent > 5)
    assert module.in_short(plan, result).is_wrong == (percent > 5)
    assert ("compare the pictures before" in text) == (percent > 5)


def test_a_start_that_was_right_is_a_good_result() -> None:
    plan = plan_of("roughness")
    kept = result_of(roughness=(0.28, 0.3, 0.32)) | {"kept_start": True}
    assert verdict(plan, kept)[0] == SURE
    unexplained = {"value": 0.01, "standard_error": 0.0001, "explained": False}
    kept = result_of(unexplained, roughness=(0.28, 0.3, 0.32)) | {"kept_start": True}
    assert verdict(plan, kept)[1].startswith("Nothing better than the start was found")


def test_a_good_result_says_what_to_do() -> None:
    plan = plan_of("roughness")
    result = result_of(roughness=(0.28, 0.3, 0.32))
    assert verdict(plan, result) == (
        SURE,
        "Good match: the photos are explained within noise. Apply the values.",
    )


def test_without_a_report_nothing_is_said_to_be_sure() -> None:
    plan = plan_of("roughness")
    ended = native.core().StopReason.CONVERGED
    result = {"values_best": {"Jade:roughness": [0.3]}, "stopped": ended}
    found = findings(plan, result)[0]
    assert found.sureness == UNKNOWN and found.low == ()
    assert verdict(plan, result)[0] == UNKNOWN


def test_a_fit_that_had_not_converged_says_what_to_do_before_it_blames_the_scene() -> None:
    plan = plan_of("roughness")
    misfit = {"value": 0.01, "standard_error": 0.0001, "explained": False}
    history = {
        "iteration": [0, 5, 10, 20], "validation": [0.1, 0.05, 0.03, 0.01],
        "validation_standard_error": [1e-5] * 4,
    }  # fmt: skip
    result = result_of(misfit, roughness=(0.28, 0.3, 0.32)) | {"history": history}
    assert "Wrong camera" in verdict(plan, result)[1]
    ended = {"stopped": native.core().StopReason.ITERATIONS}
    icon, text = verdict(plan, result | ended)
    assert icon == WEAK and "fit again with more iterations" in text
