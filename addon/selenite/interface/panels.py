# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar tab of the 3D View. Drawing computes nothing."""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy

from ..cycles_check.render_settings import Contents, remarks
from ..fit_run.job import DESCENT
from ..scene_read.photos import ids_of
from . import capture_lights, capture_photo, field_rows, state
from .request import FIT_SETTINGS

_TAB = {"bl_space_type": "VIEW_3D", "bl_region_type": "UI", "bl_category": "Selenite"}


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
        name = item.camera.name if item.camera else "no camera"
        row.label(text=ids_of(context.scene)[index] or name, icon="CAMERA_DATA")
        row.label(text=item.photo.name if item.photo else "no photo", icon="IMAGE_DATA")


class SELENITE_UL_rows(bpy.types.UIList):
    """Parameter and its value"""

    def draw_item(
        self,
        _context: bpy.types.Context,
        layout: bpy.types.UILayout,
        _data: bpy.types.AnyType,
        item: bpy.types.PropertyGroup,
        _icon: int,
        _active_data: bpy.types.AnyType,
        _active_property: str,
    ) -> None:
        """Tick, name, current value; greyed with a lock where it cannot be fitted."""
        row = layout.row(align=True)
        row.enabled = not item.reason
        row.prop(item, "enabled", text="")
        parts = row.split(factor=0.6)
        parts.label(
            text=f"{item.parameter}  {item.owner}", icon="LOCKED" if item.reason else "NONE"
        )
        parts.label(text=item.value)


class SELENITE_PT_captures(bpy.types.Panel):
    bl_idname = "SELENITE_PT_captures"
    bl_label = "Captures"
    bl_space_type, bl_region_type, bl_category = _TAB.values()

    def draw(self, context: bpy.types.Context) -> None:
        """List of photos, and the active one below."""
        settings, layout = context.scene.selenite, self.layout
        missing = state.why_native_is_missing()
        if missing:
            layout.label(text="Selenite cannot work:", icon="ERROR")
            for line in _wrapped(missing):
                layout.label(text=line)
            return
        row = layout.row()
        row.template_list(
            "SELENITE_UL_captures", "", settings, "captures", settings, "active_capture", rows=3
        )
        column = row.column(align=True)
        column.operator("selenite.add_capture", text="", icon="ADD")
        column.operator("selenite.remove_capture", text="", icon="REMOVE")
        layout.operator("selenite.load_photos", icon="FILE_FOLDER")
        layout.operator("selenite.import_reconstruction", icon="IMPORT")
        if settings.active_capture < len(settings.captures):
            item = settings.captures[settings.active_capture]
            layout.prop(item, "camera")
            layout.template_ID(item, "photo", open="image.open")
            layout.prop(item, "mask_path")
            capture_photo.draw(layout, item.how)
            capture_lights.draw(layout, item.lights)


class SELENITE_PT_parameters(bpy.types.Panel):
    bl_idname = "SELENITE_PT_parameters"
    bl_label = "Parameters"
    bl_space_type, bl_region_type, bl_category = _TAB.values()

    def draw(self, context: bpy.types.Context) -> None:
        """List of parameters; start, bounds and rate of the active one below."""
        settings, layout = context.scene.selenite, self.layout
        row = layout.row(align=True)
        row.operator("selenite.refresh_rows", text="Refresh", icon="FILE_REFRESH")
        row.operator("selenite.reset_rows", text="Reset", icon="LOOP_BACK")
        for text in state.SHAPES.get(context.scene.name, ()):
            box = layout.box().column(align=True)
            first, *rest = _wrapped(text)
            box.label(text=first, icon="ERROR")
            for line in rest:
                box.label(text=line)
        if not len(settings.rows):
            return
        layout.template_list(
            "SELENITE_UL_rows", "", settings, "rows", settings, "active_row", rows=6
        )
        if settings.active_row >= len(settings.rows):
            return
        item = settings.rows[settings.active_row]
        for line in _wrapped(item.note) if item.note else ():
            layout.label(text=line)
        if item.reason:
            for line in _wrapped(item.reason):
                layout.label(text=line)
            return
        for line in _wrapped(item.help):
            layout.label(text=line)
        column = layout.column()
        column.use_property_split = True
        for name in field_rows.shown(item) if field_rows.is_field(item) else ():
            column.prop(item, name)
        column.prop(item, "use_start")
        if item.use_start:
            for index in range(item.width):
                column.prop(item, "start", index=index, text="Start" if index == 0 else "")
        column.prop(item, "minimum")
        column.prop(item, "maximum")
        column.prop(item, "learning_rate")


