# SPDX-License-Identifier: GPL-3.0-or-later
"""Start, stop, resume, save. A fit changes nothing in the scene until Apply."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
from bpy.props import StringProperty

from .. import mean_free_path
from ..cycles_check.render_settings import contents_of
from ..fit_run import trust
from ..fit_run.checkpoint import SUFFIX, Recorder, Unfinished, going_on, load
from ..fit_run.inputs import Inputs, changes, inputs_of
from ..fit_run.job import FitFailed, FitJob, fitted_values
from ..fit_run.light_pairing import with_warnings
from ..fit_run.plan import prepare
from ..fit_run.results import finished, new_folder, write_results
from ..fit_run.staging.job import StagedJob, make_job
from ..fit_run.staging.request import AUTO
from ..information.conditioning import StageChoice
from ..information.job import BackgroundJob
from ..problems import BadInput
from ..scene_read.photos import packed_photos
from ..scene_read.scene import read_scene
from ..scene_read.values import Owner
from . import environment_panel, field_rows
from .live_view import VIEW
from .problem_reports import report_problems
from .request import run_request, values_text
from .state import CHECK, RUN, STAGES, is_idle, remember_shapes
from .ticking import Ticking, built, redraw


class SELENITE_OT_start(Ticking, bpy.types.Operator):
    """Fit the ticked parameters to the photos. Esc stops and keeps the best values so far"""

    bl_idname = "selenite.start"
    bl_label = "Start Fit"
    bl_options = {"UNDO"}

    resume: StringProperty(
        subtype="DIR_PATH",
        options={"HIDDEN", "SKIP_SAVE"},
        description="An unfinished run's folder",
    )

    _owners: dict[str, Owner]  # of the scene as it was read
    _inputs: Inputs  # what the run is given

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Starts the native thread; a timer polls it."""
        if not self._start(context, self.resume):
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
        """Everything but Esc passes through, so that Blender stays usable."""
        if STAGES.job is not None:
            return self._choosing(context, event)
        if RUN.job is None:  # stopped from elsewhere
            self._remove_timer(context)
            return {"CANCELLED"}
        if event.type == "ESC" and event.value == "PRESS":
            RUN.ask_to_stop(keep=True)
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            RUN.progress = RUN.job.progress()
            if trouble := RUN.record():
                self.report({"WARNING"}, trouble)
        except FitFailed:
            return self._finish(context)
        redraw(context)
        return {"PASS_THROUGH"} if RUN.progress.running else self._finish(context)

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender quits or loads another file: the thread must end first."""
        STAGES.stop()
        RUN.stop(keep=False)
        self._remove_timer(context)

    def _start(self, context: bpy.types.Context, resume: str = "") -> bool:
        made = built(self, lambda: self._made(context, resume))
        if made is None:
            return False
        if isinstance(made, StageChoice):
            STAGES.start(BackgroundJob(made), context.scene.name)
            return True
        return _begin(self, context.scene, made, resume)

    def _made(self, context: bpy.types.Context, resume: str) -> FitJob | StagedJob | StageChoice:
        """The fit, or the work that chooses its stages first."""
        values = read_scene(context.scene)
        remember_shapes(context.scene.name, values)
        if resume:
            run = going_on(load(Path(bpy.path.abspath(resume))))
        else:
            run = Unfinished(run_request(context.scene, values), [])
        packed = packed_photos()
        plan = prepare(values, run.request, packed)
        self._owners = values.owners
        self._inputs = inputs_of(values, plan.request, packed)
        if run.inputs is not None:
            changed = changes(run.inputs, self._inputs, bpy.data.filepath)
            if changed:
                raise BadInput(changed)
            self._inputs = run.inputs
        if context.scene.selenite.stage_mode == AUTO and not resume:
            return StageChoice(plan, lambda chosen: prepare(values, chosen, packed))
        return make_job(plan, run.parts, run.state)

    def _choosing(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """While the stages are being chosen; the fit starts at the end of that."""
        if event.type == "ESC" and event.value == "PRESS":
            STAGES.job.cancel()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        running, STAGES.step = STAGES.job.progress()
        redraw(context)
        if running or self._go_on(context):
            return {"PASS_THROUGH"}
        self._remove_timer(context)
        return {"CANCELLED"}

    def _go_on(self, context: bpy.types.Context) -> bool:
        """Starts the fit with the stages that were chosen; False where there is none to start."""
        choice, STAGES.job = STAGES.job, None
        scene: bpy.types.Scene | None = bpy.data.scenes.get(STAGES.scene_name)
        try:
            if not choice.join() or scene is None:
                RUN.message = "Cancelled; nothing was changed"
                redraw(context)
                return False
            job = make_job(choice.work.plan)
        except BadInput as error:
            report_problems(self, error)
            return False
        except (ValueError, RuntimeError) as error:
            self.report({"ERROR"}, f"No stages are chosen: {error}")
            return False
        return _begin(self, scene, job)

    def _finish(self, context: bpy.types.Context) -> set[str]:
        self._remove_timer(context)
        job, RUN.job = RUN.job, None
        job.join()
        troubles = RUN.close_record()
        scene: bpy.types.Scene | None = bpy.data.scenes.get(RUN.scene_name)
        try:
            result = job.result()
        except FitFailed as error:
            RUN.message = str(error)
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if not RUN.keep or scene is None:
            RUN.message = "Cancelled; nothing was changed"
            redraw(context)
            return {"CANCELLED"}
        with _shown_progress(context) as note_progress:
            result = with_warnings(RUN.plan, result, note_progress)
            RUN.result = finished(RUN.plan, result, note_progress)
        RUN.result["notes"] = (*RUN.result["notes"], *troubles)
        RUN.message = f"Stopped because: {result['stopped_because']}"
        _keep_result(scene)
        try:
            _keep_fields(scene)
        except OSError as error:
            parent = bpy.path.abspath(scene.selenite.output)
            text = f"Cannot write the fitted grids and images to '{parent}': {error}"
            self.report({"ERROR"}, f"{text}; choose another folder below and save the result")
        redraw(context)
        self.report({"INFO"}, RUN.message)
        return {"FINISHED"}


class SELENITE_OT_resume(bpy.types.Operator):
    """Go on with a run that ended with Blender: choose its folder, <date>_<time>.unfinished"""

    bl_idname = "selenite.resume"
    bl_label = "Resume a Run"

    directory: StringProperty(subtype="DIR_PATH")

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """One fit at a time."""
        cls.poll_message_set("A fit or a check is running")
        return is_idle()

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Opens the file browser where runs are kept."""
        self.directory = bpy.path.abspath(context.scene.selenite.output)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """As Start, with what the run was asked for in place of the panel's settings."""
        mode = "EXEC_DEFAULT" if bpy.app.background else "INVOKE_DEFAULT"
        return bpy.ops.selenite.start(mode, resume=self.directory)


