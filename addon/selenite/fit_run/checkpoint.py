# SPDX-License-Identifier: GPL-3.0-or-later
"""A run that is not finished, on disk: what it has found so far, and how it goes on.

The folder `<date>_<time>.unfinished` holds run.json (the request), inputs.json (digests of what it
was given), state.json (every iteration of every stage, and the best values), with grids one file of
them, and now and then the whole state of the native fit, from which it goes on to the same bits.
Each file is replaced as a whole.
"""

from __future__ import annotations

import io
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
from ..json_text import read_json
from ..parameters import join_name
from ..paths import MISSING, is_folder, is_there, why_not_file
from ..problems import BadInput, Problem
from .answer.fitted_scene import RESULT
from .inputs import Inputs
from .job import SavedState
from .old_names import renamed
from .request import RunRequest, read_run
from .staging.request import StageRequest

SCHEMA = 1
SUFFIX = ".unfinished"
INPUTS = "inputs.json"
_LARGEST_STATE = 1 << 30  # bytes
#: What reading a file raises that is not what it should be; an archive packed in a way that zipfile
#: lacks is NotImplementedError.
UNREADABLE = (
    OSError, EOFError, ValueError, KeyError, TypeError, AttributeError, IndexError, OverflowError,
    RecursionError, MemoryError, NotImplementedError, SyntaxError, struct.error,
    tokenize.TokenError, zipfile.BadZipFile, zlib.error,
)  # fmt: skip
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
_WORDS = ("stopped_because", "optimiser")

Parts = Sequence[Mapping[str, Any]]  # native results, one for each stage that has begun


@dataclass(frozen=True)
class Unfinished:
    """A run on disk. parts: native results of the stages that had begun; state: the whole state of
    the newest of them, inputs: what it was given, where these are known."""

    request: RunRequest
    parts: list[dict[str, Any]]
    state: SavedState | None = None
    inputs: Inputs | None = None


class Recorder:
    """Keeps a folder up to date while a job runs. What cannot be written is tried again later: a
    full disk ends no fit. `trouble`: why the newest state is not on disk, "" if it is."""

    def __init__(self, folder: Path, request: RunRequest, inputs: Inputs | None = None) -> None:
        """Makes the folder if there is none."""
        self.folder = folder
        self.trouble = ""
        self._request, self._inputs = request, inputs
        self._begun = False
        self._troubles: list[str] = []
        self._next = self._next_state = 0.0
        self._seen: tuple[int, int] = (0, -1)
        self._state: dict[str, Any] | None = None
        try:
            self._begin()
        except OSError as error:
            self._note(error)

    def notes(self) -> tuple[str, ...]:
        """Sentences for the result: what could not be kept while the fit ran."""
        return tuple(self._troubles)

    @property
    def is_due(self) -> bool:
        """Whether `update` writes: at most every two seconds, less often where that takes long."""
        return time.monotonic() >= self._next

    def update(self, job: Any, *, now: bool = False) -> None:  # noqa: ANN401 - FitJob or StagedJob
        """Writes what `job.parts()` has found, if that is due or `now`."""
        if not now and not self.is_due:
            return
        begin = time.monotonic()
        try:
            if not self._begun:
                self._begin()
            self._update(job)
            self.trouble = ""
        except OSError as error:
            self._note(error)
            self._seen = (0, -1)
            job.request_state()  # the one that was to be written is lost
        took = time.monotonic() - begin
        self._next = time.monotonic() + max(_EVERY, _TIMES * took)

    def finished(self) -> str:
        """The results stand elsewhere: the folder goes. Returns why it does not, "" if it does."""
        try:
            if self.folder.exists():
                shutil.rmtree(self.folder)
        except OSError as error:
            return f"Folder '{self.folder}' is not needed any more, and cannot be removed ({error})"
        return ""

    def _begin(self) -> None:
        self.folder.mkdir(parents=True, exist_ok=True)
        write_json(self.folder / "run.json", self._request.as_json())
        if self._inputs is not None:
            write_json(self.folder / INPUTS, self._inputs.as_json())
        self._begun = True

    def _update(self, job: Any) -> None:  # noqa: ANN401 - FitJob or StagedJob
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

    def _write_state(self, data: bytes, parts: Parts) -> None:
        begin = time.monotonic()
        number = len(parts)
        name = f"optimiser_{number}.state"
        write_bytes(self.folder / name, data)
        self._state = {"file": name, "part": number, "seconds": float(parts[-1]["seconds"])}
        took = time.monotonic() - begin
        self._next_state = time.monotonic() + max(_STATE_EVERY, _TIMES * took)

    def _note(self, error: OSError) -> None:
        why = error.strerror or str(error)
        self.trouble = (
            f"The run is not kept in '{self.folder}' ({why}); the fit goes on, but cannot be "
            "resumed if it is interrupted: make room or set the folder's rights"
        )
        if self.trouble not in self._troubles:
            self._troubles.append(self.trouble)


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
    if not is_folder(folder):
        cause = "it is a file" if is_there(folder) else MISSING
        raise BadInput(Problem(title, cause, "give the folder of a run"))
    if (folder / RESULT).is_file():
        cause, cure = "this run is finished", "nothing is left to resume; start a new one"
        raise BadInput(Problem(title, cause, cure))
    request = read_run(folder / "run.json")
    try:
        inputs = _inputs(folder)
        if not (folder / "state.json").exists():
            return Unfinished(request, [], None, inputs)  # stopped before its first iteration
        state = renamed(read_json(folder / "state.json", _LARGEST_STATE))
        if state.get("schema") != SCHEMA:
            raise ValueError(f"its schema is {state.get('schema')!r}")
        parts = [_part(item) for item in state["parts"]]
        if state["grids"]:
            with (
                _own_file(folder, state["grids"]).open("rb") as file,  # closed if it is no archive
                np.load(file, allow_pickle=False) as grids,
            ):
                for key in grids.files:
                    index, which, name = key.split("|", 2)
                    parts[int(index)][which][name] = grids[key]
        saved = _optimiser(folder, state.get("optimiser"), len(parts))
    except UNREADABLE as error:
        cause = f"its state cannot be read ({error})"
        raise BadInput(Problem(title, cause, "start the run anew with its run.json")) from error
    return Unfinished(request, parts, saved, inputs)


