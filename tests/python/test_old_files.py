# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that earlier versions have written stay readable."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "addon"))

from selenite.fit_run import checkpoint, old_names, trust  # noqa: E402

#: As version 0.1.0 wrote it before photos had ids.
RUN: dict[str, Any] = {
    "schema": 1,
    "selenite": "0.1.0",
    "scene": "/scenes/one.blend",
    "unknowns": [{"owner": "Body", "parameter": "ior"}],
    "captures": [{"camera": "Camera", "photo": "/photos/Camera.png", "mask": ""}],
    "settings": {"iterations": 20, "search": "off"},
    "stages": [],
    "staging": "",
}
PART: dict[str, Any] = {
    "iterations": 15,
    "best_iteration": 15,
    "best_validation": 0.001,
    "best_validation_standard_error": 0.0001,
    "samples": 1000,
    "seconds": 2.0,
    "cpu_seconds": 4.0,
    "dropped": 0,
    "stopped_because": "the values have settled",
    "optimiser": "gauss-newton",
    "values_best": {"Body:ior": [1.4]},
    "values_last": {"Body:ior": [1.4]},
    "search": None,
    "report": {
        "parameters": {},
        "passes": 1,
        "rivals": [{"Body:ior": [1.7]}],
        "contested": ["Body:ior"],
        "misfit": {"value": 0.0, "standard_error": 0.1, "explained": True},
    },
    "history": {"iteration": [0], "loss": [1.0], "values": {"Body:ior": [[1.4]]}},
}


def test_an_unfinished_run_of_an_earlier_version_goes_on(tmp_path: Path) -> None:
    state = {"schema": 1, "selenite": "0.1.0", "grids": None, "optimiser": None, "parts": [PART]}
    (tmp_path / "run.json").write_text(json.dumps(RUN))
    (tmp_path / "state.json").write_text(json.dumps(state))
    run = checkpoint.going_on(checkpoint.load(tmp_path))
    assert run.request.captures[0].camera == "Camera"
    (part,) = run.parts
    assert part["stopped_because"] == "converged"
    assert trust.alternative_minima(part) == [{"Body:ior": [1.7]}]
    assert trust.ambiguous(part) == ["Body:ior"]


def test_a_result_of_an_earlier_version_has_the_names_of_this_one() -> None:
    old = {"rivals": [{"Body:ior": 1.7}], "stages": [{"stopped_because": "cancelled"}], "seed": 3}
    assert old_names.renamed(old) == {
        "alternative_minima": [{"Body:ior": 1.7}],
        "stages": [{"stopped_because": "cancelled"}],
        "seed": 3,
    }
    assert old_names.renamed({"stopped_because": "the values have settled"}) == {
        "stopped_because": "converged"
    }
