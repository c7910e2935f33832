# SPDX-License-Identifier: GPL-3.0-or-later
"""result.json as version 0.1 has written it: what is written stays the same to the byte, and what
is read is what was written."""

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

sys.path.insert(0, str(Path(__file__).parent))

from made_results import made_fit  # noqa: E402

from selenite.capture.prepared import Capture  # noqa: E402
from selenite.fit.model_error import EXPLAINED, ModelError  # noqa: E402
from selenite.json_text import json_text  # noqa: E402
from selenite.parameters import Values, table  # noqa: E402
from selenite.problems import BadInput  # noqa: E402
from selenite.report.finished_fit import FinishedFit  # noqa: E402
from selenite.report.halves import Halves  # noqa: E402
from selenite.report.hold_out import Compared, SquaredError  # noqa: E402
from selenite.report.result_file import ResultFile, stored_result  # noqa: E402

STORED = Path(__file__).parent / "stored" / "result.json"
#: Of the machine that wrote the stored file.
VERSIONS = {"selenite": "1", "blender": "4.5.0", "python": "3", "numpy": "2"}
IMAGE = "Jade:base_color_texture"


def unknown(name: str, start: Values, low: float, high: float) -> Any:
    return SimpleNamespace(
        owner="Jade", parameter=table()["material", name], name=f"Jade:{name}", start=start,
        minimum=low, maximum=high,
    )  # fmt: skip


def photo(name: str, **more: Any) -> Capture:
    """Of 200 x 100 pixels, compared at 100 x 50."""
    reference, weight = np.full((50, 100, 3), 0.5, np.float32), np.ones((50, 100), np.float32)
    return Capture(name, name, f"{name}.png", (200, 100), reference, weight, 2.0, **more)


def plan() -> Any:
    """A number, a colour, a medium and an image; a photo that is aligned and one that is not."""
    image = SimpleNamespace(
        name=IMAGE, values=np.full((2, 2, 3), 0.25, np.float32), minimum=0.0, maximum=1.0, UNIT="1",
        mean=lambda values: tuple(values.mean(axis=(0, 1)).tolist()),
        about=lambda _values, _coverage: {
            "texels": [2, 2], "seen": 0.5, "files": ["Jade_base_color_texture.exr"]
        },
    )  # fmt: skip
    request = SimpleNamespace(settings=SimpleNamespace(seed=3))
    return SimpleNamespace(
        unknowns=[
            unknown("roughness", (0.5,), 0.02, 0.999),
            unknown("base_color", (0.5, 0.5, 0.5), 0.001, 0.999),
            unknown("extinction", (2.0, 2.0, 4.0), 0.001, 1000.0),
        ],
        fields=[image],
        captures=[
            photo("Front", of_fit={"free_gain": "scalar", "align": True}),
            photo("Side", gain=(1.5, 1.25, 1.0), isolated=0.125),
        ],
        millimetres=1000.0, model="Principled v2", warnings=["a warning"], request=request,
    )  # fmt: skip


def result() -> FinishedFit:
    parameters = {
        "Jade:roughness": {
            "standard_error": [0.01], "interval_90": [(0.28, 0.32)], "determined": [True],
            "at_bound": [None], "correlated_with": ["Jade:base_color[1]"],
        },
        "Jade:base_color": {
            "standard_error": [0.01, math.inf, 0.02],
            "interval_90": [(0.1, 0.2), (0.0, 1.0), (0.3, 0.4)],
            "determined": [True, False, True], "at_bound": [None, "maximum", None],
            "correlated_with": [None, "Jade:extinction[0]", None],
        },
        "Jade:extinction": {
            "standard_error": [0.5] * 3, "interval_90": [(1.0, 3.0)] * 3, "determined": [True] * 3,
            "at_bound": [None] * 3, "correlated_with": [None] * 3,
        },
    }  # fmt: skip
    best = {
        "Jade:roughness": [0.3], "Jade:base_color": [0.15, 0.5, 0.35],
        "Jade:extinction": [2.5, 3.0, 0.0],
    }  # fmt: skip
    other = {
        "Jade:roughness": [0.75], "Jade:base_color": [0.25, 0.5, 0.5], "Jade:extinction": [1.0] * 3,
    }  # fmt: skip
    fit = made_fit({
        "values_best": best, "fields_best": {IMAGE: np.full((2, 2, 3), 0.5, np.float32)},
        "best_iteration": 3, "best_validation": 0.125, "best_validation_standard_error": 0.0625,
        "captures": {
            "Front": {
                "residual_rms": 0.01, "shift": (1.0, -0.5, 0.0), "gain": (1.25, 1.25, 1.25),
                "gain_interval_90": [(1.2, 1.3)] * 3,
            },
            "Side": {"residual_rms": 0.02, "unexplained": 0.25},
        },
        "model_error": {"relative": 0.01, "absolute": 0.02, "shift": 0.25},
        "iterations": 5, "stopped_because": "converged", "samples": 1234, "seconds": 1.5,
        "cpu_seconds": 2.5, "dropped": 6,
        "report": {
            "parameters": parameters, "passes": 2,
            "misfit": {"value": 0.0025, "standard_error": 0.0001, "explained": False},
            "alternative_minima": [other], "ambiguous": ["Jade:roughness"],
            "weak_directions": [{
                "deviation": 0.5, "components": ["Jade:base_color[1]"], "captures": ["Front"],
            }],
        },
        "stages": [{
            "name": "colour", "parameters": ["Jade:base_color"], "iterations": 4, "spp": 8,
            "height": 50, "best_iteration": 3, "stopped_because": "converged", "samples": 617,
            "seconds": 0.75, "cpu_seconds": 1.25, "values": {"Jade:base_color": [0.15, 0.5, 0.35]},
        }],
    })  # fmt: skip
    unseen = photo("Back")
    halves = (unseen.reference, unseen.reference)
    error, own = SquaredError(0.5, 0.0001, 8.0), SquaredError(0.001, 0.01, 8.0)
    return FinishedFit(
        fit, notes=("a note",), fitted_means={IMAGE: (0.5, 0.25, 0.125)},
        halves={IMAGE: Halves(0.125, 0.25, 0.5, np.zeros((2, 2)))},
        hold_out=[Compared(unseen, halves, 2, error, own, (1.0, 1.5, 2.0))],
        doubtful_shifts={"Front": "limit"},
    )  # fmt: skip


