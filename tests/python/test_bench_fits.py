# SPDX-License-Identifier: GPL-3.0-or-later
"""Cases of `./dev bench fit` and the table that its rows go to."""

from __future__ import annotations

import csv
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench"), str(Path(__file__).parent)]

from made_results import made_fit  # noqa: E402
from synthetic import cases, fits, report, scenes, stage, table  # noqa: E402

from selenite import native  # noqa: E402


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


def test_an_image_is_unknown_in_place_of_the_colour() -> None:
    case = cases.make("thesis-texture", 0)
    image = case.image
    assert image is not None
    assert (image.shape, image.dtype) == ((64, 64, 3), np.float32)
    assert 0.1 <= image.min() < image.max() <= 0.98
    assert np.abs(255 * image - np.rint(255 * image)).max() < 1e-4, "no byte holds it"
    assert list(case.target) == ["roughness", "transmission", "ior"]
    assert (case.mesh, case.lighting, case.cameras) == ("armadillo_29170", "lamp", 4)
    camera = cases.make("thesis-camera", 0)
    for own, other in ((case.target, camera.target), (case.start, camera.start)):
        assert own == {name: other[name] for name in own}


def test_seeds_of_the_textured_thesis_case_share_their_photos() -> None:
    one, other = (cases.make("thesis-texture", seed) for seed in (0, 1))
    assert one.photos == other.photos
    assert one.photos != cases.make("thesis-camera", 0).photos
    assert one.name != other.name
    assert np.array_equal(one.image, other.image)


def pictures(scene) -> np.ndarray:
    """(cameras, h, w, 3), few samples of equal seeds."""
    return np.stack([native.core().render(scene, c, 16, 16, 4).image for c in scene.cameras])


def test_start_and_truth_differ_in_the_image_where_the_values_are_the_same() -> None:
    made = replace(cases.make("thesis-texture", 0), mesh="dents")
    case = replace(made, start=made.target)
    start = fits.scene_of(case)
    true = fits.at_target(case, start)
    values = {name: value[0] for name, value in case.target.items()}
    direct = scenes.make("dents", "lamp", values, 4, image=case.image)
    assert np.array_equal(pictures(true), pictures(direct))
    even = true.with_image(scenes.OWNER, np.full_like(case.image, cases.IMAGE_START))
    assert np.array_equal(pictures(even), pictures(start))
    assert np.abs(pictures(true) - pictures(start)).max() > 0.01


def test_the_image_goes_around_the_body_once_and_its_seam_is_closed() -> None:
    body = stage.make("dents", "lamp", 1).body
    u, v = stage.uvs(body).reshape(-1, 3, 2).transpose(2, 0, 1)
    assert u.min() == pytest.approx(0, abs=0.02)
    assert u.max() > 1, "no triangle lies over the seam"
    assert (v.min(), v.max()) == (0, 1)
    points = body.positions[body.triangles]
    angle = 2 * np.pi * (u - 0.5)
    middle = (body.positions.min(axis=0) + body.positions.max(axis=0)) / 2
    radius = np.hypot(*(points - middle)[..., :2].transpose(2, 0, 1))
    wide = np.ptp(u, axis=1) > 0.2
    assert radius[wide].max() < 0.15, "only around the axis is a triangle wide"
    assert (points - middle)[..., 0] == pytest.approx(radius * np.cos(angle))
    assert (points - middle)[..., 1] == pytest.approx(radius * np.sin(angle))


def test_the_error_of_an_image_is_that_of_the_texels_that_the_photos_show() -> None:
    case = cases.make("thesis-texture", 0)
    texels = case.image.copy()
    texels[:32] += np.float32(0.1)
    texels[32:] += np.float32(0.7)
    found = made_fit({
        "values_best": {f"Body:{name}": list(value) for name, value in case.target.items()},
        "fields_best": {"Body:base_color_texture": texels},
    })  # fmt: skip
    weights = np.zeros(texels.shape)
    weights[:32] = 2
    row = report.row("label", case, found, 1.0, weights)
    assert row["image_error"] == pytest.approx(0.1, abs=1e-6)
    assert row["grid_error"] == ""
    assert report.line(row).endswith("texels off by 0.100")


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


def test_a_wrong_fit_counts_as_warned_of_where_its_report_warns() -> None:
    row = {"explained": "1", "undetermined": "", "alternative_minima": "0"}
    assert not report.is_warned_of(row)
    for doubt in ({"explained": "0"}, {"alternative_minima": "1"}):
        assert report.is_doubted(row | doubt)
        assert report.is_warned_of(row | doubt)
    assert report.is_warned_of(row | {"undetermined": "ior"})
    assert not report.is_doubted(row | {"undetermined": "ior"}), "it claims nothing of the value"


def test_values_that_are_not_determined_do_not_count_as_errors() -> None:
    row = {"albedo[0]": "0.01", "albedo[1]": "0.03", "extinction": "0.5", "ior": "0.4"}
    for undetermined, error in (("extinction[2] ior", 0.02), ("albedo[1] extinction[0] ior", 0.01)):
        found = report.determined_error(row | {"undetermined": undetermined})
        assert found == pytest.approx(error)
    assert report.determined_error({"ior": "0.4", "undetermined": "ior"}) is None
