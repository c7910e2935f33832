# SPDX-License-Identifier: GPL-3.0-or-later
"""A running fit: a native thread that touches only its own copies, polled from here."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .. import native
from ..capture.views import View
from ..problems import BadInput, Failed, Problem, problems_of
from . import trust
from .diagnosis.course import Limits, diagnose, still_falling
from .fields import VerticesUnknown
from .plan import FitPlan
from .staging import plan as stage_plan

if TYPE_CHECKING:
    from .._core import Fit, FitResult, History, Scene, ShapeFit, StopReason

_DIAGNOSE_EVERY = 1.0  # seconds between two diagnoses of a running fit
#: Pixels of all photos up to which a diagnosis is made by who polls: some 20 ms. Above it has a
#: thread, or whoever draws an interface would wait for it.
_PIXELS_AT_ONCE = 150_000
#: Phases of a fit that are asked for by name; the native module has more.
MULTI_START, DESCENT = "multi-start", "descent"


class FitFailed(Failed):
    """The native fit stopped with an error."""


@dataclass(frozen=True)
class Progress:
    """State of a fit at one moment. `seconds_left` is NaN while unknown; `stage` is "" in a fit
    without stages; `notes` are the sentences of `diagnosis`."""

    running: bool
    iteration: int
    iterations: int
    loss: float
    seconds: float
    seconds_left: float
    stopped: StopReason
    stopped_because: str
    values: dict[str, list[float]]
    phase: str = DESCENT
    phase_fraction: float = 0.0
    stage: str = ""
    notes: tuple[str, ...] = ()
    stage_index: int = 0
    own_iteration: int = 0  # of the stage

    @property
    def fraction(self) -> float:
        """Between 0 and 1, of the phase."""
        if self.phase != DESCENT:
            return min(1.0, self.phase_fraction)
        return min(1.0, self.iteration / self.iterations) if self.iterations else 0.0


@dataclass(frozen=True)
class Done:
    """iterations: of all stages."""

    running: bool
    iterations: int
    seconds: float


@dataclass(frozen=True)
class SavedState:
    """The whole state of a native fit: file name, content, and the seconds it had taken."""

    name: str
    data: bytes
    seconds: float


class FitJob:
    """Start, poll, cancel, join, result. The caller joins before it drops the job."""

    def __init__(
        self, plan: FitPlan, state: SavedState | None = None, *, refined: bool = True
    ) -> None:
        """Validates natively, every stage too, and starts nothing. Raises BadInput.

        `state`: of a fit with this plan, which goes on as that one would have done. `refined`:
        False where the values need no intervals.
        """
        self.plan = plan
        self._notes: tuple[str, ...] = ()
        self._next_diagnosis = 0.0  # by the clock
        self._diagnosing: threading.Thread | None = None
        try:
            self._fit = _native_fit(plan, refined=refined)
        except (ValueError, KeyError) as error:
            cure = "change the settings or the bounds"
            raise BadInput(problems_of(error, "Fit", cure)) from error
        if state is not None:
            self._restore(state)

    def _restore(self, state: SavedState) -> None:
        try:
            self._fit.restore(state.data, state.seconds)
        except ValueError as error:
            cure = "delete its folder, and start the run anew with its run.json"
            raise BadInput(Problem(f"File '{state.name}'", _text(error), cure)) from error

    def start(self) -> None:
        """Returns at once; the native thread works without the GIL."""
        self._fit.start()

    def progress(self) -> Progress:
        """Cheap, at any time. Raises FitFailed when the thread met an error."""
        state = self._fit.state()
        if state["error"]:
            raise FitFailed(_in_words(state["error"]))
        if state["running"] and time.monotonic() >= self._next_diagnosis:
            self._diagnose()
            self._next_diagnosis = time.monotonic() + _DIAGNOSE_EVERY
        stage = ""
        if self.plan.stages:
            name = self.plan.stages[state["stage"]].request.name
            stage = f"{state['stage'] + 1} of {len(self.plan.stages)}: {name}"
        return Progress(
            running=state["running"],
            iteration=state["iteration"],
            own_iteration=state["own_iteration"],
            stage=stage,
            stage_index=state["stage"],
            stopped=state["stopped"],
            iterations=state["iterations"],
            loss=state["loss"],
            seconds=state["seconds"],
            seconds_left=state["seconds_left"],
            stopped_because=state["stopped_because"],
            phase=state["phase"],
            phase_fraction=state["phase_fraction"],
            values={name: [float(x) for x in value] for name, value in state["values"].items()},
            notes=self._notes,
        )

    def _diagnose(self) -> None:
        """Renews the notes, now or soon."""
        if sum(item.weight.size for item in self.plan.captures) <= _PIXELS_AT_ONCE:
            self._keep_notes()
        elif self._diagnosing is None or not self._diagnosing.is_alive():
            self._diagnosing = threading.Thread(target=self._keep_notes, daemon=True)
            self._diagnosing.start()

    def _keep_notes(self) -> None:
        self._notes = self.notes()

    def preview(self, index: int) -> np.ndarray | None:
        """Newest picture of a photo, (h, w, 3)."""
        return self._fit.preview(index)

    def cancel(self) -> None:
        """Asks the thread to stop; it does within a tile."""
        self._fit.cancel()

    def join(self) -> None:
        """Waits for the thread; the GIL is released meanwhile."""
        self._fit.join()
        if self._diagnosing is not None:
            self._diagnosing.join()

    def notes(self) -> tuple[str, ...]:
        """What is wrong now, in sentences: see `diagnosis`. Takes some milliseconds."""
        plan = self.plan
        captures, fitted = plan.captures, {item.name for item in plan.unknowns}
        index = self._fit.state()["stage"]
        if plan.stages:
            captures = plan.stages[index].captures
            fitted &= set(plan.stages[index].request.parameters)
        views = []
        for number, capture in enumerate(captures):
            picture = self._fit.preview(number)
            if picture is not None and picture.shape == capture.reference.shape:
                views.append(View(capture.id, capture.reference, capture.weight, picture))
        limits = [
            Limits(item.name, item.minimum, item.maximum, item.by_ratio, item.range_ends)
            for item in plan.unknowns
            if item.name in fitted
        ]
        result = self.so_far()
        return diagnose(
            self._fit.history(of_stage=True), limits, views, from_start=index == 0,
            sure=trust.sure(result), running=self._fit.state()["running"],
            transmits=plan.transmits, explained=trust.explained(result), opaque=plan.opaque,
            azimuths=plan.azimuths,
        )  # fmt: skip

    def done(self) -> Done:
        """How far it has come; of a fit that has failed too."""
        state = self._fit.state()
        return Done(state["running"], state["iteration"], state["seconds"])

    def request_state(self) -> None:
        """Asks for the whole state after the iteration that runs, or of a fit that has ended."""
        self._fit.request_state()

    def take_state(self) -> bytes | None:
        """The state that was asked for, once it is there; it is handed out once."""
        return self._fit.take_state()

    def so_far(self) -> FitResult:
        """The native result as it stands, at any time; a copy, so not for every tick."""
        return self._fit.result()

    def history(self) -> History:
        """That of `so_far` alone, without a copy of the fields: for plots of a running fit."""
        return self._fit.history()

    def field(self, name: str) -> np.ndarray | None:
        """The newest values of a field, None where there is none of that name; as costly as
        `so_far`."""
        found: np.ndarray | None = self.so_far()["fields_last"].get(name)
        return found

    def result(self) -> FitResult:
        """After the end: the native result, and the key `notes`. Raises FitFailed."""
        self.progress()
        found = self.so_far()
        return found | {"notes": (*self.notes(), *still_falling(found))}


def _native_fit(plan: FitPlan, *, refined: bool) -> Fit | ShapeFit:
    """Raises ValueError, KeyError."""
    photos = [capture.native() for capture in plan.captures]
    for item in plan.fields:
        if isinstance(item, VerticesUnknown):
            return item.fit(plan.scene, photos, plan.request.settings)
    unknowns = [item.native() for item in plan.unknowns]
    unknowns += [item.native() for item in plan.fields]
    if plan.stages:
        return native.core().Fit(unknowns, stages=[stage.native() for stage in plan.stages])
    settings = plan.request.settings.native()
    settings |= {} if refined else {"refinement": "off"}
    return native.core().Fit(plan.scene, photos, unknowns, settings)


def fitted_values(
    plan: FitPlan, result: FitResult, *, best: bool = True
) -> dict[tuple[str, str], tuple[float, ...]]:
    """(owner, parameter) -> value at the best or the last iteration."""
    values = result["values_best" if best else "values_last"]
    return {
        (item.owner, item.parameter.name): tuple(float(x) for x in np.ravel(values[item.name]))
        for item in plan.unknowns
    }


def scene_at(plan: FitPlan, result: FitResult) -> Scene:
    """The plan's scene with the best values."""
    values = {name: tuple(map(float, np.ravel(v))) for name, v in result["values_best"].items()}
    scene = plan.scene.with_values(stage_plan.constants(values, plan.unknowns, plan.fields))
    for item in plan.fields:
        scene = item.placed(scene, result["fields_best"][item.name])
    return scene


def _in_words(error: str) -> str:
    if "bad_alloc" in error:
        return (
            "the computer's memory does not suffice; lower the height or fit fewer photos at once"
        )
    return error


def _text(error: Exception) -> str:
    return str(error.args[0]) if error.args else str(error)
