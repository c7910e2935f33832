# SPDX-License-Identifier: GPL-3.0-or-later
"""What is expected of a preset, from known errors, and what a fit with grids costs."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "addon"))

from selenite.fit_run import cost  # noqa: E402
from selenite.fit_run.field_kinds import KINDS  # noqa: E402
from selenite.fit_run.settings import FitSettings  # noqa: E402
from selenite.fit_run.unknowns import Unknown  # noqa: E402
from selenite.parameters import table  # noqa: E402
from selenite.trade.expected import Expected  # noqa: E402


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


def plan_with(*grids: np.ndarray, size: int = 64) -> Any:
    """Extinction and roughness of a medium, the first grid one of albedos, the others densities."""
    photo = SimpleNamespace(photo_size=(size, size))
    kinds = (KINDS["albedo_grid"], *[KINDS["density_grid"]] * len(grids))
    fields = [
        SimpleNamespace(kind=kind, values=grid) for kind, grid in zip(kinds, grids, strict=False)
    ]
    scalars = [unknown("extinction"), unknown("roughness")]
    return SimpleNamespace(unknowns=scalars, fields=fields, captures=[photo])


def test_a_fit_of_grids_searches_where_nothing_is_known_of_the_voxels() -> None:
    even, uneven = np.full((4, 4, 4, 3), 0.5), np.linspace(0, 1, 192).reshape(4, 4, 4, 3)
    settings = FitSettings(height=64, iterations=40, spp=4)

    def paths(*grids: np.ndarray, search: str = "auto") -> float:
        return cost.paths(replace(settings, search=search), plan_with(*grids))

    search = paths(even) - paths(even, search="off")
    assert search > 0.1 * paths(even)
    assert paths(uneven) == paths(uneven, search="off")
    assert paths(even, even) > paths(even, even, search="off")
    assert paths(even, uneven) == paths(even, uneven, search="off")

    # Its pictures stay small: what it adds is the same at all heights, but for other turns and the
    # steps from a low roughness.
    def added(height: int) -> float:
        tall, plan = replace(settings, height=height), plan_with(even, size=height)
        return cost.paths(tall, plan) - cost.paths(replace(tall, search="off"), plan)

    turns = (added(256) - added(128)) / (256**2 - 128**2)
    assert added(64) - turns * 64**2 == pytest.approx(added(128) - turns * 128**2)
    assert added(64) - turns * 64**2 > 0


def test_few_coloured_voxels_are_stepped_with_the_scalars_and_refined() -> None:
    def paths(side: int, channels: int = 3, iterations: int = 40) -> float:
        even = np.full((side, side, side, channels), 0.5)
        return cost.paths(FitSettings(height=64, iterations=iterations, spp=4), plan_with(even))

    assert paths(12) == paths(2), "the price of a path is the same"
    assert paths(13) == paths(4, channels=1), "these are left to Adam"
    assert paths(12) != paths(13)
    # Steps, validations and samples of the looks grow with the iterations; the search does not.
    first = paths(12, iterations=160) - paths(12, iterations=80)
    second = paths(12, iterations=320) - paths(12, iterations=160)
    assert second == pytest.approx(2 * first, rel=0.05)
