# SPDX-License-Identifier: GPL-3.0-or-later
"""What result.json, terminal, log and panel say about how sure a value is."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "addon"))
sys.path.insert(0, str(Path(__file__).parent))

from made_results import made_fit, with_changes  # noqa: E402

from selenite._core import StopReason  # noqa: E402
from selenite.fit import pattern, trust  # noqa: E402
from selenite.fit.unknowns import Unknown  # noqa: E402


def unknown(name: str, width: int = 1, low: float = 0.02, high: float = 0.999) -> Unknown:
    """Of the material Body; only the name counts here."""
    parameter: Any = SimpleNamespace(name=name, width=width, unit="1", lower=0.0, upper=10.0)
    return Unknown("Body", parameter, (0.5,) * width, low, high, 0.03)


ROUGHNESS, COLOUR, IOR = unknown("roughness"), unknown("base_color", 3), unknown("ior")


def result(**changes: Any) -> Any:
    """Roughness is known, green is not, the IOR is at its upper bound."""
    parameters = {
        "Body:roughness": {
            "standard_error": [0.01],
            "interval_90": [(0.28, 0.32)],
            "determined": [True],
            "at_bound": [None],
            "correlated_with": [None],
        },
        "Body:base_color": {
            "standard_error": [0.01, float("inf"), 0.02],
            "interval_90": [(0.1, 0.2), (0.0, 1.0), (0.3, 0.4)],
            "determined": [True, False, True],
            "at_bound": [None, None, None],
            "correlated_with": [None, "Body:ior", None],
        },
        "Body:ior": {
            "standard_error": [0.05],
            "interval_90": [(0.9, 0.999)],
            "determined": [True],
            "at_bound": ["maximum"],
            "correlated_with": ["Body:base_color[1]"],
        },
    }
    misfit = {"value": 0.0001, "standard_error": 0.0001, "explained": True}
    search = {"points": 65, "moved": True, "start_loss": 1.0, "loss": 0.1, "standard_error": 0.01}
    report = {"parameters": parameters, "passes": 1, "misfit": misfit | changes}
    return made_fit({"report": report, "search": search})


def said(found: Any, fields: tuple[str, ...] = (), isolated: float = 0.0) -> str:
    named = [SimpleNamespace(name=name) for name in fields]
    photos = [SimpleNamespace(id="Front", isolated=isolated)]
    plan: Any = SimpleNamespace(unknowns=[ROUGHNESS, COLOUR, IOR], fields=named, captures=photos)
    return "\n".join(trust.sentences(plan, found))


def test_a_fit_is_sure_when_all_values_are_determined() -> None:
    seen = result()
    assert not trust.sure(seen)
    seen.report.parameters["Body:base_color"].determined = [True] * 3
    assert trust.sure(seen)
    assert not trust.sure(made_fit()), "there was no refinement"


def test_a_gauge_is_among_the_sentences() -> None:
    seen = result()
    assert "compensate for each other" not in said(seen)
    seen.report.weak_directions = [
        SimpleNamespace(deviation=0.3, components=["Body:base_color[0]"], captures=["Front"])
    ]
    assert "Body:base_color and the gain of Front compensate for each other" in said(seen)


def test_photos_that_have_not_converged_are_named_beside_the_misfit() -> None:
    assert "isolated" not in said(result())
    text = said(result(), isolated=0.07)
    assert "Much light of 'Front' is in isolated bright pixels" in text


def test_a_value_that_is_known_has_error_and_interval() -> None:
    assert trust.certainty(ROUGHNESS, result()).as_json() == {
        "standard_error": 0.01,
        "interval_90": (0.28, 0.32),
        "determined": True,
        "at_bound": None,
        "correlated_with": None,
    }
    assert trust.words(ROUGHNESS, result()) == ["90 %: 0.280 to 0.320"]


@pytest.mark.parametrize(("factor", "words"), [(2.53, "2.5"), (12.3, "12")])
def test_a_value_less_sure_than_asked_has_the_samples_that_it_takes(
    factor: float, words: str
) -> None:
    found = result()
    found.report.parameters["Body:roughness"].samples_factor = [factor]
    (_, text) = trust.words(ROUGHNESS, found)
    assert text.startswith(f"less sure than asked: it would take about {words} times the samples")


def test_where_photos_differ_no_samples_are_asked_for() -> None:
    found = result()
    found.report.parameters["Body:roughness"].samples_factor = [np.inf]
    (_, text) = trust.words(ROUGHNESS, found)
    assert "more samples of them would not help" in text and "inf" not in text


def test_a_small_misfit_is_not_said_to_be_0_percent() -> None:
    (words,) = trust.words(ROUGHNESS, result(value=9e-6, explained=False))
    assert "with 0.3 % unexplained" in words


def test_what_is_very_wrong_in_places_is_said_in_full() -> None:
    """A pattern on the body that the model has not: the tails of the weights leave 3.2 % of it."""
    found = result(value=0.001, explained=False)
    shares = {"Front": {"unexplained": 0.1}, "Side": {"unexplained": 0.2}}
    found.captures = made_fit({"captures": shares}).captures
    (words,) = trust.words(ROUGHNESS, found)
    assert "with 16 % unexplained" in words
    found.report.misfit.value = 0.09
    (words,) = trust.words(ROUGHNESS, found)
    assert "with 30 % unexplained" in words


def test_a_fit_without_a_refinement_tells_what_it_does_not_explain() -> None:
    """As by Adam with the loss mae, which has no intervals either."""
    found = made_fit({"captures": {"Front": {"unexplained": 0.11}}})
    settings = SimpleNamespace(loss="mae")
    plan: Any = SimpleNamespace(
        unknowns=[ROUGHNESS], fields=[], captures=[], request=SimpleNamespace(settings=settings)
    )
    (line,) = trust.sentences(plan, found)
    assert line.startswith("Misfit: 11.0 % of the photos' brightness is not explained")
    assert not trust.sentences(plan, made_fit({"captures": {"Front": {"unexplained": 0.0}}}))
    settings.loss = "brightness-independent-mse"
    assert not trust.sentences(plan, found), "its photos may have any exposure"


def test_a_misfit_that_remains_stands_beside_each_interval() -> None:
    words = trust.words(ROUGHNESS, result(value=0.09, explained=False))
    assert words == [
        "90 % by how photos and their parts differ, with 30 % unexplained: 0.280 to 0.320"
    ]


@pytest.mark.parametrize("value", [-1.32, -0.5, 0.0])
def test_a_misfit_that_noise_hides_is_not_called_explained(value: float) -> None:
    """Glass with a medium under a point lamp: few paths find the lamp."""
    found = result(value=value, standard_error=0.49)
    assert "hides whether the photos are explained" in trust.words(ROUGHNESS, found)[0]
    assert "Misfit: not known" in said(found)
    assert "within noise" not in said(found)


def test_a_misfit_far_below_zero_is_not_called_explained() -> None:
    assert "Misfit: not known" in said(result(value=-0.004, standard_error=0.001))


def test_a_fit_that_found_nothing_better_than_its_start_says_so() -> None:
    assert "these are the start's" in said(with_changes(result(), kept_start=True))
    assert "these are the start's" not in said(result())


def test_a_kept_start_that_explains_the_photos_is_no_reason_to_check_lights() -> None:
    assert "Check lights" not in said(with_changes(result(), kept_start=True))
    unexplained = result(value=0.0004, explained=False)
    for wrong in (unexplained, result(standard_error=0.1), made_fit()):
        assert "Check lights" in said(with_changes(wrong, kept_start=True))


@pytest.mark.parametrize("share", [0.002, 0.0099])
def test_no_line_about_a_misfit_below_one_per_cent_asks_to_check_lights(share: float) -> None:
    found = result(value=share**2, standard_error=1e-7, explained=False)
    for kept in (False, True):
        text = said(with_changes(found, kept_start=kept))
        assert f"{100 * share:.1f} % of the photos' brightness is not explained" in text
        assert "lights" not in text


def test_intervals_with_voxels_are_valid_if_the_misfit_is_theirs() -> None:
    voxels = {"fields_best": {"Body:albedo_grid": [0.5]}}
    assert trust.words(ROUGHNESS, with_changes(result(), **voxels)) == ["90 %: 0.280 to 0.320"]
    left = with_changes(result(value=0.0025, explained=False), **voxels)
    of_grid = "90 %, provided that the misfit is that of Body:albedo_grid: 0.280 to 0.320"
    assert trust.words(ROUGHNESS, left) == [of_grid]
    assert "5.0 % of the photos' brightness is not explained: Body:albedo_grid has" in said(left)
    light = with_changes(left, fields_best={"World:environment": np.full((8, 16, 3), 0.5)})
    assert "the misfit is that of World:environment" in trust.words(ROUGHNESS, light)[0]
    assert "not explained: World:environment has not converged" in said(light)
    assert "check lights" not in said(left)
    assert "are not known" not in said(left, fields=("Body:albedo_grid",))


def test_no_interval_is_shown_for_what_the_photos_do_not_determine() -> None:
    entry = trust.certainty(COLOUR, result())
    assert entry.determined is False
    assert entry.interval_90 == ((0.1, 0.2), None, (0.3, 0.4))
    assert entry.standard_error == (0.01, None, 0.02)
    json.dumps(entry.as_json(), allow_nan=False)


def test_what_can_compensate_for_it_is_named() -> None:
    text = said(result())
    assert "Body:base_color: not determined by these photos in G" in text
    assert "Body:ior can compensate for it, so it has no interval" in text
    alone = result()
    alone.report.parameters["Body:base_color"].correlated_with = ["", "", ""]
    assert "in G: values far apart render alike, so it has no interval" in said(alone)


def test_what_is_not_determined_comes_with_where_to_find_the_next_photo() -> None:
    assert "selenite next-camera RESULT_FOLDER" in said(result())
    all_known = result()
    all_known.report.parameters["Body:base_color"].determined = [True] * 3
    assert "next-camera" not in said(all_known)


def test_alternative_minima_are_reported_whole_and_with_each_value_that_they_leave_ambiguous() -> (
    None
):
    found = result()
    other = {"Body:roughness": [0.132], "Body:base_color": [0.5, 0.6, 0.7], "Body:ior": [1.45]}
    found.report.alternative_minima, found.report.ambiguous = [other], ["Body:roughness"]
    found.report.parameters["Body:roughness"].determined = [False]
    assert trust.words(ROUGHNESS, found) == [
        "not determined by these photos: 0.132 in an equivalent alternative minimum"
    ]
    assert "Body:ior can compensate for it" in "".join(trust.words(COLOUR, found))
    whole = "Body:roughness 0.132; Body:base_color 0.5, 0.6, 0.7; Body:ior 1.45"
    assert f"Alternative minimum, equivalent within noise: {whole}." in said(found)
    assert "Alternative minimum" not in said(result())


def test_a_bound_is_named_with_its_cure() -> None:
    assert "Body:ior: at its maximum 0.999: widen the bound" in said(result())
    assert trust.certainty(IOR, result()).at_bound == ("maximum",)


def test_a_bound_that_no_one_can_widen_is_told_as_such() -> None:
    ends = replace(IOR, maximum=10.0)
    said_of = " ".join(trust.words(ends, result()))
    assert "at its maximum 10, where its range ends" in said_of
    assert "widen" not in said_of


@pytest.mark.parametrize(
    ("explained", "words"),
    [(True, "explained within noise"), (False, "5.0 % of the photos' brightness")],
)
def test_a_misfit_is_reported_as_a_share_of_brightness(explained: bool, words: str) -> None:
    assert words in said(result(value=0.0025, explained=explained))


def test_multi_start_says_whether_it_left_the_start() -> None:
    assert "evaluated 65 starting points and continued from another one" in said(result())
    found = result()
    found.search.moved = False
    assert "kept the given one" in said(found)


def test_a_fit_that_is_stopped_in_its_multi_start_says_whose_values_it_has() -> None:
    search = {"points": 39, "moved": True, "start_loss": 1.0, "loss": 0.1, "standard_error": 0.01}
    stopped = {"stopped": StopReason.CANCELLED, "history": {"iteration": []}}
    text = said(made_fit(stopped | {"search": search}))
    assert "after 39 starting points: the values are the best of them, not refined" in text
    text = said(made_fit(stopped | {"search": search | {"moved": False}}))
    assert "the values are the start's: none is clearly better" in text
    assert "the values are" not in said(made_fit(stopped))
    assert "Stopped before the first iteration" in said(made_fit(stopped))
    # One that was stopped later has steps, and nothing of this to say.
    later = made_fit(stopped | {"history": {"iteration": [0, 1]}, "search": search})
    assert "Stopped" not in said(later) and "evaluated 39" in said(later)


def test_nothing_is_said_without_a_refinement() -> None:
    empty = made_fit()
    assert trust.certainty(ROUGHNESS, empty) == trust.Certainty()
    assert set(trust.Certainty().as_json().values()) == {None}
    assert trust.misfit(empty) is None
    assert said(empty) == ""


def test_with_a_grid_it_says_that_nothing_is_known_of_the_errors() -> None:
    assert "errors of these values are not known" not in said(result())
    text = said(made_fit(), fields=("Body:albedo_grid",))
    assert "errors of these values are not known" in text
    assert "90 %" not in text


@pytest.mark.parametrize(
    ("field", "value", "reported"),
    [
        ("Body:base_color_texture", 0.3, True),
        ("Body:base_color_texture", 0.02, False),
        ("Body:base_color_texture", 0.999, False),
        ("Ground:base_color_texture", 0.3, False),
        ("Body:albedo_grid", 0.3, False),
    ],
)
def test_a_transmission_that_an_image_can_compensate_for_is_reported(
    field: str, value: float, reported: bool
) -> None:
    found = made_fit({"fields_best": {field: [0.5]}, "values_best": {"Body:transmission": [value]}})
    words = trust.words(unknown("transmission"), found)
    assert bool(words) is reported and all("If yours is opaque" in line for line in words)
    assert trust.words(ROUGHNESS, found) == []


@pytest.mark.parametrize("name", ["roughness", "coat_roughness", "ior", "coat_ior"])
def test_gloss_beside_an_unknown_light_depends_on_its_texels(name: str) -> None:
    found = result()
    parameters = found.report.parameters
    parameters[f"Body:{name}"] = parameters["Body:roughness"]
    assert not trust.depends_on_texels(unknown(name), found)
    assert trust.certainty(unknown(name), found).determined is True
    found.fields_best = {"World:environment": np.zeros((16, 32, 3))}
    assert trust.depends_on_texels(unknown(name), found)
    assert not trust.depends_on_texels(COLOUR, found)
    entry = trust.certainty(unknown(name), found)
    assert entry.determined is False and None not in entry.interval_90
    said = [line for line in trust.words(unknown(name), found) if "512 texels" in line]
    assert len(said) == 1
    assert not any("texels" in line for line in trust.words(COLOUR, found))


def test_a_pattern_and_what_photos_do_not_agree_on_are_told_apart() -> None:
    photo = {"unexplained": 0.2}
    fit = made_fit({
        "captures": {"Front": photo, "Back": photo},
        "patterns": {
            "Body:base_color_texture": {"explained": 0.83, "left": 0.36},
            "Body:albedo_grid": {"explained": 0.5, "left": 0.0},
            "Body:density_grid": {"explained": math.nan, "left": 0.0},
        },
    })  # fmt: skip
    image = pattern.of_field(fit, "Body:base_color_texture")
    assert image is not None
    assert image.as_json() == pytest.approx({"explained": 0.83, "left": 0.36, "model_error": 0.16})
    assert image.sentence("Body:base_color_texture") == (
        "Body:base_color_texture: its pattern explains 83% of the residual, and photos agree on "
        "36% of the rest; model error 16.0% of the photos' brightness"
    )
    grid = pattern.of_field(fit, "Body:albedo_grid")
    assert grid is not None
    assert grid.sentence("Grid") == (
        "Grid: its pattern explains 50% of the residual; model error 20.0% of the photos' "
        "brightness"
    )
    assert pattern.of_field(fit, "Body:density_grid") is None
    assert pattern.of_field(fit, "Lamp:power") is None
