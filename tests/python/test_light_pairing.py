# SPDX-License-Identifier: GPL-3.0-or-later
"""When other lights than its own explain a photo."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from made_results import made_fit  # noqa: E402

from selenite._core import StopReason  # noqa: E402
from selenite.report import light_pairing  # noqa: E402
from selenite.report.light_pairing import explains, mismatches  # noqa: E402


@pytest.mark.parametrize(
    ("other", "own", "expected"),
    [
        (0.1, 0.9, True),
        (0.4, 1.5, True),
        (0.5, 0.6, False),  # as wrong as its own
        (0.85, 1.53, False),  # neither is like the photo: the body is of another kind
    ],
)
def test_lights_that_explain_nothing_are_not_said_to_be_the_right_ones(other, own, expected):
    assert explains(other**2, own**2) is expected


def _plan(photos: int) -> SimpleNamespace:
    lights = [{"lamps": [f"Lamp {index}"], "world": True, "places": {}} for index in range(photos)]
    captures = [SimpleNamespace(id=str(index), lights=one) for index, one in enumerate(lights)]
    request = SimpleNamespace(settings=None)
    return SimpleNamespace(captures=captures, scene=None, request=request)


def test_after_a_fit_that_was_stopped_nothing_is_compared() -> None:
    assert mismatches(_plan(2), made_fit({"stopped": StopReason.CANCELLED})) == []  # type: ignore[arg-type]


def test_lamps_whose_places_were_measured_are_not_compared() -> None:
    plan = _plan(3)
    for capture in plan.captures:
        capture.lights["places"] = {"Lamp 0": (None, None)}
    assert mismatches(plan, made_fit({})) == []  # type: ignore[arg-type] - would need a scene


def test_a_comparison_that_takes_long_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    seconds = iter(range(0, 10000, 15))
    monkeypatch.setattr(light_pairing.time, "monotonic", lambda: next(seconds))
    monkeypatch.setattr(light_pairing, "scene_at", lambda _plan, _result: None)
    monkeypatch.setattr(light_pairing, "evaluator", lambda _scene, _settings: None)
    rendered = []

    class View:
        @staticmethod
        def of(_plan: object, _scenes: object, capture: object, _result: object) -> View:
            rendered.append(capture)
            return View()

        def error(self, *_more: object) -> SimpleNamespace:
            return SimpleNamespace(mean=1.0)

    monkeypatch.setattr(light_pairing, "_View", View)
    assert mismatches(_plan(9), made_fit({"stopped": StopReason.CONVERGED})) == []  # type: ignore[arg-type]
    assert len(rendered) == 2
