# SPDX-License-Identifier: GPL-3.0-or-later
"""What is told of a preset, from known errors."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "addon"))

from selenite.fit_run.unknowns import Unknown  # noqa: E402
from selenite.parameters import table  # noqa: E402
from selenite.trade.expected import Expected  # noqa: E402


def unknown(name: str, owner: str = "Jade") -> Unknown:
    row = table()["material", name]
    return Unknown(owner, row, (0.5,) * row.width, row.fit_lower, row.fit_upper, 0.03)


def test_it_is_said_how_long_how_far_off_and_what_worst() -> None:
    names = ("base_color", "roughness", "ior", "transmission")
    told = Expected(95.2, [unknown(name) for name in names], [0.03, 0.02, 0.06, None])
    assert told.error == pytest.approx((0.0049 / 3) ** 0.5)
    assert told.text() == "about 95 s, error 0.04 (worst: IOR 0.06; not determined: Transmission)"
    assert told.as_json() == {
        "expected_seconds": 95.2,
        "expected_error": told.error,
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
    told = Expected(9.0, [unknown("ior"), unknown("ior", "Glass")], [0.01, 0.02])
    assert "worst: IOR of Glass 0.02" in told.text()
