# SPDX-License-Identifier: GPL-3.0-or-later
"""A run that is not finished, on disk: how it goes on.

The folder `<date>_<time>.unfinished` holds run.json (the request), inputs.json (digests of what it
was given) and, now and then, the whole state of the native fit, from which it goes on to the same
bits, with state.json that names it. Each file is replaced as a whole.
"""

from __future__ import annotations

import math
import shutil
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from .. import __version__
from ..atomic_files import PARTIAL, keep, partial_name, write_json
from ..json_text import read_json
from ..messages import thing
from ..paths import MISSING, is_folder, is_there, why_not_file
from ..problems import BadInput, Problem
from .inputs import Inputs
from .job import FitJob, SavedState
from .request import RunRequest, read_run

if TYPE_CHECKING:
    from .._core import WrittenState

SCHEMA = 2
SUFFIX = ".unfinished"
#: Of a folder: what ended runs have, and what unfinished ones are given.
RESULT = "result.json"
INPUTS = "inputs.json"
_STATE = "state.json"
_LARGEST_STATE = 1 << 30  # bytes
#: What reading a file raises that is not what it should be.
UNREADABLE = (
    OSError, EOFError, ValueError, KeyError, TypeError, AttributeError, IndexError, OverflowError,
    RecursionError, MemoryError,
)  # fmt: skip
#: Seconds between two updates, between two whole states, and how often the time that one took fits
#: between it and the next: at most so small a share of a run goes into its record.
_EVERY, _STATE_EVERY, _TIMES = 2.0, 15.0, 30.0


@dataclass(frozen=True)
class Unfinished:
    """A run on disk. state: None before its first; inputs: what it was given, where it is known."""

    request: RunRequest
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
        self._number = 0  # of the newest state
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

    def update(self, job: FitJob, *, now: bool = False) -> None:
        """Writes the state that was asked for, if that is due or `now`, and asks for the next."""
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
            self._ask_for_state(job)  # the one that was to be written is lost
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

    def _update(self, job: FitJob) -> None:
        done = job.progress_or_failure()
        if not done.running:
            self._ask_for_state(job)
        written = job.take_state()
        if written is not None:
            self._keep(written, {"iterations": done.iteration, "seconds": done.seconds})
        if done.running and time.monotonic() >= self._next_state:
            self._ask_for_state(job)

    def _ask_for_state(self, job: FitJob) -> None:
        job.request_state(partial_name(self.folder / _STATE))

    def _keep(self, written: WrittenState, done: Mapping[str, float]) -> None:
        begin = time.monotonic()
        self._number += 1
        name = f"fit_{self._number}.state"
        try:
            keep(written.file, self.folder / name)
        finally:
            written.file.unlink(missing_ok=True)
        about = {"schema": SCHEMA, "selenite": __version__, "file": name, **done}
        write_json(self.folder / _STATE, about)
        for path in (*self.folder.glob("*.state"), *self.folder.glob(PARTIAL)):
            if path.name != name:
                path.unlink()
        took = time.monotonic() - begin + written.seconds
        self._next_state = time.monotonic() + max(_STATE_EVERY, _TIMES * took)

    def _note(self, error: OSError) -> None:
        why = error.strerror or str(error)
        self.trouble = (
            f"The run is not kept in '{self.folder}' ({why}); the fit goes on, but cannot be "
            "resumed if it is interrupted: make room or set the folder's rights"
        )
        if self.trouble not in self._troubles:
            self._troubles.append(self.trouble)


def load(folder: Path) -> Unfinished:
    """What was asked for, and how far it has come. Raises BadInput."""
    title = thing("Folder", folder)
    if not is_folder(folder):
        cause = "it is a file" if is_there(folder) else MISSING
        raise BadInput(Problem(title, cause, "give the folder of a run"))
    if (folder / RESULT).is_file():
        cause, cure = "this run is finished", "nothing is left to resume; start a new one"
        raise BadInput(Problem(title, cause, cure))
    request = read_run(folder / "run.json")
    try:
        inputs = _inputs(folder)
        if not (folder / _STATE).exists():
            return Unfinished(request, None, inputs)  # stopped before its first state
        state = _state(folder)
    except UNREADABLE as error:
        cause = f"its state cannot be read ({error})"
        raise BadInput(Problem(title, cause, "start the run anew with its run.json")) from error
    return Unfinished(request, state, inputs)


def _inputs(folder: Path) -> Inputs | None:
    """None of a run of an earlier version. Raises ValueError."""
    path = folder / INPUTS
    return Inputs.from_json(read_json(path)) if path.exists() else None


def _state(folder: Path) -> SavedState:
    """Raises ValueError."""
    about = read_json(folder / _STATE, _LARGEST_STATE)
    if not isinstance(about, dict):
        raise ValueError("it holds no object")
    if about.get("schema") != SCHEMA:
        raise ValueError(f"its schema is {about.get('schema')!r}, of another version")
    path, seconds = _own_file(folder, about["file"]), about["seconds"]
    if not isinstance(seconds, (int, float)) or not 0 <= seconds < math.inf:
        raise ValueError(f"its 'seconds' is {seconds!r}")
    return SavedState(path, float(seconds))


def _own_file(folder: Path, name: object) -> Path:
    """A file that state.json names: one of the folder's own. Raises ValueError."""
    if not isinstance(name, str) or Path(name).name != name:
        raise ValueError(f"it names the file {name!r}")
    if why := why_not_file(folder / name):
        raise ValueError(f"file '{name}': {why}")
    return folder / name
