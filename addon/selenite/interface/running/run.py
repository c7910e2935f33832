# SPDX-License-Identifier: GPL-3.0-or-later
"""A run as phases: the scene is read, the photos are read, the native fit runs, its end follows.

Kept in Python, not in the .blend, and without pointers into it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ...advice.information.job import BackgroundJob, Work
from ...fit.job import FitJob
from ...fit.overall import Overall, Shown
from ...fit.plan import FitPlan
from ...scene_read.reading.job import ReadingJob
from ...scene_read.values import Owner
from ..texts import translated
from .outcome import Outcome
from .recorder import BackgroundRecorder, Closing
from .work import Finishing, Preparing

if TYPE_CHECKING:
    from ..._core import Progress

#: What the panel says of a run that leaves nothing behind.
CANCELLED = "Cancelled; nothing was changed"
#: What it says of a reading that was cancelled while Blender evaluates the scene.
ENDING = "Cancelled; waiting for Blender"


class Phase(ABC):
    """What of a run goes on. fraction: of the whole run, 0 to 1."""

    fraction = 0.0

    def __init__(self, scene_name: str) -> None:
        self.scene_name = scene_name

    @property
    @abstractmethod
    def title(self) -> str:
        """For the head of the panel, translated."""

    @property
    @abstractmethod
    def status(self) -> str:
        """For the status bar."""

    @abstractmethod
    def cancel(self, *, keep: bool) -> None:
        """Returns at once; a later tick sees the end. keep: what was found so far."""

    @abstractmethod
    def end(self) -> None:
        """Blender ends, or opens another file: waits for threads that would outlive it."""


class ReadingPhase(Phase):
    """Blender's thread evaluates the scene, ours reads it."""

    def __init__(self, job: ReadingJob[Preparing], scene_name: str) -> None:
        super().__init__(scene_name)
        self.job = job

    @property
    def title(self) -> str:
        """One of two sentences."""
        return translated(ENDING if self.job.is_stopped else "Reading the scene")

    @property
    def status(self) -> str:
        """What Blender says of its render."""
        return self.job.text() or "reading the scene"

    def cancel(self, *, keep: bool) -> None:
        """The reading ends at the next object."""
        self.job.cancel()

    def end(self) -> None:
        """A timer of Blender's closes what is open."""
        self.job.abandon()


class PreparingPhase(Phase):
    """A thread reads the photos and builds the native scene. See `Run.ask_to_stop`."""

    def __init__(self, job: BackgroundJob[Preparing], scene_name: str) -> None:
        """Starts the thread."""
        super().__init__(scene_name)
        self.job = job
        job.start()

    @property
    def title(self) -> str:
        """The same all the time."""
        return translated("Reading the photos")

    @property
    def status(self) -> str:
        """The step of the thread."""
        return self.job.progress()[1].text

    def cancel(self, *, keep: bool) -> None:
        """Heard at the next photo."""
        self.job.cancel()

    def end(self) -> None:
        """The thread is among what the run has left, which is waited for at the end."""


class FittingPhase(Phase):
    """The native thread. `progress` and `shown` are as of the last tick. keep: whether its result
    is wanted. recorder: of the run on disk."""

    def __init__(
        self, job: FitJob, scene_name: str, owners: dict[str, Owner], overall: Overall | None = None
    ) -> None:
        """Starts the thread. owners: of the scene as it was read. overall: of the job, where it was
        made already."""
        super().__init__(scene_name)
        self.job, self.plan, self.owners = job, job.plan, owners
        self.overall, self.shown = overall or Overall(job.plan), Shown()
        self.progress: Progress | None = None
        self.recorder: BackgroundRecorder | None = None
        self.keep = True
        job.start()

    @property
    def fraction(self) -> float:  # type: ignore[override] # a constant of the phases before
        """Over all stages."""
        return self.shown.fraction

    @property
    def title(self) -> str:
        """Percent, phase and time left."""
        return self.shown.text

    @property
    def status(self) -> str:
        """As in the head."""
        return self.shown.text

    def update(self) -> Progress:
        """The newest progress. Raises FitFailed."""
        self.progress = self.job.progress()
        self.shown = self.overall.update(self.progress)
        return self.progress

    def record(self) -> str:
        """Keeps the run on disk; returns why that has failed since the last time, "" if it has
        not."""
        return self.recorder.update(self.job) if self.recorder is not None else ""

    def cancel(self, *, keep: bool) -> None:
        """The thread ends within a tile."""
        self.keep = keep
        self.job.cancel()

    def end(self) -> None:
        """What is on disk stays: Blender ends, not by the user's wish."""
        self.job.join()
        if self.recorder is not None:
            self.recorder.wait()


