# SPDX-License-Identifier: GPL-3.0-or-later
"""Plans and results of fits, as far as the words about them need."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from selenite import native
from selenite.parameters import table

EXPLAINED = {"value": 0.0001, "standard_error": 0.0001, "explained": True}
_NO_ROWS = np.empty(0)


def made_fit(found: Mapping[str, Any] | None = None) -> Any:
    """A FitResult of these attributes, nested ones as dicts; the others are those of a fit that has
    found nothing."""
    core, given = native.core(), dict(found or {})
    report = dict(given.pop("report", {}))
    report["parameters"] = {
        name: _made(
            core.ParameterConfidence, {"samples_factor": [0.0] * len(row["determined"])} | dict(row)
        )
        for name, row in report.get("parameters", {}).items()
    }
    report["weak_directions"] = [
        _made(core.WeakDirection, row) for row in report.get("weak_directions", ())
    ]
    report["misfit"] = _made(core.Misfit, EXPLAINED | report.get("misfit", {}))
    nothing = {"passes": 0, "spp": 0, "alternative_minima": [], "ambiguous": []}
    photo = {
        "residual_rms": 0.0, "unexplained": 0.0, "shift": None, "gain": None,
        "gain_interval_90": None,
    }  # fmt: skip
    search = {"points": 0, "moved": False, "start_loss": 0.0, "loss": 0.0, "standard_error": 0.0}
    model_error = {"relative": 0.0, "absolute": 0.0, "shift": 0.0}
    shape_steps = {"turning": 0, "intersecting": 0, "given_up": 0}
    stages = given.pop("stages", None)
    nested = {
        "report": _made(core.TrustReport, nothing | report),
        "history": made_history(given.pop("history", {})),
        "captures": {
            name: _made(core.FoundPhoto, photo | row)
            for name, row in given.pop("captures", {}).items()
        },
        "search": _made(core.Search, search | given.pop("search", {})),
        "model_error": _made(core.ModelError, model_error | given.pop("model_error", {})),
        "shape_steps": _made(core.ShapeSteps, shape_steps | given.pop("shape_steps", {})),
        "patterns": {
            name: _made(core.FieldPattern, row) for name, row in given.pop("patterns", {}).items()
        },
        "stages": stages and [_made(core.FoundStage, row) for row in stages],
    }
    values = {
        "values_last": {}, "values_best": {}, "fields_last": {}, "fields_best": {},
        "best_iteration": 0, "best_validation": math.nan,
        "best_validation_standard_error": math.nan, "start_validation": math.nan,
        "kept_start": False, "iterations": 0, "stopped": core.StopReason.NONE,
        "stopped_because": "", "problems": [], "optimiser": "adam", "samples": 0, "dropped": 0,
        "cpu_seconds": 0.0, "seconds": 0.0,
    }  # fmt: skip
    return _made(core.FitResult, values | given | nested)


def with_changes(found: Any, **attributes: Any) -> Any:
    """The same with other attributes."""
    return SimpleNamespace(**vars(found) | attributes)


def made_history(found: Mapping[str, Any]) -> Any:
    """A History of these columns."""
    columns = {
        "iteration": _NO_ROWS, "loss": _NO_ROWS, "validation": _NO_ROWS,
        "validation_standard_error": _NO_ROWS, "mean_bias": np.empty((0, 3)), "values": {},
        "field_means": {}, "stage": None,
    }  # fmt: skip
    return _made(native.core().History, columns | dict(found))


def made_progress(**found: Any) -> Any:
    """The Progress of a fit that has just begun, but for these."""
    state = {
        "running": True, "done": False, "problems": [], "stopped": native.core().StopReason.NONE,
        "stopped_because": "", "stage": 0, "iteration": 0, "own_iteration": 0, "iterations": 40,
        "phase": "descent", "phase_fraction": 0.0, "loss": math.nan, "validation": math.nan,
        "validation_standard_error": math.nan, "seconds": 0.0, "seconds_left": math.nan,
        "values": {},
    }  # fmt: skip
    return _made(native.core().Progress, state | found)


def _made(kind: type, attributes: Mapping[str, Any]) -> Any:
    """In place of a native object: it has the attributes of its class, no more and no less."""
    own = {name for name, value in vars(kind).items() if isinstance(value, property)}
    missing, strange = own - attributes.keys(), attributes.keys() - own
    assert not missing and not strange, f"{kind.__name__} lacks {missing}, has not {strange}"
    return SimpleNamespace(**attributes)


def plan_of(*names: str) -> Any:
    """Of parameters of the material Jade, between 0 and 1."""
    unknowns = [
        SimpleNamespace(
            owner="Jade", parameter=table()["material", name], name=f"Jade:{name}",
            start=(0.5,) * table()["material", name].width, minimum=0.0, maximum=1.0,
            by_ratio=False,
        )
        for name in names
    ]  # fmt: skip
    photo = SimpleNamespace(
        id="Front", isolated=0.0, free_gain="none", gain=(1.0, 1.0, 1.0), mask_share=1.0
    )
    return SimpleNamespace(unknowns=unknowns, fields=[], captures=[photo])


def result_of(
    misfit: dict[str, Any] | None = None, **entries: tuple[float, float, float] | None
) -> Any:
    """name -> (low, value, high), or None for a value that is not determined."""
    report = {}
    values = {}
    for name, numbers in entries.items():
        low, value, high = numbers or (0.0, 0.5, 1.0)
        values[f"Jade:{name}"] = [value]
        report[f"Jade:{name}"] = {
            "standard_error": [0.01], "interval_90": [(low, high)],
            "determined": [numbers is not None], "at_bound": [None], "correlated_with": [None],
        }  # fmt: skip
    return made_fit({
        "values_best": values,
        "stopped": native.core().StopReason.CONVERGED,
        "report": {"parameters": report, "passes": 3, "misfit": misfit or EXPLAINED},
    })  # fmt: skip
