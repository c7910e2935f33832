# SPDX-License-Identifier: GPL-3.0-or-later
"""Start. A fit changes nothing in the scene until Apply."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import bpy
from bpy.props import StringProperty

from ...advice.information.job import BackgroundJob
from ...capture.scene_captures import packed_photos
from ...cycles_check.render_settings import contents_of
from ...fit.checkpoint import SUFFIX, Unfinished, load
from ...fit.inputs import Inputs
from ...fit.job import FitFailed
from ...fit.request import RunRequest
from ...messages import message, phrase
from ...problems import BadInput
from ...report.results import new_folder
from ...scene_read.geometry.bodies import judge_bodies
from ...scene_read.lamps.frames import reading_frames
from ...scene_read.reading.job import ReadingJob
from ...scene_read.reading.render_depsgraph import Reading, Stopped, at_once
from ...scene_read.scene import reading
from ...scene_read.values import SceneValues
from .. import environment_panel
from ..output_folder import output_folder
from ..pictures.operators import open_at_start
from ..pictures.view import VIEW
from ..problem_reports import report_problems
from ..progress.notice import notify, scroll_up
from ..request import run_request
from ..result.kept import keep_fields, keep_result
from ..running.outcome import Outcome
from ..running.recorder import BackgroundRecorder
from ..running.run import (
    CANCELLED,
    FinishingPhase,
    FittingPhase,
    PreparingPhase,
    ReadingPhase,
)
from ..running.work import Finishing, Preparing
from ..state import CHECK, PROBLEMS, RUN, remember, remember_plan
from ..texts import announce, translated
from ..ticking import HARMLESS, Ticking, built, redraw, show_status

#: Name of a StopReason -> what the head says of a fit that has ended well.
ENDS = {
    "CONVERGED": "Done",
    "ITERATIONS": "Done",
    "TOLERANCE": "Done",
    "CANCELLED": "Stopped; the best values so far are kept",
}
#: Seconds that a tick waits for the work after a fit, which mostly is nothing.
_SHORT = 0.05


class SELENITE_OT_start(Ticking, bpy.types.Operator):
    """Fit the ticked parameters to the photos. Esc stops and keeps the best values so far"""

    bl_idname = "selenite.start"
    bl_label = "Start Fit"
    bl_options = {"UNDO"}
    tick = 0.05  # Esc is answered within .3 s, with what a tile takes

    resume: StringProperty(
        subtype="DIR_PATH",
        options={"HIDDEN", "SKIP_SAVE"},
        description="An unfinished run's folder",
    )

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Blender's thread reads the scene, ours the photos, the native one fits; a timer polls."""
        scroll_up()
        scene = context.scene
        RUN.begin(ReadingPhase(ReadingJob(_asking(scene, self.resume)), scene.name))
        answer = self._tick(context)
        return self._add_timer(context) if RUN.phase is not None else answer

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Without a window: runs to the end."""
        return self._finish(context) if self._start(context, self.resume) else {"CANCELLED"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Everything but Esc passes through, so that Blender stays usable; while the scene is
        read, the pointer alone: what could change it waits."""
        if event.type == "ESC" and event.value == "PRESS" and RUN.phase is not None:
            RUN.ask_to_stop(keep=True)
            return {"RUNNING_MODAL"} if RUN.phase is not None else self._over(context)
        if event.type == "TIMER":
            return self._tick(context)
        reads = isinstance(RUN.phase, ReadingPhase) and event.type not in HARMLESS
        return {"RUNNING_MODAL"} if reads else {"PASS_THROUGH"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender quits or loads another file: the threads must end first."""
        RUN.stop()
        self._remove_timer(context)

    def _tick(self, context: bpy.types.Context) -> set[str]:
        """Goes on with the phase, then to the next one."""
        phase, goes_on = RUN.phase, True
        if isinstance(phase, ReadingPhase):
            self._read(phase)
        elif isinstance(phase, PreparingPhase):
            self._prepare(phase)
        elif isinstance(phase, FittingPhase):
            goes_on = self._fit(phase)
        elif isinstance(phase, FinishingPhase):
            goes_on = phase.update()
        if not goes_on:
            return self._finish(context)
        if RUN.phase is None:  # or stopped from elsewhere
            return self._over(context)
        show_status(context, RUN.phase.status, RUN.phase.fraction)
        return {"PASS_THROUGH"}

    def _read(self, phase: ReadingPhase) -> None:
        try:
            goes_on = built(self, phase.job.step)
        except Stopped:
            RUN.over(CANCELLED)
            return
        if goes_on is None:
            RUN.over("")
        elif not goes_on:
            RUN.phase = PreparingPhase(BackgroundJob(phase.job.value), phase.scene_name)

    def _prepare(self, phase: PreparingPhase) -> None:
        if phase.job.progress()[0]:
            return
        ready = built(self, phase.job.join)
        remember(phase.scene_name, phase.job.work.values)
        if ready:
            self._begin(phase.job.work, phase.scene_name)
        else:
            RUN.over("")

    def _start(self, context: bpy.types.Context, resume: str = "") -> bool:
        """All that comes before the fit, at once."""
        name = context.scene.name
        RUN.message = ""
        work = built(self, lambda: at_once(_asking(context.scene, resume)))
        if work is None:
            return False
        ready = built(self, lambda: list(work.steps())) is not None
        remember(name, work.values)
        if ready:
            self._begin(work, name)
        return ready

    def _begin(self, work: Preparing, scene_name: str) -> None:
        """Starts the native thread and the record on disk."""
        scene: bpy.types.Scene | None = bpy.data.scenes.get(scene_name)
        job = work.job
        if scene is None or job is None or work.inputs is None:
            RUN.over(CANCELLED)
            return
        remember_plan(scene.name, job.plan)
        for text in job.plan.warnings:
            announce(self, {"WARNING"}, text)
        CHECK.contents[scene.name] = contents_of(scene)
        CHECK.forget()
        fitting = FittingPhase(job, scene.name, work.values.owners, work.overall)
        RUN.begin(fitting)
        VIEW.begin()
        open_at_start()
        environment_panel.begin()
        fitting.recorder = _recorder(scene, work.resumed, job.plan.request, work.inputs)
        if fitting.recorder is not None and fitting.recorder.trouble:
            announce(self, {"WARNING"}, fitting.recorder.trouble)

    def _fit(self, phase: FittingPhase) -> bool:
        """Whether the run goes on by itself."""
        try:
            running = phase.update().running
            if trouble := phase.record():
                announce(self, {"WARNING"}, trouble)
        except FitFailed:
            return False
        if running:
            return True
        if not phase.keep:
            return False
        phase.job.join()
        after = _after(phase)
        after.job.wait(_SHORT)
        return after.update()

    def _finish(self, context: bpy.types.Context) -> set[str]:
        """Waits for all of it, and keeps the result."""
        fitting = RUN.fitting
        if fitting is None:  # cancelled meanwhile
            return self._over(context)
        fitting.job.join()
        scene: bpy.types.Scene | None = bpy.data.scenes.get(fitting.scene_name)
        try:
            ended = fitting.job.progress()
        except FitFailed as error:
            RUN.over("")
            report_problems(self, error)
            return self._over(context)
        if not fitting.keep or scene is None:
            RUN.forget()
            return self._over(context)
        last = (RUN.phase if isinstance(RUN.phase, FinishingPhase) else _after(fitting)).job
        last.join()
        work = last.work
        found = replace(work.result, notes=(*work.result.notes, *work.troubles))
        outcome = Outcome(fitting.plan, found, scene.name, fitting.owners, work.folder)
        RUN.close(work.open_record)
        RUN.keep(outcome, ENDS.get(ended.stopped.name, f"Stopped because: {ended.stopped_because}"))
        keep_result(scene, outcome)
        keep_fields(scene, outcome)
        if work.trouble:
            text = message(
                "fit.cannot-write-fitted-grids",
                "Cannot write the fitted grids and images to '{folder}'",
                folder=output_folder(scene),
            )
            cure = translated("choose another folder below and save the result")
            said = phrase("{text}: {why}; {cure}", text=text, why=work.trouble, cure=cure)
            announce(self, {"ERROR"}, said)
        VIEW.wake()  # small pictures of the result
        self._over(context)
        notify(self, scene)
        return {"FINISHED"}

    def _over(self, context: bpy.types.Context) -> set[str]:
        """Nothing runs any more."""
        self._remove_timer(context)
        show_status(context, None)
        redraw(context)
        return {"CANCELLED"}


def _asking(scene: bpy.types.Scene, resume: str) -> Reading[Preparing]:
    """What needs Blender: the scene as it is, and what the panel asks for. resume: folder of an
    unfinished run, "" for none. Raises BadInput."""
    PROBLEMS.pop(scene.name, None)
    values = yield from reading(scene)
    resumed = Path(bpy.path.abspath(resume)) if resume else None
    run = load(resumed) if resumed else Unfinished(_request(scene, values))
    frames = (item.frame for item in run.request.captures if item.frame is not None)
    yield from reading_frames(values, frames)
    return Preparing(values, run, packed_photos(), bpy.data.filepath, resumed)


def _request(scene: bpy.types.Scene, values: SceneValues) -> RunRequest:
    """Of the panel. Raises BadInput, with what a survey of the bodies finds too."""
    try:
        return run_request(scene, values)
    except BadInput as error:
        values.bodies = judge_bodies(values)
        remember(scene.name, values)
        raise BadInput([*values.problems, *error.problems]) from error


def _after(fitting: FittingPhase) -> FinishingPhase:
    """The phase after the native fit, begun; what it does may render, so it has a thread, and it
    has the record of the run to close."""
    scene: bpy.types.Scene | None = bpy.data.scenes.get(fitting.scene_name)
    folder = output_folder(scene) if scene is not None else Path()
    recorder, fitting.recorder = fitting.recorder, None
    work = Finishing(fitting.job, folder, bpy.app.version_string, recorder)
    RUN.phase = FinishingPhase(fitting, BackgroundJob(work))
    return RUN.phase


def _recorder(
    scene: bpy.types.Scene, resumed: Path | None, request: RunRequest, inputs: Inputs
) -> BackgroundRecorder | None:
    """Keeps the run on disk, where it was or in the folder of results; None where the file has no
    place yet: its scene could not be found again."""
    if resumed is not None:
        folder = resumed
    elif scene.selenite.output.startswith("//") and not bpy.data.filepath:
        return None
    else:
        folder = new_folder(output_folder(scene), SUFFIX)
    return BackgroundRecorder(folder, request, inputs)


CLASSES = (SELENITE_OT_start,)
