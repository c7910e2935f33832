# SPDX-License-Identifier: GPL-3.0-or-later
"""What result.json, terminal, log and panel say about how sure a value is."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "addon"))

from selenite.fit_run import trust  # noqa: E402
from selenite.fit_run.unknowns import Unknown  # noqa: E402


def unknown(name: str, width: int = 1, low: float = 0.02, high: float = 0.999) -> Unknown:
    """Of the material Body; only the name counts here."""
    parameter: Any = SimpleNamespace(name=name, width=width, unit="1")
    return Unknown("Body", parameter, (0.5,) * width, low, high, 0.03)


ROUGHNESS, COLOUR, IOR = unknown("roughness"), unknown("base_color", 3), unknown("ior")


def result(**changes: Any) -> dict[str, Any]:
    """Roughness is known, green is not, the IOR is at its upper bound."""
    parameters = {
        "Body:roughness": {
            "standard_error": [0.01],
            "interval_90": [[0.28, 0.32]],
            "determined": [True],
            "at_bound": [None],
            "correlated_with": [None],
        },
        "Body:base_color": {
            "standard_error": [0.01, float("inf"), 0.02],
            "interval_90": [[0.1, 0.2], [0.0, 1.0], [0.3, 0.4]],
            "determined": [True, False, True],
            "at_bound": [None, None, None],
            "correlated_with": [None, "Body:ior", None],
        },
        "Body:ior": {
            "standard_error": [0.05],
            "interval_90": [[0.9, 0.999]],
            "determined": [True],
            "at_bound": ["maximum"],
            "correlated_with": ["Body:base_color[1]"],
        },
    }
    misfit = {"value": 0.0001, "standard_error": 0.0001, "explained": True}
    search = {"points": 65, "moved": True, "start_loss": 1.0, "loss": 0.1, "standard_error": 0.01}
    report = {"parameters": parameters, "passes": 1, "misfit": misfit | changes}
    return {"report": report, "search": search}


def said(found: dict[str, Any], fields: tuple[str, ...] = ()) -> str:
    plan: Any = SimpleNamespace(unknowns=[ROUGHNESS, COLOUR, IOR], fields=fields)
    return "\n".join(trust.sentences(plan, found))


def test_a_fit_is_sure_when_all_values_are_determined() -> None:
    seen = result()
    assert not trust.sure(seen)
    seen["report"]["parameters"]["Body:base_color"]["determined"] = [True] * 3
    assert trust.sure(seen)
    assert not trust.sure({}), "nothing was verified"


def test_a_value_that_is_known_has_error_and_interval() -> None:
    assert trust.entries(ROUGHNESS, result()) == {
        "standard_error": 0.01,
        "interval_90": [0.28, 0.32],
        "determined": True,
        "at_bound": None,
        "correlated_with": None,
    }
    assert trust.words(ROUGHNESS, result()) == ["90 %: 0.280 to 0.320"]


def test_intervals_promise_nothing_beside_a_misfit() -> None:
    words = trust.words(ROUGHNESS, result(explained=False))
    assert words == ["noise alone would allow: 0.280 to 0.320"]


def test_intervals_beside_voxels_hold_if_what_is_left_is_theirs() -> None:
    voxels = {"fields_best": {"Body:albedo_grid": [0.5]}}
    assert trust.words(ROUGHNESS, result() | voxels) == ["90 %: 0.280 to 0.320"]
    left = result(value=0.0025, explained=False) | voxels
    of_grid = "90 %, if what is left is the grid's: 0.280 to 0.320"
    assert trust.words(ROUGHNESS, left) == [of_grid]
    assert "5.0 % of the photos' brightness is left by the grid or image" in said(left)
    assert "check lights" not in said(left)
    assert "is not known" not in said(left, fields=("Body:albedo_grid",))


def test_no_interval_is_shown_for_what_the_photos_do_not_determine() -> None:
    entry = trust.entries(COLOUR, result())
    assert entry["determined"] is False
    assert entry["interval_90"] == [[0.1, 0.2], None, [0.3, 0.4]]
    assert entry["standard_error"] == [0.01, None, 0.02]
    json.dumps(entry, allow_nan=False)


def test_what_can_make_up_for_it_is_named() -> None:
    text = said(result())
    assert "Body:base_color: not determined by these photos in G" in text
    assert "Body:ior can make up for it" in text


def test_what_is_not_determined_is_told_with_where_to_find_the_next_photo() -> None:
    assert "selenite next-camera RESULT_FOLDER" in said(result())
    assert "Suggest Next Camera" in said(result())
    all_known = result()
    all_known["report"]["parameters"]["Body:base_color"]["determined"] = [True] * 3
    assert "next-camera" not in said(all_known)


def test_rivals_are_told_whole_and_with_each_value_that_they_contest() -> None:
    found = result()
    rival = {"Body:roughness": [0.132], "Body:base_color": [0.5, 0.6, 0.7], "Body:ior": [1.45]}
    found["report"] |= {"rivals": [rival], "contested": ["Body:roughness"]}
    found["report"]["parameters"]["Body:roughness"]["determined"] = [False]
    assert trust.words(ROUGHNESS, found) == [
        "not determined by these photos: with other values of the rest 0.132 explains them as well"
    ]
    assert "Body:ior can make up for it" in "".join(trust.words(COLOUR, found))
    whole = "Body:roughness 0.132; Body:base_color 0.5, 0.6, 0.7; Body:ior 1.45"
    assert f"Other values explain the photos as well: {whole}." in said(found)
    assert trust.rivals(found) == [rival]
    assert trust.rivals(result()) == []
    assert "Other values" not in said(result())


def test_a_bound_is_named_with_its_cure() -> None:
    assert "Body:ior: at its maximum 0.999: widen the bound" in said(result())
    assert trust.entries(IOR, result())["at_bound"] == "maximum"


@pytest.mark.parametrize(
    ("explained", "words"),
    [(True, "explained within noise"), (False, "5.0 % of the photos' brightness")],
)
def test_a_misfit_is_told_as_a_share_of_brightness(explained: bool, words: str) -> None:
    assert words in said(result(value=0.0025, explained=explained))


def test_the_search_says_whether_it_left_the_start() -> None:
    assert "looked at 65 starts and went on from another start" in said(result())
    found = result()
    found["search"]["moved"] = False
    assert "kept the start" in said(found)


def test_nothing_is_said_where_nothing_was_verified() -> None:
    empty: dict[str, Any] = {
        "report": {"parameters": {}, "passes": 0, "misfit": {}},
        "search": {"points": 0},
    }
    assert trust.entries(ROUGHNESS, empty) == trust.UNKNOWN
    assert trust.misfit(empty) is None
    assert said(empty) == ""


def test_beside_a_grid_it_says_that_nothing_is_known_of_the_errors() -> None:
    assert "How sure these values are is not known" not in said(result())
    told = said({"report": None}, fields=("Body:albedo_grid",))
    assert "How sure these values are is not known" in told
    assert "90 %" not in told


@pytest.mark.parametrize(
    ("field", "value", "told"),
    [
        ("Body:base_color_texture", 0.3, True),
        ("Body:base_color_texture", 0.02, False),
        ("Body:base_color_texture", 0.999, False),
        ("Ground:base_color_texture", 0.3, False),
        ("Body:albedo_grid", 0.3, False),
    ],
)
def test_a_transmission_that_an_image_can_make_up_for_is_told(
    field: str, value: float, told: bool
) -> None:
    found = {"fields_best": {field: [0.5]}, "values_best": {"Body:transmission": [value]}}
    words = trust.words(unknown("transmission"), found)
    assert bool(words) is told and all("If yours is opaque" in line for line in words)
    assert trust.words(ROUGHNESS, found) == []