class SELENITE_PT_fit(bpy.types.Panel):
    bl_idname = "SELENITE_PT_fit"
    bl_label = "Fit"
    bl_space_type, bl_region_type, bl_category = _TAB.values()

    def draw(self, context: bpy.types.Context) -> None:
        """Quality and Start; while a fit runs its progress, Stop and Cancel."""
        settings, layout = context.scene.selenite, self.layout
        if state.STAGES.job is not None:
            layout.label(text="Choosing stages")
            _background(layout, state.STAGES, "selenite.cancel")
            return
        if state.RUN.job is None:
            layout.prop(settings, "preset")
            if not _background(layout, state.ESTIMATE, "selenite.cancel_estimate"):
                layout.operator("selenite.estimate", icon="TIME")
            for line in state.EXPECTED.get(context.scene.name, ()):
                _text(layout, line)
            layout.prop(settings, "stage_mode")
            layout.operator("selenite.start", icon="PLAY")
            if state.RUN.message:
                for line in _wrapped(state.RUN.message):
                    layout.label(text=line)
            _staging(layout)
            _notes(layout, state.RUN.result["notes"] if state.RUN.result else ())
            return
        progress = state.RUN.progress
        if progress is None:
            layout.label(text="Starting")
        else:
            left = progress.seconds_left
            text = progress.phase.capitalize()
            if progress.phase == DESCENT:
                text = f"{progress.iteration} of {progress.iterations}"
            text += "" if math.isnan(left) else f", {left:.0f} s left"
            _bar(layout, progress.fraction, text)
            if progress.stage:
                layout.label(text=f"Stage {progress.stage}")
            _staging(layout)
            layout.label(text=f"Loss {progress.loss:.5g}")
            for name, value in progress.values.items():
                layout.label(text=f"{name}  {'  '.join(f'{x:.3f}' for x in value)}")
            _notes(layout, progress.notes)
        if state.RUN.recorder is not None and state.RUN.recorder.trouble:
            _notes(layout, [state.RUN.recorder.trouble])
        row = layout.row(align=True)
        row.operator("selenite.stop", text="Stop", icon="CHECKMARK")
        row.operator("selenite.cancel", icon="X")


class SELENITE_PT_advanced(bpy.types.Panel):
    bl_idname = "SELENITE_PT_advanced"
    bl_label = "Advanced"
    bl_parent_id = "SELENITE_PT_fit"
    bl_options = {"DEFAULT_CLOSED"}
    bl_space_type, bl_region_type, bl_category = _TAB.values()

    def draw(self, context: bpy.types.Context) -> None:
        """Settings that the preset sets."""
        column = self.layout.column()
        column.use_property_split = True
        column.enabled = state.RUN.job is None
        for name in FIT_SETTINGS:
            column.prop(context.scene.selenite, name)
        column.operator("selenite.resume", icon="RECOVER_LAST")
        if not len(context.scene.selenite.results):  # else it stands below them
            _next_camera(column)
        column.prop(context.scene.selenite, "trade_budget")
        column.operator("selenite.trade", icon="GRAPH")
        if state.TRADE.step is not None:
            _bar(column, state.TRADE.step.fraction, state.TRADE.step.text)
        for line in state.TRADE.lines:
            column.label(text=line)


