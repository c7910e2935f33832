# SPDX-License-Identifier: GPL-3.0-or-later
"""Start. A fit changes nothing in the scene until Apply."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import StringProperty

from ...advice.information.conditioning import StageChoice
from ...advice.information.job import BackgroundJob
from ...capture.scene_captures import packed_photos
from ...cycles_check.render_settings import contents_of
from ...fit.checkpoint import SUFFIX, Unfinished, load
from ...fit.inputs import Inputs
from ...fit.job import FitFailed, FitJob
from ...fit.overall import Overall
from ...fit.plan import prepare
from ...fit.request import RunRequest
from ...fit.staging.request import AUTO
from ...problems import BadInput
from ...report.results import new_folder
from ...scene_read.geometry.bodies import judge_bodies
from ...scene_read.lamps.frames import reading_frames
from ...scene_read.reading.job import ReadingJob
from ...scene_read.reading.render_depsgraph import Reading, Stopped, at_once
from ...scene_read.scene import reading
from ...scene_read.values import Owner, SceneValues
from .. import environment_panel
from ..output_folder import output_folder
from ..pictures.operators import open_at_start
from ..pictures.view import VIEW
from ..problem_reports import report_problems
from ..progress.notice import notify, scroll_up
from ..request import run_request
from ..result.kept import keep_fields, keep_result
from ..running.recorder import BackgroundRecorder
from ..running.work import Finishing, Preparing
from ..state import CANCELLED, CHECK, PROBLEMS, RUN, STAGES, remember_shapes
from ..texts import announce
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

    _owners: dict[str, Owner]  # of the scene as it was read
    _inputs: Inputs  # what the run is given
    _values: SceneValues
    _scene_name: str
    _resumed: str  # folder of an unfinished run, "" for none
    _packed: dict[str, bytes]

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Blender's thread reads the scene, ours the photos, the native one fits; a timer polls."""
        scroll_up()
        RUN.read(ReadingJob(self._asking(context.scene, self.resume)), context.scene.name)
        if not self._read_on(context):
            return {"CANCELLED"}
        return self._add_timer(context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Without a window: runs to the end."""
        if not self._start(context, self.resume):
            return {"CANCELLED"}
        if STAGES.job is not None and not self._go_on(context):
            return {"CANCELLED"}
        RUN.job.join()
        return self._finish(context)

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Everything but Esc passes through, so that Blender stays usable; while the scene is
        read, the pointer alone."""
        if RUN.reading is not None:
            return self._reading(context, event)
        if RUN.preparing is not None:
            return self._preparing(context, event)
        if STAGES.job is not None:
            return self._choosing(context, event)
        if RUN.finishing is not None:
            return self._finishing(context, event)
        if RUN.job is None:  # stopped from elsewhere
            return self._over(context)
        if event.type == "ESC" and event.value == "PRESS":
            RUN.ask_to_stop(keep=True)
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            RUN.update()
            if trouble := RUN.record():
                announce(self, {"WARNING"}, trouble)
        except FitFailed:
            return self._finish(context)
        show_status(context, RUN.shown.text, RUN.shown.fraction)
        if RUN.progress.running:
            return {"PASS_THROUGH"}
        return self._begin_finishing(context)

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender quits or loads another file: the threads must end first."""
        STAGES.stop()
        RUN.stop(keep=False)
        self._remove_timer(context)

    def _start(self, context: bpy.types.Context, resume: str = "") -> bool:
        """All that comes before the fit, at once."""
        work = built(self, lambda: at_once(self._asking(context.scene, resume)))
        if work is None:
            return False
        ready = built(self, lambda: list(work.steps())) is not None
        remember_shapes(self._scene_name, work.values)
        return ready and self._begin(work)

    def _asking(self, scene: bpy.types.Scene, resume: str) -> Reading[Preparing]:
        """What needs Blender: the scene as it is, and what the panel asks for. Raises BadInput."""
        self._scene_name, self._resumed = scene.name, resume
        PROBLEMS.pop(scene.name, None)
        values = yield from reading(scene)
        if resume:
            run = load(Path(bpy.path.abspath(resume)))
        else:
            run = Unfinished(_request(scene, values))
        frames = (item.frame for item in run.request.captures if item.frame is not None)
        yield from reading_frames(values, frames)
        self._values, self._owners, self._packed = values, values.owners, packed_photos()
        chooses = scene.selenite.stage_mode == AUTO and not resume
        return Preparing(values, run, self._packed, bpy.data.filepath, makes_job=not chooses)

    def _reading(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """While Blender's thread reads the scene. What could change it waits: only the pointer
        moves on, and Esc cancels."""
        if event.type == "ESC" and event.value == "PRESS":
            RUN.reading.cancel()
        if event.type == "TIMER" and not self._read_on(context):
            return self._over(context)
        return {"PASS_THROUGH"} if event.type in HARMLESS else {"RUNNING_MODAL"}

    def _read_on(self, context: bpy.types.Context) -> bool:
        """Goes on reading, then starts the thread that prepares; False where nothing goes on."""
        job, RUN.reading = RUN.reading, None
        try:
            reads = built(self, job.step)
        except Stopped:
            reads, RUN.message = None, CANCELLED
        if reads:
            RUN.reading = job
            show_status(context, job.text() or RUN.shown.phase)
        elif reads is not None:
            RUN.prepare(BackgroundJob(job.value))
        return reads is not None

    def _begin(self, work: Preparing) -> bool:
        """Starts the fit that was prepared, or chooses its stages first."""
        self._inputs = work.inputs
        scene: bpy.types.Scene | None = bpy.data.scenes.get(self._scene_name)
        if scene is None:
            RUN.message = CANCELLED
            return False
        if work.job is None:
            values, packed = self._values, self._packed
            choice = StageChoice(work.plan, lambda chosen: prepare(values, chosen, packed))
            STAGES.start(BackgroundJob(choice), scene.name)
            return True
        return self._run(scene, work.job, work.overall)

    def _preparing(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """While a thread reads the photos; Esc leaves it alone, and nothing starts."""
        job = RUN.preparing
        if event.type == "ESC" and event.value == "PRESS":
            RUN.drop_preparing()
            RUN.message = CANCELLED
            return self._over(context)
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        running, step = job.progress()
        show_status(context, step.text, 0.0)
        if running:
            return {"PASS_THROUGH"}
        RUN.preparing = None
        ready = built(self, job.join)
        remember_shapes(self._scene_name, job.work.values)
        if ready and self._begin(job.work):
            return {"PASS_THROUGH"}
        return self._over(context)

    def _choosing(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """While the stages are being chosen; the fit starts at the end of that."""
        if event.type == "ESC" and event.value == "PRESS":
            STAGES.job.cancel()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        running, STAGES.step = STAGES.job.progress()
        show_status(context, f"choosing stages, {STAGES.step.text}", STAGES.step.fraction)
        if running or self._go_on(context):
            return {"PASS_THROUGH"}
        return self._over(context)

    def _go_on(self, context: bpy.types.Context) -> bool:
        """Starts the fit with the stages that were chosen; False where there is none to start."""
        choice, STAGES.job = STAGES.job, None
        scene: bpy.types.Scene | None = bpy.data.scenes.get(STAGES.scene_name)
        try:
            if not choice.join() or scene is None:
                RUN.message = CANCELLED
                redraw(context)
                return False
            job = FitJob(choice.work.plan)
        except BadInput as error:
            report_problems(self, error)
            return False
        except (ValueError, RuntimeError) as error:
            announce(self, {"ERROR"}, f"No stages are chosen: {error}")
            return False
        return self._run(scene, job)

    def _run(self, scene: bpy.types.Scene, job: FitJob, overall: Overall | None = None) -> bool:
        """Starts the native thread and the record on disk."""
        for text in job.plan.warnings:
            announce(self, {"WARNING"}, text)
        CHECK.contents[scene.name] = contents_of(scene)
        CHECK.forget()
        RUN.start(job, scene.name, self._owners, overall)
        VIEW.begin()
        open_at_start()
        environment_panel.begin()
        RUN.recorder = _recorder(scene, self._resumed, self._inputs)
        if RUN.recorder is not None and RUN.recorder.trouble:
            announce(self, {"WARNING"}, RUN.recorder.trouble)
        return True

    def _begin_finishing(self, context: bpy.types.Context) -> set[str]:
        """The native fit is over; what follows it may render, so it has a thread."""
        if not RUN.keep:
            return self._finish(context)
        RUN.job.join()
        RUN.finishing = BackgroundJob(_work_after(RUN.job))
        RUN.finishing.start()
        RUN.finishing.wait(_SHORT)
        return self._finishing(context, None)

    def _finishing(self, context: bpy.types.Context, event: bpy.types.Event | None) -> set[str]:
        """While a thread looks for wrong lights and fills images; Esc leaves that out."""
        if event is not None and event.type == "ESC" and event.value == "PRESS":
            RUN.finishing.cancel()
            return {"RUNNING_MODAL"}
        if event is not None and event.type != "TIMER":
            return {"PASS_THROUGH"}
        running, _ = RUN.finishing.progress()
        if not running:
            return self._finish(context)
        RUN.shown = RUN.overall.finishing(RUN.finishing.work.step.fraction)
        show_status(context, RUN.shown.text, RUN.shown.fraction)
        return {"PASS_THROUGH"}

    def _finish(self, context: bpy.types.Context) -> set[str]:
        """Waits for all of it, and keeps the result."""
        self._remove_timer(context)
        show_status(context, None)
        job, RUN.job = RUN.job, None
        if job is None:  # cancelled meanwhile
            redraw(context)
            return {"CANCELLED"}
        job.join()
        scene: bpy.types.Scene | None = bpy.data.scenes.get(RUN.scene_name)
        last, RUN.finishing = RUN.finishing, None
        try:
            ended = job.progress()
        except FitFailed as error:
            RUN.drop_record()
            RUN.message = str(error)
            announce(self, {"ERROR"}, str(error))
            return {"CANCELLED"}
        if not RUN.keep or scene is None:
            if last is not None:
                last.cancel()
            RUN.drop_record()
            RUN.bring_back()
            redraw(context)
            return {"CANCELLED"}
        if last is None:
            last = BackgroundJob(_work_after(job))
            last.start()
        last.join()
        RUN.result = dict(last.work.result)
        RUN.result["notes"] = (*RUN.result["notes"], *last.work.troubles)
        RUN.folder = last.work.folder
        RUN.recorder = last.work.open_record
        RUN.drop_record()
        why = f"Stopped because: {ended.stopped_because}"
        RUN.message = ENDS.get(ended.stopped.name, why)
        keep_result(scene)
        keep_fields(scene)
        if last.work.trouble:
            text = f"Cannot write the fitted grids and images to '{output_folder(scene)}'"
            cure = "choose another folder below and save the result"
            announce(self, {"ERROR"}, f"{text}: {last.work.trouble}; {cure}")
        VIEW.wake()  # small pictures of the result
        redraw(context)
        notify(self, scene)
        return {"FINISHED"}

    def _over(self, context: bpy.types.Context) -> set[str]:
        """Nothing runs any more, and there is nothing to keep."""
        self._remove_timer(context)
        show_status(context, None)
        redraw(context)
        return {"CANCELLED"}


def _request(scene: bpy.types.Scene, values: SceneValues) -> RunRequest:
    """Of the panel. Raises BadInput, with what a survey of the bodies finds too."""
    try:
        return run_request(scene, values)
    except BadInput as error:
        values.bodies = judge_bodies(values)
        remember_shapes(scene.name, values)
        raise BadInput([*values.problems, *error.problems]) from error


def _work_after(job: FitJob) -> Finishing:
    """It has the record of the run to close."""
    scene: bpy.types.Scene | None = bpy.data.scenes.get(RUN.scene_name)
    folder = output_folder(scene) if scene is not None else Path()
    recorder, RUN.recorder = RUN.recorder, None
    return Finishing(job, folder, bpy.app.version_string, recorder)


def _recorder(scene: bpy.types.Scene, resumed: str, inputs: Inputs) -> BackgroundRecorder | None:
    """Keeps the run on disk, where it was or in the folder of results; None where the file has no
    place yet: its scene could not be found again."""
    if resumed:
        folder = Path(bpy.path.abspath(resumed))
    elif scene.selenite.output.startswith("//") and not bpy.data.filepath:
        return None
    else:
        folder = new_folder(output_folder(scene), SUFFIX)
    return BackgroundRecorder(folder, RUN.plan.request, inputs)


CLASSES = (SELENITE_OT_start,)
