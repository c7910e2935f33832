# SPDX-License-Identifier: GPL-3.0-or-later
"""The results of the stages of a run as one result, with the keys of a single fit's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...parameters import Values
from ..plan import FitPlan
from .plan import Point, at_colours

_SUMS = ("iterations", "samples", "seconds", "cpu_seconds", "dropped")


def joined(plan: FitPlan, results: Sequence[Mapping[str, Any]], point: Point) -> dict[str, Any]:
    """results: of each stage that has started. point: where the last of them started.

    Keys as of the native result, of the whole run: `best_iteration` counts over all stages, losses
    are those of the last stage (another height is another loss). `history` has the key `stage`
    (k,), counted from 1, and every unknown in every row, fixed ones too. `stages`: a list of dicts
    {name, parameters, iterations, spp, height, best_iteration, stopped_because, samples, seconds,
    cpu_seconds, values}.
    """
    last = results[-1]
    best = {name: list(value) for name, value in point.values.items()}
    newest = dict(best)
    for name in last["values_best"]:
        best[name] = [float(x) for x in np.ravel(last["values_best"][name])]
        newest[name] = [float(x) for x in np.ravel(last["values_last"][name])]
    active = plan.stages[len(results) - 1].fields
    waiting = [field for field in plan.fields if field not in active]  # one colour stands for it
    fields_best = point.fields | at_colours(_tuples(best), plan.unknowns, waiting)
    fields_last = point.fields | at_colours(_tuples(newest), plan.unknowns, waiting)
    before = sum(item["iterations"] for item in results[:-1])
    total = {key: sum(item[key] for item in results) for key in _SUMS}
    return dict(last) | total | {
        "values_best": best,
        "values_last": newest,
        "fields_best": fields_best | dict(last["fields_best"]),
        "fields_last": fields_last | dict(last["fields_last"]),
        "search": results[0].get("search"),  # only the first stage does
        "best_iteration": before + last["best_iteration"],
        "history": _history(plan, results),
        "stages": [_about(plan, index, item) for index, item in enumerate(results)],
    }  # fmt: skip


def _tuples(values: Mapping[str, list[float]]) -> dict[str, Values]:
    return {name: tuple(value) for name, value in values.items()}


def _about(plan: FitPlan, index: int, result: Mapping[str, Any]) -> dict[str, Any]:
    stage = plan.stages[index]
    return {
        "name": stage.request.name,
        "parameters": list(stage.request.parameters),
        "iterations": result["iterations"],
        "spp": stage.settings.spp,
        "height": stage.captures[0].reference.shape[0],
        "best_iteration": result["best_iteration"],
        "stopped_because": result["stopped_because"],
        "samples": result["samples"],
        "seconds": result["seconds"],
        "cpu_seconds": result["cpu_seconds"],
        "values": {
            name: [float(x) for x in np.ravel(value)]
            for name, value in result["values_best"].items()
        },
    }


def _history(plan: FitPlan, results: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The rows of all stages; iterations count on, so that a stage's first row has the number of
    the last one of the stage before it."""
    values: dict[str, Values] = {item.name: item.start for item in plan.unknowns}
    fields = {field.name: field for field in plan.fields}
    mean_of = {name: _grey(field.mean(field.values)) for name, field in fields.items()}
    parts: dict[str, list[np.ndarray]] = {}
    columns: dict[str, list[np.ndarray]] = {name: [] for name in values}
    field_columns: dict[str, list[np.ndarray]] = {name: [] for name in mean_of}
    done = 0
    for number, result in enumerate(results, start=1):
        history = result["history"]
        rows = len(history["iteration"])
        own = {"stage": np.full(rows, number), "iteration": np.asarray(history["iteration"]) + done}
        for key, column in {**history, **own}.items():
            if key not in ("values", "field_means"):
                parts.setdefault(key, []).append(np.asarray(column))
        for name, fixed in values.items():
            column = history["values"].get(name)
            width = len(fixed)
            column = np.tile(fixed, (rows, 1)) if column is None else np.asarray(column)
            columns[name].append(column.reshape(rows, width))
        for name, mean in mean_of.items():
            column = history["field_means"].get(name)
            column = np.tile(mean, (rows, 1)) if column is None else np.asarray(column)
            field_columns[name].append(column.reshape(rows, 3))
        for name, value in result["values_best"].items():
            values[name] = tuple(map(float, np.ravel(value)))
        for name, grid in result["fields_best"].items():
            mean_of[name] = _grey(fields[name].mean(grid))
        done += result["iterations"]
    return {key: np.concatenate(items) for key, items in parts.items()} | {
        "values": {name: np.concatenate(items) for name, items in columns.items()},
        "field_means": {name: np.concatenate(items) for name, items in field_columns.items()},
    }


def _grey(mean: Values) -> np.ndarray:
    """(3,) of 1 or 3 numbers."""
    return np.resize(np.array(mean), 3)
