# SPDX-License-Identifier: GPL-3.0-or-later
"""A running fit: a native thread that touches only its own copies, polled from here."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .. import native
from ..capture.views import View
from ..messages import thing
from ..parameters import Values
from ..problems import BadInput, Failed, Problem, refused
from . import trust
from .diagnosis.course import Limits, diagnose, shortened, still_falling
from .plan import FitPlan
from .staging import plan as stage_plan

if TYPE_CHECKING:
    from .._core import Fit, FitResult, History, Progress, Scene, WrittenState
    from .cluster.workers import ClusterWorkers

_DIAGNOSE_EVERY = 1.0  # seconds between two diagnoses of a running fit
#: Pixels of all photos up to which a diagnosis is made by who polls: some 20 ms. Above it has a
#: thread, or whoever draws an interface would wait for it.
_PIXELS_AT_ONCE = 150_000
#: Of a fit that fails for a reason without one.
_CURE = "change the photos or the settings"
#: Phases of a fit that are asked for by name; the native module has more.
MULTI_START, DESCENT = "multi-start", "descent"


class FitFailed(Failed):
    """The native fit stopped: why, as of BadInput."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = list(problems)
        super().__init__("\n".join(problem.line() for problem in self.problems))


@dataclass(frozen=True)
class SavedState:
    """The whole state of a native fit: where it is, and the seconds it had taken."""

    file: Path
    seconds: float


class FitJob:
    """Start, poll, cancel, join, result. The caller joins before it drops the job."""

    def __init__(
        self,
        plan: FitPlan,
        state: SavedState | None = None,
        *,
        workers: ClusterWorkers | None = None,
    ) -> None:
        """Validates natively, every stage too, and starts nothing. Raises BadInput.

        `state`: of a fit with this plan, which goes on as that one would have done. `workers`: who
        renders in place of this process.
        """
        self.plan = plan
        self._notes: tuple[str, ...] = ()
        self._next_diagnosis = 0.0  # by the clock
        self._diagnosing: threading.Thread | None = None
        with refused("Fit", "change the settings or the bounds"):
            self._fit = _native_fit(plan, workers)
        if state is not None:
            self._restore(state)

    def _restore(self, state: SavedState) -> None:
        try:
            self._fit.restore(state.file, state.seconds)
        except (ValueError, OSError) as error:
            cure = "delete its folder, and start the run anew with its run.json"
            raise BadInput(Problem(thing("File", state.file), _text(error), cure)) from error

    def start(self) -> None:
        """Returns at once; the native thread works without the GIL."""
        self._fit.start()

    def progress(self) -> Progress:
        """Cheap, at any time. Raises FitFailed when the thread met an error."""
        state = self._fit.progress()
        if state.problems:
            raise FitFailed(
                Problem(said.object, said.cause, said.cure or _CURE) for said in state.problems
            )
        if state.running and time.monotonic() >= self._next_diagnosis:
            self._diagnose()
            self._next_diagnosis = time.monotonic() + _DIAGNOSE_EVERY
        return state

    def progress_or_failure(self) -> Progress:
        """The same of a fit that has failed too."""
        return self._fit.progress()

    def stage_title(self, progress: Progress) -> str:
        """ "2 of 3: name"; "" in a fit without stages."""
        if not self.plan.stages:
            return ""
        name = self.plan.stages[progress.stage].request.name
        return f"{progress.stage + 1} of {len(self.plan.stages)}: {name}"

    @property
    def newest_notes(self) -> tuple[str, ...]:
        """`notes` of a running fit, as they were when its progress was asked for."""
        return self._notes

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
        state = self._fit.progress()
        index = state.stage
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
        fit = self._fit.result(fields=False)
        return diagnose(
            self._fit.history(of_stage=True), limits, views, from_start=index == 0,
            sure=trust.sure(fit), running=state.running,
            transmits=plan.transmits, explained=trust.explained(fit), opaque=plan.opaque,
            azimuths=plan.azimuths,
        )  # fmt: skip

    def request_state(self, file: Path) -> None:
        """Asks for the whole state in a file: after the iteration that runs, or at once of a fit
        that has ended."""
        self._fit.request_state(file)

    def take_state(self) -> WrittenState | None:
        """The newest state that has been written since the last call. Raises OSError: it cannot be
        written."""
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
        return self.so_far().fields_last.get(name)

    def result(self) -> FitResult:
        """After the end. Raises FitFailed."""
        self.progress()
        return self.so_far()

    def closing_notes(self, fit: FitResult) -> tuple[str, ...]:
        """After the end, of its result: what a user should know."""
        return (*self.notes(), *still_falling(fit), *shortened(fit))


def _native_fit(plan: FitPlan, workers: ClusterWorkers | None) -> Fit:
    """Raises ValueError, KeyError."""
    photos = [capture.native() for capture in plan.captures]
    unknowns = [item.native() for item in plan.unknowns]
    unknowns += [item.native() for item in plan.fields]
    if plan.stages:
        stages = [stage.native() for stage in plan.stages]
        return native.core().Fit(unknowns, stages=stages, workers=workers)
    settings = plan.request.settings.native()
    return native.core().Fit(plan.scene, photos, unknowns, settings, workers=workers)


def fitted_values(plan: FitPlan, fit: FitResult) -> dict[tuple[str, str], Values]:
    """(owner, parameter) -> value at the best iteration."""
    return {
        (item.owner, item.parameter.name): tuple(fit.values_best[item.name])
        for item in plan.unknowns
    }


def scene_at(
    plan: FitPlan, fit: FitResult, fields: Mapping[str, np.ndarray] | None = None
) -> Scene:
    """The plan's scene with the best values. fields: in place of those of the fit."""
    fields = fit.fields_best if fields is None else fields
    values = {name: tuple(value) for name, value in fit.values_best.items()}
    scene = plan.scene.with_values(stage_plan.constants(values, plan.unknowns, plan.fields))
    for item in plan.fields:
        scene = item.placed(scene, fields[item.name])
    return scene


def _text(error: Exception) -> str:
    if isinstance(error, OSError):
        return error.strerror or str(error)
    return str(error.args[0]) if error.args else str(error)
