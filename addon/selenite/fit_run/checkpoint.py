# SPDX-License-Identifier: GPL-3.0-or-later
"""A run that is not finished, on disk: what it has found so far, and how it goes on.

The folder `<date>_<time>.unfinished` holds run.json (the request), state.json (every iteration of
every stage, and the best values) and, with grids, one file of them. Each is replaced as a whole.
"""

from __future__ import annotations

import io
import json
import math
import shutil
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..atomic_files import write_bytes
from ..parameters import join_name
from ..problems import BadInput, Problem
from .request import RunRequest, read_run
from .stages import StageRequest

SCHEMA = 1
SUFFIX = ".unfinished"
_EVERY = 2.0  # seconds between two states on disk
#: A part that goes on has at least so many iterations, to learn anew what the optimiser knew.
_FEWEST = 10
_PART = ", part "
_SCALARS = (
    "iterations", "best_iteration", "best_validation", "best_validation_standard_error", "samples",
    "seconds", "cpu_seconds", "dropped", "stopped_because", "optimiser",
)  # fmt: skip

Parts = Sequence[Mapping[str, Any]]  # native results, one for each stage that has begun


class Recorder:
    """Keeps a folder up to date while a job runs."""

    def __init__(self, folder: Path, request: RunRequest) -> None:
        """Makes the folder if there is none. Raises OSError."""
        self.folder = folder
        self._next = 0.0
        self._seen: tuple[int, int] = (0, -1)
        folder.mkdir(parents=True, exist_ok=True)
        _write_json(folder / "run.json", request.as_json())

    def look(self, job: Any, *, now: bool = False) -> None:  # noqa: ANN401 - FitJob or StagedJob
        """Writes what `job.parts()` has found, at most every two seconds unless `now`."""
        if not now and time.monotonic() < self._next:
            return
        parts = job.parts()
        state = (len(parts), int(parts[-1]["iterations"]))
        if state != self._seen:
            save(self.folder, parts)
            self._seen = state
        self._next = time.monotonic() + _EVERY

    def finished(self) -> None:
        """The results stand elsewhere: the folder goes."""
        shutil.rmtree(self.folder)


def save(folder: Path, parts: Parts) -> None:
    """state.json, and the grids in a file that it names. Raises OSError."""
    grids = {
        f"{index}|{which}|{name}": grid
        for index, part in enumerate(parts)
        for which in ("fields_best", "fields_last")
        for name, grid in part[which].items()
    }
    old = set(folder.glob("grids_*.npz"))
    file = None
    if grids:
        packed = io.BytesIO()
        np.savez_compressed(packed, **grids)
        file = f"grids_{len(parts)}_{parts[-1]['iterations']}.npz"
        write_bytes(folder / file, packed.getvalue())
    state = {
        "schema": SCHEMA,
        "selenite": __version__,
        "grids": file,
        "parts": [_part_json(part) for part in parts],
    }
    _write_json(folder / "state.json", state)
    for path in old - {folder / str(file)}:
        path.unlink()


def load(folder: Path) -> tuple[RunRequest, list[dict[str, Any]]]:
    """(what was asked for, with its stages; the results so far). Raises BadInput."""
    title = f"Folder '{folder}'"
    if not folder.is_dir():
        raise BadInput(Problem(title, "it does not exist", "give the folder of a run"))
    if (folder / "result.json").is_file():
        cause, cure = "this run is finished", "nothing is left to resume; start a new one"
        raise BadInput(Problem(title, cause, cure))
    request = read_run(folder / "run.json")
    if not (folder / "state.json").is_file():
        return request, []  # it was stopped before its first iteration
    try:
        state = json.loads((folder / "state.json").read_text(encoding="utf-8"))
        if state.get("schema") != SCHEMA:
            raise ValueError(f"its schema is {state.get('schema')!r}")
        parts = [_part(item) for item in state["parts"]]
        if state["grids"]:
            with np.load(folder / state["grids"], allow_pickle=False) as grids:
                for key in grids.files:
                    index, which, name = key.split("|", 2)
                    parts[int(index)][which][name] = grids[key]
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        cause = f"its state cannot be read ({error})"
        raise BadInput(Problem(title, cause, "start the run anew with its run.json")) from error
    return request, parts


def going_on(
    request: RunRequest, parts: list[dict[str, Any]]
) -> tuple[RunRequest, list[dict[str, Any]]]:
    """The request whose stages begin with those that are done, and the results of those.

    A stage that was interrupted becomes two: what was done of it, and what is left. A run without
    stages becomes one stage.
    """
    names = tuple(join_name(item.owner, item.parameter) for item in request.unknowns)
    stages = request.stages or (StageRequest("everything", names),)
    parts = [part for part in parts if part["iterations"]]
    if not parts:
        return replace(request, stages=stages), []
    last = len(parts) - 1
    stage, part = stages[last], parts[-1]
    wanted = request.settings.iterations if stage.iterations is None else stage.iterations
    done = int(part["iterations"])
    ended = part["stopped_because"] not in ("", "cancelled")
    if not ended and done >= wanted:
        parts[-1] = part | {"stopped_because": "all iterations done"}
    elif not ended:
        parts[-1] = part | {"stopped_because": "interrupted"}
        taken = {item.name for item in stages}
        first, number = stage.name.partition(_PART)[0], 2
        while (name := f"{first}{_PART}{number}") in taken:
            number += 1
        left = replace(stage, name=name, iterations=max(wanted - done, _FEWEST))
        stages = (*stages[:last], replace(stage, iterations=done), left, *stages[last + 1 :])
    return replace(request, stages=stages), parts


def _part_json(part: Mapping[str, Any]) -> dict[str, Any]:
    history = part["history"]
    return {
        **{key: _plain(part[key]) for key in _SCALARS},
        "values_best": {key: _plain(value) for key, value in part["values_best"].items()},
        "values_last": {key: _plain(value) for key, value in part["values_last"].items()},
        "history": {
            key: {name: _plain(item) for name, item in value.items()}
            if isinstance(value, Mapping)
            else _plain(value)
            for key, value in history.items()
        },
    }


def _part(item: Mapping[str, Any]) -> dict[str, Any]:
    history: dict[str, Any] = {}
    for key, value in item["history"].items():
        if isinstance(value, dict):
            history[key] = {name: np.asarray(column, float) for name, column in value.items()}
        else:
            history[key] = np.asarray(value, int if key == "iteration" else float)
    scalars = {key: math.nan if item[key] is None else item[key] for key in _SCALARS}
    return {
        **scalars,
        "error": "",
        "values_best": dict(item["values_best"]),
        "values_last": dict(item["values_last"]),
        "fields_best": {},
        "fields_last": {},
        "history": history,
    }


def _plain(value: Any) -> Any:  # noqa: ANN401 - numbers, words, arrays and lists of them
    """For JSON: lists for arrays, null for what is not a number."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _write_json(path: Path, data: Mapping[str, Any]) -> None:
    text = json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False)
    write_bytes(path, (text + "\n").encode())
