# SPDX-License-Identifier: GPL-3.0-or-later
"""A run that is not finished, on disk: what it has found so far, and how it goes on.

The folder `<date>_<time>.unfinished` holds run.json (the request), state.json (every iteration of
every stage, and the best values), with grids one file of them, and now and then the whole state of
the native fit, from which it goes on to the same bits. Each file is replaced as a whole.
"""

from __future__ import annotations

import io
import json
import math
import shutil
import struct
import time
import tokenize
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..atomic_files import write_bytes, write_json
from ..parameters import join_name
from ..problems import BadInput, Problem
from .job import SavedState
from .old_names import renamed
from .request import RunRequest, read_run
from .staging.request import StageRequest

SCHEMA = 1
SUFFIX = ".unfinished"
#: Seconds between two updates, between two whole states, and how often the time that one took fits
#: between it and the next: at most so small a share of a run goes into its record.
_EVERY, _STATE_EVERY, _TIMES = 2.0, 15.0, 30.0
#: A part that goes on has at least so many iterations, to learn anew what the optimiser knew.
_FEWEST = 10
_PART = ", part "
_SCALARS = (
    "iterations", "best_iteration", "best_validation", "best_validation_standard_error", "samples",
    "seconds", "cpu_seconds", "dropped", "stopped_because", "optimiser",
)  # fmt: skip

#: How a file of the folder fails to be understood: JSON, and NumPy's archive of arrays.
_BROKEN = (
    OSError, ValueError, KeyError, TypeError, AttributeError, IndexError, EOFError, OverflowError,
    RecursionError, MemoryError, NotImplementedError, SyntaxError, struct.error,
    tokenize.TokenError, zipfile.BadZipFile, zlib.error,
)  # fmt: skip

Parts = Sequence[Mapping[str, Any]]  # native results, one for each stage that has begun


@dataclass(frozen=True)
class Unfinished:
    """A run on disk. parts: native results of the stages that had begun; state: the whole state of
    the newest of them, if there is one."""

    request: RunRequest
    parts: list[dict[str, Any]]
    state: SavedState | None = None


class Recorder:
    """Keeps a folder up to date while a job runs."""

    def __init__(self, folder: Path, request: RunRequest) -> None:
        """Makes the folder if there is none. Raises OSError."""
        self.folder = folder
        self._next = self._next_state = 0.0
        self._seen: tuple[int, int] = (0, -1)
        self._state: dict[str, Any] | None = None
        folder.mkdir(parents=True, exist_ok=True)
        write_json(folder / "run.json", request.as_json())

    def update(self, job: Any, *, now: bool = False) -> None:  # noqa: ANN401 - FitJob or StagedJob
        """Writes what `job.parts()` has found, at most every two seconds unless `now`, and less
        often where that takes long."""
        if not now and time.monotonic() < self._next:
            return
        begin = time.monotonic()
        data = job.take_state()
        parts = job.parts()
        if data is not None:
            self._write_state(data, parts)
        seen = (len(parts), int(parts[-1]["iterations"]))
        if seen != self._seen or data is not None:
            save(self.folder, parts, self._state)
            self._seen = seen
        if time.monotonic() >= self._next_state:
            job.request_state()
        took = time.monotonic() - begin
        self._next = time.monotonic() + max(_EVERY, _TIMES * took)

    def _write_state(self, data: bytes, parts: Parts) -> None:
        begin = time.monotonic()
        number = len(parts)
        name = f"optimiser_{number}.state"
        write_bytes(self.folder / name, data)
        self._state = {"file": name, "part": number, "seconds": float(parts[-1]["seconds"])}
        took = time.monotonic() - begin
        self._next_state = time.monotonic() + max(_STATE_EVERY, _TIMES * took)

    def finished(self) -> None:
        """The results stand elsewhere: the folder goes."""
        shutil.rmtree(self.folder)


