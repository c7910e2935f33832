# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar tab of the 3D View. Drawing computes nothing."""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy

from ..capture.scene_captures import ids_of
from ..cycles_check.render_settings import Contents, remarks
from ..fit.job import DESCENT
from ..messages import message
from . import state, warning_rows
from .captures import lights as capture_lights
from .captures import photo as capture_photo
from .chosen import chosen
from .operators import batch, presets
from .operators.models import AS_TICKED, SELENITE_PT_models
from .operators.time import draw_trade
from .progress.background import draw_next_camera, draw_work
from .progress.head import SELENITE_PT_head, next_step
from .request import FIT_SETTINGS
from .result.panel import SELENITE_PT_result
from .rows.labels import with_labels
from .rows.lists import SELENITE_UL_owners, SELENITE_UL_rows
from .rows.panel import SELENITE_PT_material, SELENITE_PT_parameters
from .texts import field, paragraph, shown, translated

_TAB = {"bl_space_type": "VIEW_3D", "bl_region_type": "UI", "bl_category": "Selenite"}
#: Settings of a fit by what they are about.
_GROUPS = (
    ("Pictures", ("height", "spp", "depth", "physical_refraction")),
    (
        "Steps",
        ("iterations", "until_converged", "loss", "tolerance", "optimiser", "accumulate", "search"),
    ),
    ("Grids and Images", ("prior",)),
    ("Run", ("precision", "seed", "threads", "picture_spp")),
)


class SELENITE_UL_captures(bpy.types.UIList):
    """Camera and photo"""

    def draw_item(
        self,
        context: bpy.types.Context,
        layout: bpy.types.UILayout,
        _data: bpy.types.AnyType,
        item: bpy.types.PropertyGroup,
        _icon: int,
        _active_data: bpy.types.AnyType,
        _active_property: str,
        index: int,
    ) -> None:
        """Tick, id, photo. The id of a row that is off is not in use: its camera stands there."""
        row = layout.row(align=True)
        row.prop(item, "enabled", text="")
        if warning_rows.about(context.scene, warning_rows.of_capture(context.scene, index)):
            row.label(text="", icon="ERROR")
        name = item.camera.name if item.camera else translated("no camera")
        name = ids_of(context.scene)[index] or name
        row.label(text=name, icon="CAMERA_DATA", translate=False)
        if item.photo is None:
            row.label(text="", icon="ERROR")
        elif item.photo.name.rpartition(".")[0] != name:  # else the row would say it twice
            row.label(text=item.photo.name, icon="IMAGE_DATA", translate=False)


class SELENITE_PT_captures(bpy.types.Panel):
    """Cameras and their photos"""

    bl_idname = "SELENITE_PT_captures"
    bl_label = "Captures"
    bl_space_type, bl_region_type, bl_category = _TAB.values()

    def draw(self, context: bpy.types.Context) -> None:
        """List of photos, and the active one below."""
        settings, layout = context.scene.selenite, self.layout
        missing = state.why_native_is_missing()
        if missing:
            paragraph(
                layout,
                context,
                message(
                    "panels.selenite-cannot-work",
                    "Selenite cannot work: {missing}",
                    missing=missing,
                ),
                "ERROR",
            )
            return
        row = layout.row()
        row.template_list(
            "SELENITE_UL_captures", "", settings, "captures", settings, "active_capture", rows=3
        )
        column = row.column(align=True)
        column.operator("selenite.add_capture", text="", icon="ADD")
        column.operator("selenite.remove_capture", text="", icon="REMOVE")
        step, _ = next_step(context.scene)
        if step != "selenite.load_photos":  # else it is in the head
            layout.operator("selenite.load_photos", icon="FILE_FOLDER")
        layout.operator("selenite.import_reconstruction", icon="IMPORT")
        item = chosen(settings.captures, settings.active_capture)
        if item is None:
            return
        if item.camera is None or item.photo is None:
            _draw_pair(layout, item)
        subjects = warning_rows.of_capture(context.scene, settings.active_capture)
        warning_rows.draw(layout, context, warning_rows.about(context.scene, subjects))


