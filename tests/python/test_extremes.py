# SPDX-License-Identifier: GPL-3.0-or-later
"""The rows of `./dev bench extremes` that take no time: light that paper knows at the ends of the
ranges, and derivatives there."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from selenite import parameters

BENCH = str(Path(__file__).resolve().parents[2] / "bench")
sys.path.insert(0, BENCH)
try:
    from extreme.ends import FOG, GLASS, PLASTIC, VELVET, ends
    from extreme.measure import Settings, mean_of, slope_of
    from extreme.rows import rows
    from extreme.scenes import Values, furnace, lit
finally:
    sys.path.remove(BENCH)

#: Walks in white media that are dense take seconds.
QUICK = [row for row in rows([]) if row.thrift == 1 and row.limit is not None]
SETTINGS = Settings(size=8, spp=256, seeds=4)


@pytest.mark.parametrize("row", QUICK, ids=lambda row: f"{row.group}: {row.name}")
def test_light_is_what_paper_says(row) -> None:
    # Fixed seeds; of new ones 1 in 16 000 would fail by chance, for each of the rows.
    assert mean_of(row.scene(row.values), SETTINGS).whole
    limit = row.limit(SETTINGS)
    assert limit.holds, f"{limit.measured} +- {limit.error}, on paper {limit.wanted}"
    if row.white is not None:
        white = mean_of(furnace({**row.values, **row.white}), SETTINGS)
        assert white.whole
        assert white.value - 4 * white.error <= 1 + row.gain
        if row.lossless:
            assert white.value == pytest.approx(1, abs=4 * white.error + 1e-3)


def test_every_parameter_of_a_material_is_tried_at_all_its_ends() -> None:
    tried = {(end.parameter, end.at) for end in ends([])}
    for parameter in parameters.of("material"):
        for at in (parameter.lower, parameter.upper, parameter.fit_lower, parameter.fit_upper):
            assert (parameter.name, at) in tried


SLOPES: list[tuple[str, float, float, Values]] = [
    ("base_color", 0, 0.16, PLASTIC),
    ("transmission", 1, -0.16, {"base_color": 1, "ior": 1.0, "roughness": 0}),
    ("metallic", 0, 0.16, PLASTIC | {"base_color": 0.8}),
    ("sheen_weight", 0, 0.16, VELVET),
    ("extinction", 0, 0.16, FOG),
    ("albedo", 1, -0.04, FOG),
    ("albedo", 0, 0.16, GLASS | {"extinction": 20, "roughness": 0}),
]


@pytest.mark.parametrize(("name", "at", "step", "values"), SLOPES)
def test_derivative_at_an_end_is_the_one_sided_one(
    name: str, at: float, step: float, values: Values
) -> None:
    slope = slope_of(lit(values), name, at, step, SETTINGS)
    assert slope.whole
    assert slope.verdict == "agrees", slope
