# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that earlier versions have written stay readable."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "addon"))

from selenite.fit import checkpoint, old_names  # noqa: E402
from selenite.problems import BadInput  # noqa: E402

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


def test_an_unfinished_run_of_an_earlier_version_is_refused(tmp_path: Path) -> None:
    found = {"schema": 1, "selenite": "0.1.0", "grids": None, "optimiser": None, "parts": []}
    (tmp_path / "run.json").write_text(json.dumps(RUN))
    (tmp_path / "state.json").write_text(json.dumps(found))
    with pytest.raises(BadInput, match=r"of another version.*start the run anew"):
        checkpoint.load(tmp_path)
    (tmp_path / "state.json").unlink()
    run = checkpoint.load(tmp_path)  # its request is read
    assert run.state is None and run.request.captures[0].camera == "Camera"


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
