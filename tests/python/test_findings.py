# SPDX-License-Identifier: GPL-3.0-or-later
"""A result in short: how sure each value is, and the sentence for the whole."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from selenite.fit_run.answer import findings as module
from selenite.fit_run.answer.findings import OPEN, SURE, UNKNOWN, WEAK, findings
from selenite.parameters import table

EXPLAINED = {"value": 0.0001, "standard_error": 0.0001, "explained": True}


def plan_of(*names: str) -> Any:
    """Of parameters of the material Jade, between 0 and 1."""
    unknowns = [
        SimpleNamespace(
            owner="Jade", parameter=table()["material", name], name=f"Jade:{name}",
            start=(0.5,) * table()["material", name].width, minimum=0.0, maximum=1.0,
            by_ratio=False,
        )
        for name in names
    ]  # fmt: skip
    photo = SimpleNamespace(id="Front", isolated=0.0)
    return SimpleNamespace(unknowns=unknowns, fields=[], captures=[photo])


def result_of(
    misfit: dict[str, Any] | None = None, **entries: tuple[float, float, float] | None
) -> dict[str, Any]:
    """name -> (low, value, high), or None for a value that is not determined."""
    report = {}
    values = {}
    for name, numbers in entries.items():
        low, value, high = numbers or (0.0, 0.5, 1.0)
        values[f"Jade:{name}"] = [value]
        report[f"Jade:{name}"] = {
            "standard_error": [0.01], "interval_90": [[low, high]],
            "determined": [numbers is not None], "at_bound": [None], "correlated_with": [None],
        }  # fmt: skip
    return {
        "values_best": values,
        "report": {
            "parameters": report, "passes": 3, "alternative_minima": [], "ambiguous": [],
            "misfit": misfit or EXPLAINED,
        },
    }  # fmt: skip


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


def test_photos_that_are_not_explained_make_every_value_weak() -> None:
    plan = plan_of("roughness")
    misfit = {"value": 0.01, "standard_error": 0.0001, "explained": False}
    result = result_of(misfit, roughness=(0.28, 0.3, 0.32))
    assert findings(plan, result)[0].sureness == WEAK
    icon, text = verdict(plan, result)
    assert icon == WEAK and text.startswith("10.0 % of the photos' brightness is not explained")


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
        "The photos are explained within noise: apply the values.",
    )


def test_without_a_report_nothing_is_said_to_be_sure() -> None:
    plan = plan_of("roughness")
    result = {"values_best": {"Jade:roughness": [0.3]}}
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
    assert "check lights" in verdict(plan, result | {"stopped_because": "converged"})[1]
    icon, text = verdict(plan, result | {"stopped_because": "all iterations done"})
    assert icon == WEAK and "fit again with more iterations" in text
