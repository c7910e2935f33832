# SPDX-License-Identifier: GPL-3.0-or-later
"""Stop, cancel, resume, save: what a run may become."""

from __future__ import annotations

import time

import bpy
from bpy.props import StringProperty

from ...fit.job import FitFailed, FitJob
from ...scene_read.reading.render_depsgraph import Reading
from ..output_folder import output_folder
from ..running.work import Saving
from ..state import BATCH, CHECK, JOBS, MODELS, READING, RUN, SAVE, TRADE, is_idle
from ..texts import announce
from ..ticking import WorksInThread, redraw

#: Seconds that Cancel waits for the native thread, which ends within a tile; and between two polls.
_PATIENCE, _POLL = 0.2, 0.005


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
        self.directory = str(output_folder(context.scene))
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """As Start, with what the run was asked for in place of the panel's settings."""
        mode = "EXEC_DEFAULT" if bpy.app.background else "INVOKE_DEFAULT"
        return bpy.ops.selenite.start(mode, resume=self.directory)


class SELENITE_OT_stop(bpy.types.Operator):
    """Stop what runs and keep the best values, or what has been measured, so far, as Esc does"""

    bl_idname = "selenite.stop"
    bl_label = "Stop and Keep Best"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """A fit, a command of fits or a measurement is running."""
        running = any(item.job is not None for item in (TRADE, MODELS, BATCH))
        return running or RUN.fitting is not None

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """It ends at its next tick."""
        TRADE.cancel()
        for command in (MODELS, BATCH):
            command.ask_to_stop()
        if RUN.fitting is not None:
            RUN.ask_to_stop(keep=True)
        return {"FINISHED"}


class SELENITE_OT_cancel(bpy.types.Operator):
    """Stop what runs and forget it; the scene and the result before it stay as they are"""

    bl_idname = "selenite.cancel"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Anything runs."""
        return not is_idle()

    def execute(self, context: bpy.types.Context) -> set[str]:
        """The scene was never touched. Mostly a fit ends at once; all else ends at its next
        tick."""
        for item in (READING, CHECK, *JOBS):
            item.cancel()
        RUN.ask_to_stop(keep=False)
        fitting = RUN.fitting
        if fitting is not None and _ends_within(fitting.job, _PATIENCE):
            RUN.forget()
        redraw(context)
        return {"FINISHED"}


def _ends_within(job: FitJob, seconds: float) -> bool:
    """Whether a job that was cancelled comes to its end so soon."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        try:
            if not job.progress().running:
                return True
        except FitFailed:
            return True
        time.sleep(_POLL)
    return False


class SELENITE_OT_save_result(WorksInThread):
    """Write the last result with its pictures to a folder named by date and time. Esc cancels"""

    bl_idname = "selenite.save_result"
    bl_label = "Save Result Folder"

    background = SAVE
    failure = "The result is not saved"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """A fit has ended in this session, and nothing runs."""
        cls.poll_message_set("Run a fit first, and wait for its end")
        return RUN.done is not None and is_idle()

    def _asking(self, context: bpy.types.Context) -> Reading[Saving]:
        folder = output_folder(context.scene)
        yield from ()  # nothing is read
        outcome = RUN.done
        assert outcome is not None  # by `poll`
        return Saving(outcome, folder, bpy.app.version_string)

    def _end(self, work: Saving | None) -> set[str]:
        if work is not None and work.trouble:
            announce(self, {"ERROR"}, work.trouble)
        if work is None or work.folder is None:
            return {"CANCELLED"}
        work.outcome.folder = work.folder
        SAVE.lines = [f"Wrote {work.folder}"]
        announce(self, {"INFO"}, f"Wrote {work.folder}")
        return {"FINISHED"}


CLASSES = (
    SELENITE_OT_resume,
    SELENITE_OT_stop,
    SELENITE_OT_cancel,
    SELENITE_OT_save_result,
)
