# SPDX-License-Identifier: GPL-3.0-or-later
"""What comes before and after a native fit, as work for a thread: nothing of it needs Blender."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from ...advice.information.job import Step
from ...fit.checkpoint import Unfinished
from ...fit.inputs import Inputs, changes, inputs_of
from ...fit.job import FitJob
from ...fit.overall import Overall
from ...fit.plan import FitPlan, prepare
from ...messages import message
from ...problems import BadInput
from ...report.finished_fit import FinishedFit
from ...report.light_pairing import with_warnings
from ...report.results import finished, write_results
from ...scene_read.geometry.bodies import judge_bodies
from ...scene_read.values import SceneValues
from .outcome import Outcome
from .recorder import BackgroundRecorder


class _Cancelled(Exception):
    """Leaves a function that has no other way to end early."""


class Preparing:
    """Surveys bodies (of values read without), reads the photos, builds the native scene and
    validates the fit. Afterwards `plan`, `inputs`, `job` and `overall` are there. `steps` raises
    BadInput."""

    def __init__(
        self,
        values: SceneValues,
        run: Unfinished,
        packed: Mapping[str, bytes],
        file: str,
        resumed: Path | None = None,
    ) -> None:
        """file: of the scene, for messages. resumed: folder of the unfinished run that goes on."""
        self.values, self.resumed = values, resumed
        self._run, self._packed, self._file = run, packed, file
        self._stop = threading.Event()
        self.plan: FitPlan | None = None
        self.inputs: Inputs | None = None
        self.job: FitJob | None = None
        self.overall: Overall | None = None

    def steps(self) -> Iterator[Step]:
        """A few; whoever cancels is heard after each, and after each photo."""
        yield Step(0.0, "surveying bodies")
        self.values.bodies = judge_bodies(self.values)
        yield Step(0.1, "reading the photos")
        try:
            self.plan = prepare(self.values, self._run.request, self._packed, go_on=self._go_on)
        except _Cancelled:
            return
        yield Step(0.6, "comparing with the run before")
        now = inputs_of(self.values, self.plan.request, self._packed)
        before = self._run.inputs
        if before is not None:
            changed = changes(before, now, self._file)
            if changed:
                raise BadInput(changed)
        self.inputs = before or now
        yield Step(0.8, "preparing the fit")
        self.job = FitJob(self.plan, self._run.state)
        self.overall = Overall(self.plan)

    def cancel(self) -> None:
        """The photo that is read, or the scene that is built, is the last."""
        self._stop.set()

    def _go_on(self) -> None:
        if self._stop.is_set():
            raise _Cancelled


class Survey:
    """Whether the bodies of values that were read without are closed; then it is in the values."""

    def __init__(self, values: SceneValues) -> None:
        self._values = values

    def steps(self) -> Iterator[Step]:
        """One."""
        yield Step(0.0, "surveying bodies")
        self._values.bodies = judge_bodies(self._values)

    def cancel(self) -> None:
        """The survey goes on to its end."""


class _Writing:
    """Base of what may leave a result folder: afterwards `folder` is there if it was written, and
    `trouble` says why it could not be. `step`: how far it has come, from any thread."""

    def __init__(self, plan: FitPlan, parent: Path, host: str, text: str) -> None:
        """parent: of the result folder. host: version of Blender. text: of the first step."""
        self.folder: Path | None = None
        self.trouble = ""
        self.step = Step(0.0, text)
        self._plan, self._parent, self._host = plan, parent, host
        self._stop = threading.Event()

    def cancel(self) -> None:
        """Ends after the picture that is rendered now; no folder is left."""
        self._stop.set()

    def _note(self, text: str, fraction: float) -> None:
        self.step = Step(fraction, text)
        if self._stop.is_set():
            raise _Cancelled


class Finishing(_Writing):
    """After a fit: `result` is its own with its remarks, warnings and the texels that no photo
    sees; fitted fields go into `folder`. `troubles`: what went wrong with the record.
    `open_record`: it, where the disk is still busy with it: who presses Esc need not wait."""

    def __init__(
        self, job: FitJob, parent: Path, host: str, recorder: BackgroundRecorder | None
    ) -> None:
        """job: at its end. recorder: of the run, which is closed at the end unless it writes."""
        super().__init__(job.plan, parent, host, "comparing lights")
        self.result: FinishedFit | None = None
        self.troubles: tuple[str, ...] = ()
        self.open_record: BackgroundRecorder | None = None
        self._job, self._recorder = job, recorder

    def steps(self) -> Iterator[Step]:
        """One for each part; the result is there before the first."""
        try:
            yield from self._parts()
        finally:
            if self._recorder is not None and self._recorder.is_writing:
                self.troubles, self.open_record = self._recorder.notes, self._recorder
            elif self._recorder is not None:
                self.troubles = self._recorder.close()

    def _parts(self) -> Iterator[Step]:
        fit = self._job.result()
        self.result = FinishedFit(fit, self._job.closing_notes(fit))
        yield self.step
        try:
            self.result = with_warnings(self._plan, self.result, self._part(0.0))
            yield Step(0.4, "finishing images")
            self.result = finished(self._plan, self.result, self._part(0.4))
        except _Cancelled:
            return
        yield Step(0.8, "writing fields")
        if self._plan.fields:
            try:
                self.folder = write_results(
                    self._plan, self.result, self._parent, self._host, pictures=False
                )
            except OSError as error:
                self.trouble = str(error)

    def _part(self, begin: float) -> Callable[[str, float], None]:
        return lambda text, fraction: self._note(text, begin + 0.4 * fraction)


class Saving(_Writing):
    """Writes a result folder with its pictures."""

    def __init__(self, outcome: Outcome, parent: Path, host: str) -> None:
        super().__init__(outcome.plan, parent, host, "writing the result")
        self.outcome = outcome

    def steps(self) -> Iterator[Step]:
        """One: it notes its progress itself."""
        yield self.step
        try:
            self.folder = write_results(
                self._plan, self.outcome.result, self._parent, self._host, self._note
            )
        except _Cancelled:
            return
        except OSError as error:
            cure = "choose another folder"
            self.trouble = message(
                "work.cannot-write",
                "Cannot write to '{parent}': {error}; {cure}",
                parent=self._parent,
                error=error,
                cure=cure,
            )
