# SPDX-License-Identifier: GPL-3.0-or-later
"""The head of the tab, always in sight: progress with Stop and Cancel, problems, the next step."""

from __future__ import annotations

import bpy

from ...capture.pairing import KIND as PAIRING
from ...capture.window import ASPECT
from ...fit.diagnosis.darkness import DARK
from ...messages import named
from ...scene_read.geometry.bodies import OPEN_BODY
from .. import state
from ..operators import models
from ..problem_reports import thing_of
from ..running.run import ENDING, Phase
from ..texts import field, paragraph, shown, translated
from .background import draw_bar, draw_stop, draw_work

_WIDTH = 0.94
#: Kind of a problem -> the operator that is its cure.
_REMEDIES = {
    ASPECT: "selenite.set_resolution",
    PAIRING: "selenite.pair_photos",
    OPEN_BODY: "selenite.close_body",
    DARK: "selenite.light_world",
}
#: Of what is said of a run: percent, phase and time left.
_LINES = 2


class SELENITE_PT_head(bpy.types.Panel):
    """What runs, what stands in the way, and what to do next"""

    bl_idname = "SELENITE_PT_head"
    bl_label = "Selenite"
    bl_options = {"HIDE_HEADER"}
    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "Selenite"

    def draw(self, context: bpy.types.Context) -> None:
        """One of: why nothing works, a running fit or check, the problems, the next step."""
        # A panel without a header reaches below the tabs of the sidebar.
        layout = self.layout.split(factor=_WIDTH).column()
        missing = state.why_native_is_missing()
        if missing:
            paragraph(layout, context, missing, "ERROR")
            return
        if draw_work(layout, state.SAMPLE):
            return
        for command in (state.MODELS, state.BATCH):
            if command.job is not None:
                _draw_command(layout, context, command)
                return
        if state.READING.job is not None:
            text = ENDING if state.READING.is_cancelled else "Reading the scene"
            draw_bar(layout, 0.0, translated(text))
            layout.operator("selenite.cancel", icon="X")
            return
        if state.RUN.phase is not None:
            _draw_run(layout, context, state.RUN.phase)
            return
        if state.CHECK.job is not None:
            progress = state.CHECK.progress
            text = progress.text if progress else "Starting"
            draw_bar(layout, progress.fraction if progress else 0.0, text, _LINES)
            layout.operator("selenite.cancel", text="Cancel Check", icon="X")
            return
        _draw_problems(layout, context)
        for line in (*_news(), *models.news(context.scene.selenite)):
            paragraph(layout, context, line, "INFO")
        _draw_next(layout, context)
        if state.PAIRING.job is not None:  # below: it must not move a button that is being pressed
            paragraph(layout, context, "Comparing photos with cameras", "SORTTIME")


def next_step(scene: bpy.types.Scene) -> tuple[str, str]:
    """(operator, icon) of what a user does next: so the next button is always in the same place."""
    settings = scene.selenite
    if not any(row.enabled and row.photo and row.camera for row in settings.captures):
        return "selenite.load_photos", "FILE_FOLDER"
    if found := models.next_step(settings):
        return found
    if not len(settings.rows):
        return "selenite.refresh_rows", "FILE_REFRESH"
    if not any(row.enabled for row in settings.rows):
        if all(row.reason for row in settings.rows):  # nothing can be ticked
            return "selenite.refresh_rows", "FILE_REFRESH"
        return "selenite.tick_usual", "CHECKBOX_HLT"
    if len(settings.results) and not settings.applied:
        if settings.is_wrong and state.RUN.plan is not None:
            return "selenite.compare_pictures", "IMAGE_DATA"
        return ("selenite.start", "PLAY") if settings.is_wrong else ("selenite.apply", "CHECKMARK")
    if settings.applied:
        return "selenite.check_in_cycles", "RENDER_STILL"
    return "selenite.start", "PLAY"


def _news() -> list[str]:
    """How the last fit, or the check after it, and the sample scene went."""
    found = [
        state.CHECK.message or translated(state.RUN.message),
        *state.SAMPLE.lines,
        *state.MODELS.lines,
    ]
    return [text for text in found if text]


def _draw_next(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """The next step, with what belongs to it."""
    settings = context.scene.selenite
    name, icon = next_step(context.scene)
    if name in ("selenite.start", "selenite.fit_models"):
        field(layout, settings, "preset")
        field(layout, settings, "body")
    row = layout.row(align=True)
    row.operator(name, icon=icon)
    row.operator("selenite.open_manual", text="", icon="HELP")
    if name == "selenite.load_photos" and bpy.ops.selenite.open_sample.poll():
        layout.operator("selenite.open_sample", icon="FILE_3D")


def _draw_run(layout: bpy.types.UILayout, context: bpy.types.Context, phase: Phase) -> None:
    """Bar, Stop, Cancel, and what Esc does."""
    draw_bar(layout, phase.fraction, phase.title, _LINES)
    keeps = state.RUN.fitting is not None
    column = layout.column(align=True)
    if keeps:
        draw_stop(column)
    column.operator("selenite.cancel", text="Cancel (Restore)", icon="X")
    text = "Esc stops and keeps" if keeps else "Esc cancels"
    paragraph(layout, context, translated(text))


def _draw_command(
    layout: bpy.types.UILayout, context: bpy.types.Context, command: state.Command
) -> None:
    """Bar, Stop, Cancel, and what Esc does."""
    step = command.step
    draw_bar(layout, step.fraction if step else 0.0, step.text if step else "Starting", _LINES)
    column = layout.column(align=True)
    draw_stop(column)
    column.operator("selenite.cancel", text="Cancel (Restore)", icon="X")
    paragraph(layout, context, translated("Esc stops and keeps"))


def _draw_problems(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """All of them at once, each with what to do and, where it is a thing, a button to select it."""
    problems = state.PROBLEMS.get(context.scene.name, ())
    if not problems:
        return
    row = layout.row()
    row.label(text=translated("Problems: {}").format(len(problems)), icon="ERROR")
    row.operator("selenite.clear_problems", text="", icon="X", emboss=False)
    for problem in problems:
        box = layout.box().column(align=True)
        line = box.row()
        line.label(text=shown(problem.object), translate=False)
        kind, name = named(problem.object)
        if thing_of(kind, name) is not None:
            # A word beside it would cut the name.
            button = line.operator("selenite.select_problem", text="", icon="RESTRICT_SELECT_OFF")
            button.kind, button.name = kind, name
        cause = shown(problem.cause)
        paragraph(box, context, f"{cause[:1].upper()}{cause[1:]}.")
        paragraph(box, context, problem.cure, "FORWARD")
        if problem.kind in _REMEDIES:
            remedy = box.operator(_REMEDIES[problem.kind], icon="TOOL_SETTINGS")
            if problem.kind == OPEN_BODY:
                remedy.name = name
