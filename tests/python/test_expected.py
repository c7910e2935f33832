# SPDX-License-Identifier: GPL-3.0-or-later
"""What is expected of a preset, from known errors, and what a fit with grids costs."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "addon"))

from selenite.advice.trade.expected import Expected  # noqa: E402
from selenite.fit import cost  # noqa: E402
from selenite.fit.settings import FitSettings  # noqa: E402
from selenite.fit.unknowns import Unknown  # noqa: E402
from selenite.parameters import table  # noqa: E402
from selenite.problems import BadInput  # noqa: E402


@dataclass(frozen=True)
class Plan:
    """What the cost of a fit is computed from."""

    scene: str = "scene"
    unknowns: list[Any] = field(default_factory=list)
    fields: list[Any] = field(default_factory=list)
    captures: list[Any] = field(default_factory=list)
    stages: tuple[Any, ...] = ()


def unknown(name: str, owner: str = "Jade") -> Unknown:
    row = table()["material", name]
    return Unknown(owner, row, (0.5,) * row.width, row.fit_lower, row.fit_upper, 0.03)


def test_it_is_said_how_long_how_far_off_and_what_worst() -> None:
    names = ("base_color", "roughness", "ior", "transmission")
    expected = Expected(95.2, [unknown(name) for name in names], [0.03, 0.02, 0.06, None])
    assert expected.error == pytest.approx((0.0049 / 3) ** 0.5)
    assert (
        expected.text() == "about 95 s, error 0.04 (worst: IOR 0.06; not determined: Transmission)"
    )
    assert expected.as_json() == {
        "expected_seconds": 95.2,
        "expected_error": expected.error,
        "expected_errors": {
            "Jade:base_color": 0.03,
            "Jade:roughness": 0.02,
            "Jade:ior": 0.06,
            "Jade:transmission": None,
        },
    }


def test_one_parameter_needs_no_worst_and_none_no_error() -> None:
    assert Expected(240.0, [unknown("ior")], [0.0123]).text() == "about 4 min, error 0.012"
    none = Expected(12.0, [unknown("ior")], [None])
    assert none.error is None and none.text() == "about 12 s (not determined: IOR)"
    assert Expected(12.0).text() == "about 12 s" and Expected(12.0).error is None


def test_equal_parameters_are_told_apart_by_their_owners() -> None:
    expected = Expected(9.0, [unknown("ior"), unknown("ior", "Glass")], [0.01, 0.02])
    assert "worst: IOR of Glass 0.02" in expected.text()


def test_a_fit_costs_its_planned_paths_each_by_what_it_carries(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[Any] = []

    def schedule(scene: str, photos: object, unknowns: object, settings: object) -> list[Any]:
        asked.extend((scene, photos, unknowns, settings))
        row = {"phase": "descent", "pixels": 1000.0, "spp": 4, "renders": 2.5}
        return [row | {"derivatives": name} for name in ("none", "scalars", "fields")]

    monkeypatch.setattr(cost.native, "core", lambda: SimpleNamespace(schedule=schedule))
    photos = [
        SimpleNamespace(id="left", camera="Front", photo_size=(600, 400)),
        SimpleNamespace(id="right", camera="Side", photo_size=(40, 50)),  # never larger than itself
    ]
    item = SimpleNamespace(native=lambda: "roughness")
    plan: Any = Plan(unknowns=[item], captures=photos)
    found = cost.paths(FitSettings(height=100, iterations=7), plan)
    assert found == pytest.approx(10_000 * (1 + 1.3 + 2.2))
    assert asked[:3] == [
        "scene",
        [("left", "Front", 150, 100), ("right", "Side", 40, 50)],
        ["roughness"],
    ]
    assert asked[3]["iterations"] == 7
    assert cost.pixels_at(plan.captures, 100) == 15_000 + 2_000


def test_settings_that_no_fit_has_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def schedule(*_arguments: object) -> list[Any]:
        raise ValueError("iterations = 0 must lie in [1, 1e+06]")

    monkeypatch.setattr(cost.native, "core", lambda: SimpleNamespace(schedule=schedule))
    plan: Any = Plan()
    with pytest.raises(BadInput, match="iterations = 0"):
        cost.paths(FitSettings(), plan)