class FinishingPhase(Phase):
    """After the native fit, a thread looks for wrong lights, fills images and writes fields."""

    def __init__(self, fit: FittingPhase, job: BackgroundJob[Finishing]) -> None:
        """Starts the thread. fit: at its end."""
        super().__init__(fit.scene_name)
        self.fit, self.job = fit, job
        job.start()

    @property
    def fraction(self) -> float:  # type: ignore[override] # a constant of the first phases
        """The last part of the whole."""
        return self.fit.shown.fraction

    @property
    def title(self) -> str:
        """Percent and phase."""
        return self.fit.shown.text

    @property
    def status(self) -> str:
        """As in the head."""
        return self.fit.shown.text

    def update(self) -> bool:
        """Whether the thread still works."""
        self.fit.shown = self.fit.overall.finishing(self.job.work.step.fraction)
        return self.job.progress()[0]

    def cancel(self, *, keep: bool) -> None:
        """What is left of the work is left out."""
        self.fit.keep = keep
        self.job.cancel()

    def end(self) -> None:
        """It closes the record of the run too."""
        self.job.join()


@dataclass
class Run:
    """At most one run at a time. `last` is the outcome of the newest one that was kept; a run that
    is cancelled or fails leaves it as it was."""

    phase: Phase | None = None
    last: Outcome | None = None
    message: str = ""
    left: list[BackgroundJob[Work]] = field(default_factory=list)  # not waited for, not yet ended

    @property
    def is_active(self) -> bool:
        """Whether anything of a run goes on."""
        return self.phase is not None

    @property
    def fitting(self) -> FittingPhase | None:
        """The native fit, while it runs and until its result is there."""
        phase = self.phase
        if isinstance(phase, FinishingPhase):
            return phase.fit
        return phase if isinstance(phase, FittingPhase) else None

    @property
    def done(self) -> Outcome | None:
        """The last outcome, unless another fit is about to take its place."""
        return self.last if self.fitting is None else None

    @property
    def plan(self) -> FitPlan | None:
        """Of the fit that runs, else of the last outcome."""
        shown = self.fitting or self.last
        return shown.plan if shown is not None else None

    def outcome_of(self, scene_name: str) -> Outcome | None:
        """`done`, if it is of this scene."""
        done = self.done
        return done if done is not None and done.scene_name == scene_name else None

    def begin(self, phase: Phase) -> None:
        """The first phase."""
        self.phase, self.message = phase, ""

    def ask_to_stop(self, *, keep: bool) -> None:
        """Returns at once; the modal operator sees the end at its next tick. Nobody waits for the
        photos: the thread that reads them ends by itself."""
        phase = self.phase
        if phase is None:
            return
        phase.cancel(keep=keep)
        if isinstance(phase, PreparingPhase):
            self._leave(phase.job)
            self.over(CANCELLED)

    def over(self, message: str) -> None:
        """Ends without an outcome: nothing is left to resume."""
        fitting = self.fitting
        self.phase, self.message = None, message
        if fitting is not None:
            self.close(fitting.recorder)

    def forget(self) -> None:
        """The native fit has ended, and its outcome is not wanted."""
        phase, fitting = self.phase, self.fitting
        if fitting is not None:
            fitting.job.join()
        if isinstance(phase, FinishingPhase):
            phase.job.cancel()
            self._leave(phase.job)
        self.over(CANCELLED)

    def keep(self, outcome: Outcome, message: str) -> None:
        """The end of a run as it should be."""
        self.phase, self.last, self.message = None, outcome, message

    def close(self, recorder: BackgroundRecorder | None) -> None:
        """Nothing is left to resume; a thread clears it away."""
        if recorder is not None:
            job = BackgroundJob(Closing(recorder))
            job.start()
            self._leave(job)

    def stop(self) -> None:
        """Blender ends, or opens another file. What is in `left` goes on: see `state.end`."""
        self.ask_to_stop(keep=False)
        if self.phase is not None:
            self.phase.end()
        self.phase = None

    def _leave(self, job: BackgroundJob[Work]) -> None:
        self.left = [item for item in self.left if item.progress()[0]] + [job]