def save(folder: Path, parts: Parts, optimiser: Mapping[str, Any] | None = None) -> None:
    """state.json, and the grids in a file that it names. Raises OSError.

    optimiser: {"file", "part" (its number), "seconds"} of the whole state that is there.
    """
    grids = {
        f"{index}|{which}|{name}": grid
        for index, part in enumerate(parts)
        for which in ("fields_best", "fields_last")
        for name, grid in part[which].items()
    }
    old = {*folder.glob("grids_*.npz"), *folder.glob("optimiser_*.state")}
    file = None
    if grids:
        packed = io.BytesIO()
        np.savez(packed, **grids)
        file = f"grids_{len(parts)}_{parts[-1]['iterations']}.npz"
        write_bytes(folder / file, packed.getvalue())
    state = {
        "schema": SCHEMA,
        "selenite": __version__,
        "grids": file,
        "optimiser": optimiser,
        "parts": [_part_json(part) for part in parts],
    }
    write_json(folder / "state.json", state)
    for path in old - {folder / str(file), folder / (optimiser or {}).get("file", "-")}:
        path.unlink()


def load(folder: Path) -> Unfinished:
    """What was asked for, and what was found so far. Raises BadInput."""
    title = f"Folder '{folder}'"
    if not folder.is_dir():
        raise BadInput(Problem(title, "it does not exist", "give the folder of a run"))
    if (folder / "result.json").is_file():
        cause, cure = "this run is finished", "nothing is left to resume; start a new one"
        raise BadInput(Problem(title, cause, cure))
    request = read_run(folder / "run.json")
    if not (folder / "state.json").is_file():
        return Unfinished(request, [])  # it was stopped before its first iteration
    try:
        state = renamed(json.loads((folder / "state.json").read_text(encoding="utf-8")))
        if state.get("schema") != SCHEMA:
            raise ValueError(f"its schema is {state.get('schema')!r}")
        parts = [_part(item) for item in state["parts"]]
        if state["grids"]:
            with (
                (folder / state["grids"]).open("rb") as file,  # closed also if it is no archive
                np.load(file, allow_pickle=False) as grids,
            ):
                for key in grids.files:
                    index, which, name = key.split("|", 2)
                    parts[int(index)][which][name] = grids[key]
        saved = _optimiser(folder, state.get("optimiser"), len(parts))
    except _BROKEN as error:
        cause = f"its state cannot be read ({error})"
        raise BadInput(Problem(title, cause, "start the run anew with its run.json")) from error
    return Unfinished(request, parts, saved)


def going_on(run: Unfinished) -> Unfinished:
    """The run as it is to go on: results of the stages that are done, and the state of the next.

    With a state the request stays as it is. Without one, a stage that was interrupted becomes two:
    what was done of it, and what is left; and a run without stages becomes one stage.
    """
    request, parts = run.request, run.parts
    names = tuple(join_name(item.owner, item.parameter) for item in request.unknowns)
    stages = request.stages or (StageRequest("everything", names),)
    parts = [part for part in parts if part["iterations"]]
    if not parts:
        return Unfinished(request, [])
    last = len(parts) - 1
    stage, part = stages[last], parts[-1]
    wanted = request.settings.iterations if stage.iterations is None else stage.iterations
    done = int(part["iterations"])
    ended = part["stopped_because"] not in ("", "cancelled")
    # At the last iteration its refinement may be left; beyond it run.json asks for less by now.
    if not ended and run.state is not None and done <= wanted:
        return Unfinished(request, parts[:-1], run.state)
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
    return Unfinished(replace(request, stages=stages), parts)


def _optimiser(folder: Path, about: Mapping[str, Any] | None, parts: int) -> SavedState | None:
    """The whole state of the newest part; None if there is none of it."""
    if about is None or about["part"] != parts or not (folder / about["file"]).is_file():
        return None
    path = folder / str(about["file"])
    return SavedState(str(path), path.read_bytes(), float(about["seconds"]))


def _part_json(part: Mapping[str, Any]) -> dict[str, Any]:
    history = part["history"]
    return {
        **{key: _plain(part[key]) for key in _SCALARS},
        "values_best": {key: _plain(value) for key, value in part["values_best"].items()},
        "values_last": {key: _plain(value) for key, value in part["values_last"].items()},
        "search": _plain(part.get("search")),
        "report": _plain(part.get("report")),
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
        "search": item.get("search"),
        "report": item.get("report"),
        "fields_best": {},
        "fields_last": {},
        "history": history,
    }


def _plain(value: Any) -> Any:  # noqa: ANN401 - numbers, words, arrays and lists of them
    """For JSON: lists for arrays, null for what is not a number."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