def test_the_file_is_written_as_it_ever_was() -> None:
    written = replace(ResultFile.of(plan(), result(), "4.5.0"), versions=VERSIONS)
    assert json_text(written.as_json(), 1) + "\n" == STORED.read_text(encoding="utf-8")


def test_what_is_read_is_what_was_written() -> None:
    stored = stored_result(STORED.parent)
    values = {name: row.value for name, row in stored.parameters.items()}
    assert values == {
        "Jade:roughness": (0.3,), "Jade:base_color": (0.15, 0.5, 0.35),
        "Jade:extinction": (2.5, 3.0, 0.0), IMAGE: (0.5, 0.25, 0.125),
    }  # fmt: skip
    colour, roughness = (stored.parameters[f"Jade:{name}"] for name in ("base_color", "roughness"))
    assert colour.interval_90 == ((0.1, 0.2), None, (0.3, 0.4)) and colour.determined is False
    assert roughness.interval_90 == ((0.28, 0.32),) and roughness.initial == (0.5,)
    assert stored.parameters[IMAGE].determined is None
    assert stored.parameters[IMAGE].files == ("Jade_base_color_texture.exr",)
    assert stored.model_error == ModelError(0.01, 0.02, 0.25)
    front = stored.as_found(photo("Front"))
    assert front.gain == (1.25, 1.25, 1.25) and front.alignment == (1.0, -0.5, 0.0)
    other = stored.as_found(photo("Back"))  # which the fit has not seen
    assert other.gain == (1.0, 1.0, 1.0) and other.alignment == (0.0, 0.0, 0.0)


def written(folder: Path, **content: Any) -> Path:
    (folder / "result.json").write_text(json.dumps(content), encoding="utf-8")
    return folder


def test_a_file_of_an_earlier_version_has_no_gains_and_no_model_error(tmp_path: Path) -> None:
    rows = {"Body:ior": {"value": 1.7, "rivals": []}}
    stored = stored_result(written(tmp_path, parameters=rows, loss={"model_error": None}))
    assert stored.parameters["Body:ior"].value == (1.7,) and stored.model_error == EXPLAINED
    given = photo("Front", gain=(2.0, 2.0, 2.0))
    assert stored.as_found(given).gain == (2.0, 2.0, 2.0)
    one = stored_result(written(tmp_path, parameters={}, captures={"Front": {"gain": 1.5}}))
    assert one.as_found(given).gain == (1.5, 1.5, 1.5)


@pytest.mark.parametrize(
    ("content", "cause"),
    [
        ({}, "it has no 'parameters'"),
        ({"parameters": {"Body:ior": {}}}, "the value of 'Body:ior' is None"),
        ({"parameters": {"Body:ior": {"value": [1.5, "x"]}}}, "the value of 'Body:ior' is"),
        ({"parameters": {"Body:ior": {"value": True}}}, "the value of 'Body:ior' is True"),
        ({"parameters": {"Body:ior": 1.5}}, "not an object of objects"),
        ({"parameters": {"ior": {"value": 1.5}}}, "ior"),
        (
            {"parameters": {"Body:albedo_grid": {"value": 1, "files": ["../a.npy"]}}},
            "the files of 'Body:albedo_grid' are",
        ),
        ({"parameters": {}, "captures": {"A": {"gain": [1, 0, 1]}}}, "not one or three above 0"),
        ({"parameters": {}, "captures": {"A": {"shift": [1, 2]}}}, "not two pixels and an angle"),
        ({"parameters": {}, "loss": {"model_error": {"shift": "x"}}}, "the model error is"),
    ],
)
def test_a_file_that_is_damaged_is_refused(
    content: dict[str, Any], cause: str, tmp_path: Path
) -> None:
    with pytest.raises(BadInput) as found:
        stored_result(written(tmp_path, **content))
    (problem,) = found.value.problems
    assert str(tmp_path / "result.json") in problem.object and cause in problem.cause
    assert "the folder of a fit that has ended" in problem.cure