class SELENITE_PT_capture(bpy.types.Panel):
    """Camera, photo, mask, lights and lens of the active capture"""

    bl_idname = "SELENITE_PT_capture"
    bl_label = "Active Capture"
    bl_parent_id = "SELENITE_PT_captures"
    bl_options = {"DEFAULT_CLOSED"}
    bl_space_type, bl_region_type, bl_category = _TAB.values()

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is an active one."""
        settings = context.scene.selenite
        return chosen(settings.captures, settings.active_capture) is not None

    def draw(self, context: bpy.types.Context) -> None:
        """How it was taken and what of it counts."""
        settings, layout = context.scene.selenite, self.layout
        item = chosen(settings.captures, settings.active_capture)
        _draw_pair(layout, item)
        layout.prop(item, "mask_path")
        capture_photo.draw(layout, item.how)
        capture_lights.draw(layout, item.lights)


class SELENITE_PT_fit(bpy.types.Panel):
    """Quality, start, and how the fit is doing"""

    bl_idname = "SELENITE_PT_fit"
    bl_label = "Fit"
    bl_space_type, bl_region_type, bl_category = _TAB.values()

    def draw(self, context: bpy.types.Context) -> None:
        """Quality and Start; while a fit runs its values and remarks."""
        settings, layout = context.scene.selenite, self.layout
        if state.RUN.is_active:
            _draw_running(layout, context)
            return
        column = layout.column()
        step, _ = next_step(context.scene)
        starts = ("selenite.start", "selenite.fit_models")
        if step not in starts:  # else these are in the head
            field(column, settings, "preset")
            field(column, settings, "body")
        field(column, settings, "stage_mode")
        if step not in starts:
            layout.operator(starts[settings.body != AS_TICKED], icon="PLAY")
        if not draw_work(layout, state.ESTIMATE):
            layout.operator("selenite.estimate", icon="TIME")
        for line in state.EXPECTED.get(context.scene.name, ()):
            paragraph(layout, context, line)
        _draw_notes(layout, context, state.RUN.done.result.notes if state.RUN.done else ())


class SELENITE_PT_advanced(bpy.types.Panel):
    """Settings that the quality sets, and what is seldom needed"""

    bl_idname = "SELENITE_PT_advanced"
    bl_label = "Advanced"
    bl_parent_id = "SELENITE_PT_fit"
    bl_options = {"DEFAULT_CLOSED"}
    bl_space_type, bl_region_type, bl_category = _TAB.values()

    def draw(self, context: bpy.types.Context) -> None:
        """Settings in groups, presets, and three buttons."""
        layout = self.layout
        layout.enabled = not state.RUN.is_active
        presets.draw(layout)
        for title, names in _GROUPS:
            layout.label(text=title)
            column = layout.column(align=True)
            for name in names:
                field(column, context.scene.selenite, name)
        layout.operator("selenite.resume", icon="RECOVER_LAST")
        batch.draw(layout, context)
        if not len(context.scene.selenite.results):  # else it stands below them
            draw_next_camera(layout, context)
        column = layout.column(align=True)
        field(column, context.scene.selenite, "trade_budget")
        draw_trade(layout, context)


class SELENITE_PT_cycles(bpy.types.Panel):
    """Whether Cycles shows what was fitted"""

    bl_idname = "SELENITE_PT_cycles"
    bl_label = "Cycles"
    bl_space_type, bl_region_type, bl_category = _TAB.values()

    def draw(self, context: bpy.types.Context) -> None:
        """The check of the result, whose progress is in the head, and the render settings that
        would spoil the final picture."""
        layout, check = self.layout, state.CHECK
        if check.job is None:
            layout.operator("selenite.check_in_cycles", icon="RENDER_STILL")
            for line in check.lines:
                paragraph(layout, context, line)
            if check.sheet is not None:
                layout.operator("selenite.show_sheet", icon="IMAGE_DATA")
        contents = check.contents.get(context.scene.name, Contents())
        found = remarks(context.scene, contents)
        if not any(item.spoils for item in found):
            layout.label(text="Render settings suit the fit", icon="CHECKMARK")
        else:
            layout.label(text="Final renders will differ:", icon="ERROR")
            layout.operator("selenite.set_cycles", icon="SCENE")
        for item in found:
            box = layout.box().column(align=True)
            icon = "ERROR" if item.spoils else "INFO"
            paragraph(box, context, f"{item.name}: {item.value}", icon)
            paragraph(box, context, item.cost)


def _draw_pair(layout: bpy.types.UILayout, item: bpy.types.PropertyGroup) -> None:
    """Which photo belongs to which camera."""
    column = layout.column(align=True)
    column.prop(item, "camera", text="", icon="CAMERA_DATA")
    column.template_ID(item, "photo", open="image.open")


def _draw_running(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Loss, values and remarks; the bar and the buttons are in the head of the tab."""
    fitting = state.RUN.fitting
    progress = fitting.progress if fitting is not None else None
    if fitting is None or progress is None:
        layout.label(text="Starting")
        return
    job = fitting.job
    if progress.phase == DESCENT:
        text = translated("Iteration {} of {}")
        layout.label(text=text.format(progress.iteration, progress.iterations))
    if stage := job.stage_title(progress):
        layout.label(text=f"{translated('Stage')} {stage}")
    if math.isfinite(progress.loss):
        layout.label(text=f"{translated('Loss')} {progress.loss:.5g}")
    for name, value in progress.values.items():
        text = with_labels(name, context.scene.selenite.rows)
        paragraph(layout, context, f"{text}  {'  '.join(f'{x:.3f}' for x in value)}")
    _draw_notes(layout, context, job.newest_notes)
    if fitting.recorder is not None and fitting.recorder.trouble:
        _draw_notes(layout, context, [fitting.recorder.trouble])


def _draw_notes(
    layout: bpy.types.UILayout, context: bpy.types.Context, notes: Sequence[str]
) -> None:
    """What is wrong with a fit, each remark in a box."""
    for note in notes:
        text = with_labels(shown(note), context.scene.selenite.rows)
        paragraph(layout.box(), context, text, "INFO")


assert {name for _, names in _GROUPS for name in names} == set(FIT_SETTINGS)

CLASSES = (
    SELENITE_UL_captures,
    SELENITE_UL_owners,
    SELENITE_UL_rows,
    SELENITE_PT_head,
    SELENITE_PT_models,
    SELENITE_PT_result,  # in sight at the end of a fit, and not there before
    SELENITE_PT_captures,
    SELENITE_PT_capture,
    SELENITE_PT_parameters,
    SELENITE_PT_fit,
    SELENITE_PT_advanced,
    SELENITE_PT_cycles,
    SELENITE_PT_material,
)
