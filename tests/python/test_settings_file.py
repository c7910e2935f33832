# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings as a run file holds them: back to the same values, and every fault named at once."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from typing import Any

import pytest

from selenite.fit.settings import FitSettings, with_overrides
from selenite.problems import BadInput

#: No default, no two numbers equal.
OTHER = FitSettings(
    loss="mae",
    optimiser="adam",
    iterations=7,
    until_converged=False,
    spp=6,
    learning_rate=0.07,
    tolerance=0.25,
    height=18,
    seed=11,
    depth=5,
    threads=2,
    accumulate=False,
    picture_spp=3,
    physical_refraction=True,
    search="on",
    precision="draft",
    prior="misfit",
)
#: What files left out before it existed.
OLD = {"until_converged": False, "precision": "exact"}


def refused(data: dict[str, Any]) -> list[str]:
    with pytest.raises(BadInput) as error:
        FitSettings.from_json(data)
    return [item.line() for item in error.value.problems]


def test_settings_come_back_as_they_were() -> None:
    plain = FitSettings()
    for field in fields(FitSettings):
        assert getattr(OTHER, field.name) != getattr(plain, field.name), field.name
    stored = json.loads(json.dumps(OTHER.as_json()))
    assert FitSettings.from_json(stored) == OTHER


@pytest.mark.parametrize("name", [field.name for field in fields(FitSettings)])
def test_what_is_left_out_takes_its_default(name: str) -> None:
    stored = OTHER.as_json()
    del stored[name]
    default = OLD.get(name, getattr(FitSettings(), name))
    assert FitSettings.from_json(stored) == replace(OTHER, **{name: default})


def test_a_number_of_iterations_is_the_most_there_are() -> None:
    assert FitSettings().native()["most_iterations"] == 120
    given = with_overrides(FitSettings(), {"iterations": 30})
    assert given.native()["most_iterations"] == 0
    both = with_overrides(FitSettings(), {"iterations": 30, "until_converged": True})
    assert both.native()["most_iterations"] == 90


def test_a_whole_number_is_a_number() -> None:
    found = FitSettings.from_json({"tolerance": 1, "learning_rate": 1})
    assert (found.tolerance, found.learning_rate) == (1.0, 1.0)
    assert isinstance(found.tolerance, float)


def test_faults_are_named_together() -> None:
    lines = refused({"spp": 4.5, "accumulate": 1, "depht": 3, "height": 0, "loss": "l2"})
    assert len(lines) == 5
    for words in (
        ("'spp'", "4.5", "int"),
        ("'accumulate'", "1", "bool"),
        ("'depht'", "does not exist", "depth"),
        ("'height'", "0 lies outside [1, 65536]"),
        ("'loss'", "'l2'", "dual-buffer"),
    ):
        assert any(all(word in line for word in words) for line in lines), (words, lines)


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("iterations", 1, 1_000_000),
        ("spp", 2, 65536),
        ("height", 1, 65536),
        ("seed", 0, 2**31 - 1),
        ("depth", 0, 1_000_000),
        ("threads", 0, 1024),
        ("picture_spp", 1, 1_048_576),
        ("tolerance", 0.0, 1e9),
        ("learning_rate", 1e-6, 1.0),
    ],
)
def test_ranges_are_closed(name: str, low: float, high: float) -> None:
    for value in (low, high):
        assert getattr(FitSettings.from_json({name: value}), name) == value
    step = 1 if isinstance(low, int) else 1e-7
    for value in (low - step, high + (1 if isinstance(low, int) else high)):
        (line,) = refused({name: value})
        assert f"'{name}'" in line


def test_numbers_that_are_none_are_refused() -> None:
    for value in (float("nan"), float("inf")):
        (line,) = refused({"tolerance": value})
        assert "'tolerance'" in line