class SELENITE_OT_stop(bpy.types.Operator):
    """Stop the fit and keep the best values so far"""

    bl_idname = "selenite.stop"
    bl_label = "Stop and Keep Best"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """A fit is running."""
        return RUN.job is not None

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """The fit ends at its next tick."""
        RUN.ask_to_stop(keep=True)
        return {"FINISHED"}


class SELENITE_OT_cancel(bpy.types.Operator):
    """Stop the fit and forget it"""

    bl_idname = "selenite.cancel"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """A fit is running, or its stages are being chosen."""
        return RUN.job is not None or STAGES.job is not None

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """The scene was never touched."""
        if STAGES.job is not None:
            STAGES.job.cancel()
        RUN.ask_to_stop(keep=False)
        return {"FINISHED"}


class SELENITE_OT_save_result(bpy.types.Operator):
    """Write the last result with its pictures to a folder named by date and time"""

    bl_idname = "selenite.save_result"
    bl_label = "Save Result Folder"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """A fit has ended in this session."""
        cls.poll_message_set("Run a fit first")
        return RUN.result is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        """The folder appears complete or not at all."""
        parent = Path(bpy.path.abspath(context.scene.selenite.output))
        try:
            with _shown_progress(context) as note_progress:
                folder = RUN.folder = write_results(
                    RUN.plan, RUN.result, parent, bpy.app.version_string, note_progress
                )
        except OSError as error:
            self.report({"ERROR"}, f"Cannot write to '{parent}': {error}; choose another folder")
            return {"CANCELLED"}
        self.report({"INFO"}, f"Wrote {folder}")
        return {"FINISHED"}


