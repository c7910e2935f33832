# SPDX-License-Identifier: GPL-3.0-or-later
"""Check in Cycles, and the render settings with which Cycles shows what was fitted."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...capture.scene_captures import captures_of
from ...cycles_check.job import CheckJob, lines, verdict
from ...cycles_check.render_settings import contents_of, set_for_fit
from ...fit.capture_render import as_found
from ...fit.request import RunRequest
from ...messages import message
from ...problems import BadInput, Problem
from ...report.results import new_folder, write_results
from ...scene_read.blender_process import ProcessFailed
from ...scene_read.options import options_of
from ...write_back import grids as grid_objects
from ..output_folder import output_folder
from ..pictures.operators import show_content
from ..problem_reports import report_problems
from ..progress.notice import scroll_up
from ..request import fit_settings
from ..rows import environment as environment_rows
from ..rows import fields as field_rows
from ..state import CHECK, RUN, is_idle
from ..texts import announce
from ..ticking import Ticking, redraw


class SELENITE_OT_check_in_cycles(Ticking, bpy.types.Operator):
    """Render the fitted values with Cycles, on a copy of the file, and compare with the photos"""

    tick = 0.3  # the other process reports no more often
    bl_idname = "selenite.check_in_cycles"
    bl_label = "Check in Cycles"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a result, and nothing runs."""
        cls.poll_message_set("Run a fit first, and wait for its end")
        idle = is_idle()
        return idle and len(context.scene.selenite.results) > 0

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Starts the other process; a timer polls it."""
        if not self._start(context):
            return {"CANCELLED"}
        return self._add_timer(context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Without a window: waits for the end."""
        return self._finish(context) if self._start(context) else {"CANCELLED"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Everything but Esc passes through, so that Blender stays usable."""
        if CHECK.job is None:  # cancelled from elsewhere
            self._remove_timer(context)
            return {"CANCELLED"}
        if event.type == "ESC" and event.value == "PRESS":
            CHECK.cancel()
            redraw(context)
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        CHECK.progress = CHECK.job.progress()
        redraw(context)
        return {"PASS_THROUGH"} if CHECK.progress.running else self._finish(context)

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender quits or loads another file."""
        CHECK.stop()
        self._remove_timer(context)

    def _start(self, context: bpy.types.Context) -> bool:
        scene = context.scene
        known = RUN.outcome_of(scene.name)
        request = known.plan.request if known else _request(scene)
        rows = scene.selenite.results
        # Once they are applied, the scene itself shows the fields.
        applied = scene.selenite.applied
        elsewhere = field_rows.replaced(scene) if applied else set()
        values = {
            (row.owner, row.parameter): tuple(row.value[: row.width])
            for row in rows
            if not field_rows.is_field(row) and (row.owner, row.parameter) not in elsewhere
        }
        CHECK.contents[scene.name] = contents_of(scene)
        try:
            grids = {} if applied else field_rows.fitted_grids(scene)
            surfaces = {} if applied else field_rows.fitted_surfaces(scene)
            if grids and (missing := grid_objects.why_not()):
                raise BadInput(
                    Problem(
                        "Check in Cycles",
                        message(
                            "check.cannot-show-grids",
                            "{cause} and cannot show grids",
                            cause=missing.cause,
                        ),
                        missing.cure,
                    )
                )
            taken = (
                [as_found(item, known.result.fit) for item in known.plan.captures] if known else []
            )
            environment = "" if applied else environment_rows.fitted(scene)
            job = CheckJob(scene, request, values, grids, surfaces, taken, environment)
        except (BadInput, OSError) as error:
            _report(self, error)
            return False
        CHECK.start(job, scene.name)
        return True

    def _finish(self, context: bpy.types.Context) -> set[str]:
        self._remove_timer(context)
        job, CHECK.job = CHECK.job, None
        try:
            report = job.result()
            CHECK.sheet = job.keep(report, _folder())
        except (BadInput, ProcessFailed, OSError) as error:
            CHECK.message = "The check failed"
            _report(self, error)
            return {"CANCELLED"}
        finally:
            job.close()
            redraw(context)
        CHECK.message, CHECK.lines = verdict(report), lines(report)
        announce(self, {"INFO"}, CHECK.message)
        if not bpy.app.background:
            show_content("CYCLES")
            scroll_up()
        return {"FINISHED"}


class SELENITE_OT_set_cycles(bpy.types.Operator):
    """Set bounces, clamps, filters and caustics so that Cycles shows what is fitted"""

    bl_idname = "selenite.set_cycles"
    bl_label = "Set Cycles for the Fit"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """One undo step; the list of the panel afterwards holds remarks only."""
        changed = set_for_fit(context.scene)
        CHECK.contents[context.scene.name] = contents_of(context.scene)
        text = f"Set {', '.join(changed)}" if changed else "All was set already"
        announce(self, {"INFO"}, text)
        return {"FINISHED"}


class SELENITE_OT_show_sheet(bpy.types.Operator):
    """Show the contact sheet of the last check in the Image Editor: photo, Selenite, Cycles and
    their differences"""

    bl_idname = "selenite.show_sheet"
    bl_label = "Show Check"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """A check has ended, and there is a window."""
        return CHECK.sheet is not None and context.window is not None

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Beside the 3D View, as the pictures of a fit."""
        show_content("CYCLES")
        return {"FINISHED"}


def _request(scene: bpy.types.Scene) -> RunRequest:
    """After loading a file with a result in it: the captures and settings as they are now."""
    captures = tuple(captures_of(scene))
    settings = fit_settings(scene)
    return RunRequest(bpy.data.filepath, (), captures, settings, reading=options_of(scene))


def _folder() -> Path:
    """The fit's result folder; if it was not saved yet one without the fit's own pictures."""
    scene = bpy.data.scenes[CHECK.scene_name]
    done = RUN.outcome_of(scene.name)
    if done is None:
        return new_folder(output_folder(scene))
    if done.folder is None or not done.folder.is_dir():
        parent = output_folder(scene)
        done.folder = write_results(
            done.plan, done.result, parent, bpy.app.version_string, pictures=False
        )
    return done.folder


def _report(operator: bpy.types.Operator, error: Exception) -> None:
    if isinstance(error, BadInput):
        report_problems(operator, error)
    else:
        announce(
            operator,
            {"ERROR"},
            message("check.check-failed", "The check failed: {error}", error=error),
        )


CLASSES = (
    SELENITE_OT_check_in_cycles,
    SELENITE_OT_set_cycles,
    SELENITE_OT_show_sheet,
)