def _inputs(folder: Path) -> Inputs | None:
    """None of a run of an earlier version. Raises ValueError."""
    path = folder / INPUTS
    return Inputs.from_json(read_json(path)) if path.exists() else None


def _own_file(folder: Path, name: object) -> Path:
    """A file that state.json names: one of the folder's own. Raises ValueError."""
    if not isinstance(name, str) or Path(name).name != name:
        raise ValueError(f"it names the file {name!r}")
    if why := why_not_file(folder / name):
        raise ValueError(f"file '{name}': {why}")
    return folder / name


def going_on(run: Unfinished) -> Unfinished:
    """The run as it is to go on: results of the stages that are done, and the state of the next.

    With a state the request stays as it is. Without one, a stage that was interrupted becomes two:
    what was done of it, and what is left; and a run without stages becomes one stage.
    """
    request, parts = run.request, run.parts
    names = tuple(join_name(item.owner, item.parameter) for item in request.unknowns)
    stages = request.stages or (StageRequest("everything", names),)
    parts = [part for part in parts if part["iterations"]]
    if len(parts) > len(stages):
        cause = f"its state has {len(parts)} stages, its run.json {len(stages)}"
        cure = "delete its state.json: the run then begins anew"
        raise BadInput(Problem("Run", cause, cure))
    if not parts:
        return Unfinished(request, [], None, run.inputs)
    last = len(parts) - 1
    stage, part = stages[last], parts[-1]
    wanted = request.settings.iterations if stage.iterations is None else stage.iterations
    done = int(part["iterations"])
    ended = part["stopped_because"] not in ("", "cancelled")
    # At the last iteration its refinement may be left; beyond it run.json asks for less by now.
    if not ended and run.state is not None and done <= wanted:
        return Unfinished(request, parts[:-1], run.state, run.inputs)
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
    return Unfinished(replace(request, stages=stages), parts, None, run.inputs)


def _optimiser(folder: Path, about: Mapping[str, Any] | None, parts: int) -> SavedState | None:
    """The whole state of the newest part; None if there is none of it."""
    if about is None or about["part"] != parts or not (folder / str(about["file"])).exists():
        return None
    path = _own_file(folder, about["file"])
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
    for key, value in scalars.items():
        if isinstance(value, bool) or not isinstance(value, str if key in _WORDS else (int, float)):
            raise ValueError(f"its '{key}' is {value!r}")
    for key in ("search", "report"):
        if not isinstance(item.get(key), (dict, type(None))):
            raise ValueError(f"its '{key}' is {item[key]!r}")
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