@contextmanager
def _shown_progress(context: bpy.types.Context) -> Iterator[Callable[[str, float], None]]:
    """The pointer shows how far it is, by the function that this gives."""
    manager = context.window_manager
    manager.progress_begin(0, 100)
    try:
        yield lambda _text, fraction: manager.progress_update(int(100 * fraction))
    finally:
        manager.progress_end()


def _begin(
    operator: SELENITE_OT_start, scene: bpy.types.Scene, job: FitJob | StagedJob, resume: str = ""
) -> bool:
    """Starts the native thread and the record on disk."""
    for text in job.plan.warnings:
        operator.report({"WARNING"}, text)
    CHECK.contents[scene.name] = contents_of(scene)
    RUN.start(job, scene.name, operator._owners)
    VIEW.begin()
    environment_panel.begin()
    RUN.recorder = _recorder(scene, resume, operator._inputs)
    if RUN.recorder is not None and RUN.recorder.trouble:
        operator.report({"WARNING"}, RUN.recorder.trouble)
    return True


def _recorder(scene: bpy.types.Scene, resumed: str, inputs: Inputs) -> Recorder | None:
    """Keeps the run on disk, where it was or in the folder of results; None where there is none,
    because the file has no place yet."""
    if resumed:
        return Recorder(Path(bpy.path.abspath(resumed)), RUN.plan.request, inputs)
    output = scene.selenite.output
    if output.startswith("//") and not bpy.data.filepath:
        return None
    folder = new_folder(Path(bpy.path.abspath(output)), SUFFIX)
    return Recorder(folder, RUN.plan.request, inputs)


def _keep_result(scene: bpy.types.Scene) -> None:
    """The result goes into the scene, so that Apply works after saving and loading."""
    settings = scene.selenite
    settings.results.clear()
    settings.applied = False
    values = fitted_values(RUN.plan, RUN.result)
    for unknown in RUN.plan.unknowns:
        owner, name = RUN.owners[unknown.owner], unknown.parameter.name
        row = settings.results.add()
        row.owner, row.kind, row.parameter = owner.name, owner.kind, name
        row.datablock, row.library = owner.datablock, owner.library
        row.width = unknown.parameter.width
        value = values[owner.name, name]
        row.start, row.value = three(unknown.start), three(value)
        row.original = three(owner.values[name])
        row.text = f"{values_text(unknown.start)}\nto {values_text(value)}"
        if name == "extinction":
            row.text += f"\n{mean_free_path.of(value, RUN.plan.millimetres).text()} free path"
        for line in trust.words(unknown, RUN.result):
            row.text += f"\n{line}"


def _keep_fields(scene: bpy.types.Scene) -> None:
    """Fitted grids and images go into a result folder, and results name their files. Raises
    OSError."""
    if not RUN.plan.fields:
        return
    parent = Path(bpy.path.abspath(scene.selenite.output))
    RUN.folder = write_results(RUN.plan, RUN.result, parent, bpy.app.version_string, pictures=False)
    for field in RUN.plan.fields:
        owner, row = RUN.owners[field.owner], scene.selenite.results.add()
        row.owner, row.kind = owner.name, owner.kind
        row.datablock, row.library = owner.datablock, owner.library
        field_rows.keep(row, field, RUN.result, RUN.folder)


def three(values: tuple[float, ...]) -> tuple[float, float, float]:
    first, second, third = (values * 3)[:3]
    return first, second, third


CLASSES = (
    SELENITE_OT_start,
    SELENITE_OT_resume,
    SELENITE_OT_stop,
    SELENITE_OT_cancel,
    SELENITE_OT_save_result,
)