class SELENITE_PT_result(bpy.types.Panel):
    bl_idname = "SELENITE_PT_result"
    bl_label = "Result"
    bl_space_type, bl_region_type, bl_category = _TAB.values()

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a result."""
        return len(context.scene.selenite.results) > 0

    def draw(self, context: bpy.types.Context) -> None:
        """Start and fitted values, Apply and Restore."""
        settings, layout = context.scene.selenite, self.layout
        for row in settings.results:
            layout.label(text=f"{row.owner}: {row.parameter}")
            for text in row.text.splitlines():
                for line in _wrapped(text):
                    layout.label(text=line, icon="BLANK1")
        buttons = layout.row(align=True)
        buttons.operator("selenite.apply", icon="CHECKMARK")
        buttons.operator("selenite.restore", text="Restore", icon="LOOP_BACK")
        _next_camera(layout)
        layout.prop(settings, "output")
        layout.operator("selenite.save_result", icon="FILE_TICK")


class SELENITE_PT_cycles(bpy.types.Panel):
    bl_idname = "SELENITE_PT_cycles"
    bl_label = "Cycles"
    bl_space_type, bl_region_type, bl_category = _TAB.values()

    def draw(self, context: bpy.types.Context) -> None:
        """The check of the result, and the render settings that would spoil the final picture."""
        layout, check = self.layout, state.CHECK
        if check.job is None:
            layout.operator("selenite.check_in_cycles", icon="RENDER_STILL")
            for line in (check.message, *check.lines):
                for part in _wrapped(line) if line else ():
                    layout.label(text=part)
            if check.sheet is not None:
                layout.operator("selenite.show_sheet", icon="IMAGE_DATA")
        else:
            progress = check.progress
            if progress is not None:
                _bar(layout, progress.fraction, progress.text)
            layout.operator("selenite.cancel_check", icon="X")
        contents = check.contents.get(context.scene.name, Contents())
        found = remarks(context.scene, contents)
        if not any(item.spoils for item in found):
            layout.label(text="Render settings suit the fit", icon="CHECKMARK")
        else:
            layout.label(text="Final renders will differ:", icon="ERROR")
            layout.operator("selenite.set_cycles", icon="SCENE")
        for item in found:
            box = layout.box().column(align=True)
            box.label(text=f"{item.name}: {item.value}", icon="ERROR" if item.spoils else "INFO")
            for part in _wrapped(item.cost):
                box.label(text=part)


def _next_camera(layout: bpy.types.UILayout) -> None:
    """The button, how far it has come, and what was found."""
    if not _background(layout, state.NEXT, "selenite.cancel_suggestion"):
        layout.operator("selenite.suggest_camera", icon="OUTLINER_OB_CAMERA")
    for line in state.NEXT.lines:
        _text(layout, line)


def _background(layout: bpy.types.UILayout, work: state.Background, cancel: str) -> bool:
    """Whether it runs: then how far it has come, and the button that ends it."""
    if work.job is None:
        return False
    _bar(
        layout,
        work.step.fraction if work.step else 0.0,
        work.step.text if work.step else "Starting",
    )
    layout.operator(cancel, icon="X")
    return True


def _staging(layout: bpy.types.UILayout) -> None:
    """The stages that were chosen for the run, and why."""
    if state.RUN.plan is not None and state.RUN.plan.request.staging:
        _text(layout, f"Stages: {state.RUN.plan.request.staging}")


def _text(layout: bpy.types.UILayout, text: str) -> None:
    """A sentence, in lines close together."""
    column = layout.column(align=True)
    for part in _wrapped(text):
        column.label(text=part)


def _bar(layout: bpy.types.UILayout, fraction: float, text: str) -> None:
    if hasattr(layout, "progress"):  # 4.0 on
        layout.progress(factor=fraction, text=text)
    else:
        layout.label(text=f"{fraction:.0%}: {text}")


def _notes(layout: bpy.types.UILayout, notes: Sequence[str]) -> None:
    """What is wrong with a fit, each remark in a box."""
    for note in notes:
        box = layout.box().column(align=True)
        for index, line in enumerate(_wrapped(note, width=27)):
            box.label(text=line, icon="NONE" if index else "INFO")


def _wrapped(text: str, width: int = 32) -> list[str]:
    """A sentence in lines that fit the sidebar."""
    lines = [""]
    for word in text.split():
        if lines[-1] and len(lines[-1]) + len(word) >= width:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return lines


CLASSES = (
    SELENITE_UL_captures,
    SELENITE_UL_rows,
    SELENITE_PT_captures,
    SELENITE_PT_parameters,
    SELENITE_PT_fit,
    SELENITE_PT_advanced,
    SELENITE_PT_result,
    SELENITE_PT_cycles,
)
