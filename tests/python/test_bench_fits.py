# SPDX-License-Identifier: GPL-3.0-or-later
"""Cases of `./dev bench fit` and the table that its rows go to."""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench")]

from synthetic import cases, report, table  # noqa: E402


@pytest.mark.parametrize("kind", cases.ALL_KINDS)
def test_a_case_starts_away_from_a_target_of_the_same_parameters(kind: str) -> None:
    case = cases.make(kind, 0)
    assert list(case.start) == list(case.target)
    assert cases.mean_error(case, case.target) == 0
    assert cases.mean_error(case, case.start) > 0.1


def test_cases_of_a_seed_stay_what_they_are() -> None:
    """Rows of earlier runs compare: the drawing of a case depends on kind and seed alone."""
    case = cases.make("half", 1)
    assert case.name == "half/bunny_6598/sky/1/1"
    assert case.target["ior"][0] == pytest.approx(1.48801, abs=1e-5)
    assert case == cases.make("half", 1)


def test_an_alpha_is_the_square_of_what_blender_calls_roughness() -> None:
    plain, by_alpha = (cases.make(kind, 3) for kind in ("thesis-medium", "thesis-medium-alpha"))
    for own, other in ((by_alpha.target, plain.target), (by_alpha.start, plain.start)):
        assert own["roughness"][0] ** 2 == pytest.approx(other["roughness"][0])
        assert {**own, "roughness": 0} == {**other, "roughness": 0}
    assert by_alpha.photos != plain.photos


def test_a_grid_is_unknown_beside_its_scalars() -> None:
    case = cases.make("thesis-grid", 0)
    assert case.albedo_grid is not None
    assert case.albedo_grid.shape == (8, 8, 8, 3)
    assert len(np.unique(case.albedo_grid.reshape(-1, 3), axis=0)) == 2
    assert "albedo" not in case.target


def test_an_older_table_gets_the_columns_that_it_lacks(tmp_path: Path) -> None:
    path = tmp_path / "runs.csv"
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, ["label", "case"])
        writer.writeheader()
        writer.writerow({"label": "old", "case": "glass/dents/lamp/1/0"})
    table.append(path, {"label": "new", "ior": 0.01}, report.COLUMNS)
    rows = table.read(path)
    assert [row["label"] for row in rows] == ["old", "new"]
    assert set(rows[0]) == set(report.COLUMNS)
    assert rows[0]["ior"] == ""
    assert rows[1]["ior"] == "0.01"


def test_a_wrong_fit_counts_as_told_where_its_report_warns() -> None:
    row = {"explained": "1", "undetermined": "", "rivals": "0"}
    assert not report.is_told(row)
    for doubt in ({"explained": "0"}, {"rivals": "1"}):
        assert report.is_doubted(row | doubt)
        assert report.is_told(row | doubt)
    assert report.is_told(row | {"undetermined": "ior"})
    assert not report.is_doubted(row | {"undetermined": "ior"}), "it claims nothing of the value"
