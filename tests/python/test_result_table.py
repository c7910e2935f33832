# SPDX-License-Identifier: GPL-3.0-or-later
"""A result as a table, and the three sentences below it."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from made_results import made_fit, plan_of, result_of  # noqa: E402

from selenite.parameters import table  # noqa: E402
from selenite.report.finished_fit import FinishedFit  # noqa: E402
from selenite.report.table import Line, interval, lines, number, sentences, with_half  # noqa: E402


def test_a_number_has_the_digits_that_are_known() -> None:
    assert number(0.30312, 0.0041) == "0.3031" and interval(0.2989, 0.3071) == "0.2989 to 0.3071"
    assert number(1.44, 0.21) == "1.44" and interval(1.2, 1.62) == "1.20 to 1.62"
    assert number(1234.5, 100.0) == "1234" and number(0.5) == "0.5"
    assert number(0.1 + 0.2) == "0.3"


@pytest.mark.parametrize(
    ("half", "text"),
    [
        (0.0041, "0.303 \u00b1 0.004"), (0.0123, "0.30 \u00b1 0.01"), (0.36, "0.3 \u00b1 0.4"),
        (3.2, "0 \u00b1 3"), (0.01, "0.30 \u00b1 0.01"),
    ],
)  # fmt: skip
def test_half_of_an_interval_has_one_digit(half: float, text: str) -> None:
    assert with_half([0.303], half) == text
    assert with_half([0.303, 0.303], half).split(" \u00b1")[0].split(" ") == [text.split()[0]] * 2


def test_each_parameter_is_a_line() -> None:
    plan = plan_of("roughness", "metallic")
    result = result_of(roughness=(0.29, 0.3, 0.31), metallic=None)
    assert lines(plan, FinishedFit(result)) == [
        Line("Jade:roughness", "0.5", "0.300", "0.290 to 0.310", "determined"),
        Line("Jade:metallic", "0.5", "0.5", "", "not determined"),
    ]


def test_a_colour_has_a_line_for_each_channel_and_one_verdict() -> None:
    plan = plan_of("base_color")
    result = result_of(base_color=(0.1, 0.2, 0.3))
    result.values_best["Jade:base_color"] = [0.2, 0.4, 0.6]
    result.report.parameters["Jade:base_color"] = SimpleNamespace(
        standard_error=[0.01] * 3, determined=[True] * 3, at_bound=[None] * 3,
        interval_90=[(0.19, 0.21), (0.39, 0.41), (0.59, 0.61)], correlated_with=[None] * 3,
        samples_factor=[0.0] * 3,
    )  # fmt: skip
    found = lines(plan, FinishedFit(result))
    names = ["Jade:base_color red", "Jade:base_color green", "Jade:base_color blue"]
    assert [line.name for line in found] == names
    assert [line.fitted for line in found] == ["0.200", "0.400", "0.600"]
    assert [line.verdict for line in found] == ["determined", "", ""]


def test_a_gain_and_a_shift_are_lines_of_their_photo() -> None:
    plan = plan_of("roughness")
    plan.captures = [
        SimpleNamespace(
            id="Front", isolated=0.0, free_gain="scalar", gain=(1.0, 1.0, 1.0), align=True,
            mask_share=1.0, photo_size=(200, 100),
            reference=SimpleNamespace(shape=(50, 100, 3)),
        )
    ]  # fmt: skip
    result = result_of(roughness=(0.29, 0.3, 0.31))
    found = {
        "gain": (1.21,) * 3, "gain_interval_90": [(1.18, 1.24)] * 3, "shift": (0.5, -1.0, 0.0),
    }  # fmt: skip
    result.captures = made_fit({"captures": {"Front": found}}).captures
    assert [line.cells[:4] for line in lines(plan, FinishedFit(result))[1:]] == [
        ("Photo Front: gain", "1", "1.210", "1.180 to 1.240"),
        ("Photo Front: shift [pixels]", "0, 0", "1.00, -2.00", ""),
        ("Photo Front: shift, roll [degrees]", "0", "0.00", ""),
    ]


def test_three_sentences_at_most_say_what_why_and_what_to_do() -> None:
    names = [name for owner, name in table() if owner == "material"][:9]
    plan = plan_of(*[name for name in names if table()["material", name].width == 1])
    result: Any = result_of(**{item.parameter.name: None for item in plan.unknowns})
    found = sentences(plan, result)
    assert len(found) == 3 and all(text.endswith(".") for text in found)
    assert "not determined" in found[0] and "add a photo" in found[0]
    assert found[1].startswith(f"{plan.unknowns[0].name}: not determined by these photos")
    (alone,) = sentences(plan_of("roughness"), result_of(roughness=(0.29, 0.3, 0.31)))
    assert alone == "Good match: the photos are explained within noise. Apply the values."
    assert "light" not in alone
