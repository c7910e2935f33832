# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel's stages: by name, or an own list that is filled with the ticked parameters."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy
from bpy.props import EnumProperty, StringProperty

from .. import parameters
from ..capture.request import CaptureRequest
from ..fit.staging.request import USUAL, StageRequest, read_stages, stages_by_name
from ..messages import message
from ..problems import BadInput, Problem
from . import state
from .chosen import chosen
from .problem_reports import report_problems
from .rows.labels import with_labels
from .texts import announce, paragraph

_LABEL = 0.5  # of the width


def row_name(row: bpy.types.PropertyGroup) -> str:
    """A row's parameter as stages name it."""
    return parameters.join_name(row.owner, row.parameter)


def own_stages(scene: bpy.types.Scene, problems: list[Problem]) -> tuple[StageRequest, ...]:
    """The list of the panel; empty unless it is chosen."""
    settings = scene.selenite
    if settings.stage_mode != "own":
        return ()
    if not len(settings.stages):
        cure = "tick parameters and add a stage, or choose All at Once"
        problems.append(Problem("Stages", "the own list is empty", cure))
    known = {row_name(row) for row in settings.rows}
    found = []
    for number, item in enumerate(settings.stages, start=1):
        names = tuple(item.parameters.splitlines())
        for name in names:
            if name not in known:
                cure = "refresh the parameters and let the stage take the ticked ones"
                title = f"Stage {number} '{item.name}'"
                problems.append(
                    Problem(
                        title,
                        message("stages.not-list", "'{name}' is not in the list", name=name),
                        cure,
                    )
                )
        own = (item.iterations or None, item.spp or None, item.height or None)
        found.append(StageRequest(item.name, names, *own))
    return tuple(found)


def named_stages(
    scene: bpy.types.Scene,
    names: Sequence[str],
    captures: Sequence[CaptureRequest],
    problems: list[Problem],
) -> tuple[StageRequest, ...]:
    """The stages of a preset for the unknowns `names`; none where everything is fitted at once."""
    settings = scene.selenite
    if settings.stage_mode == "own" or not names:
        return ()
    mode = settings.stage_mode or USUAL  # "": a file of an earlier version, which had another one
    return stages_by_name(mode, names, settings.iterations, problems, captures)


class SELENITE_OT_add_stage(bpy.types.Operator):
    """Add a stage that fits the ticked parameters"""

    bl_idname = "selenite.add_stage"
    bl_label = "Add Stage"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """At the end of the list; it becomes the active one."""
        settings = context.scene.selenite
        names = _ticked(settings)
        if not names:
            announce(self, {"ERROR"}, "No parameter is ticked; tick what the stage fits")
            return {"CANCELLED"}
        taken = {item.name for item in settings.stages}
        number = len(settings.stages) + 1
        while f"stage {number}" in taken:
            number += 1
        item = settings.stages.add()
        item.name, item.parameters = f"stage {number}", "\n".join(names)
        settings.active_stage = len(settings.stages) - 1
        return {"FINISHED"}


class _OnActiveStage:
    """Base of the operators that need one."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is an active stage."""
        return _active(context.scene.selenite) is not None


class SELENITE_OT_take_ticked(_OnActiveStage, bpy.types.Operator):
    """Let the active stage fit the parameters that are ticked now"""

    bl_idname = "selenite.take_ticked"
    bl_label = "Take Ticked Parameters"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """In place of those that it had."""
        settings = context.scene.selenite
        names = _ticked(settings)
        if not names:
            announce(self, {"ERROR"}, "No parameter is ticked; tick what the stage fits")
            return {"CANCELLED"}
        _active(settings).parameters = "\n".join(names)
        return {"FINISHED"}


class SELENITE_OT_remove_stage(_OnActiveStage, bpy.types.Operator):
    """Remove the active stage"""

    bl_idname = "selenite.remove_stage"
    bl_label = "Remove Stage"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """The one before it becomes active."""
        settings = context.scene.selenite
        settings.stages.remove(settings.active_stage)
        settings.active_stage = max(0, settings.active_stage - 1)
        return {"FINISHED"}


class SELENITE_OT_move_stage(_OnActiveStage, bpy.types.Operator):
    """Move the active stage in the list"""

    bl_idname = "selenite.move_stage"
    bl_label = "Move Stage"
    bl_options = {"REGISTER", "UNDO"}

    direction: EnumProperty(items=(("UP", "Up", "", 0), ("DOWN", "Down", "", 1)))

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Stays in the list at its ends."""
        settings = context.scene.selenite
        step = -1 if self.direction == "UP" else 1
        target = min(max(settings.active_stage + step, 0), len(settings.stages) - 1)
        settings.stages.move(settings.active_stage, target)
        settings.active_stage = target
        return {"FINISHED"}


class SELENITE_OT_load_stages(bpy.types.Operator):
    """Read stages from a file, as --stages of the command line does"""

    bl_idname = "selenite.load_stages"
    bl_label = "Load Stages"
    bl_options = {"REGISTER", "UNDO"}

    filepath: StringProperty(subtype="FILE_PATH")
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Opens the file browser."""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """In place of the list; a bad file changes nothing."""
        try:
            found = read_stages(Path(bpy.path.abspath(self.filepath)))
        except BadInput as error:
            report_problems(self, error)
            return {"CANCELLED"}
        settings = context.scene.selenite
        settings.stages.clear()
        for stage in found:
            item = settings.stages.add()
            item.name, item.parameters = stage.name, "\n".join(stage.parameters)
            for key, value in stage.overrides().items():
                setattr(item, key, value)
        settings.active_stage, settings.stage_mode = 0, "own"
        return {"FINISHED"}


class SELENITE_UL_stages(bpy.types.UIList):
    """Stage and how many parameters it fits"""

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
        """Name, editable, and the number of parameters."""
        parts = layout.split(factor=0.85)
        parts.prop(item, "name", text="", emboss=False)
        parts.label(text=str(len(item.parameters.splitlines())))


class SELENITE_PT_stages(bpy.types.Panel):
    """What is fitted first and what later"""

    bl_idname = "SELENITE_PT_stages"
    bl_label = "Stages"
    bl_parent_id = "SELENITE_PT_fit"
    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "Selenite"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Only for an own list."""
        return context.scene.selenite.stage_mode == "own"

    def draw(self, context: bpy.types.Context) -> None:
        """The list in the order of the run; the active stage below."""
        settings, layout = context.scene.selenite, self.layout
        layout.enabled = not state.RUN.is_active
        row = layout.row()
        row.template_list(
            "SELENITE_UL_stages", "", settings, "stages", settings, "active_stage", rows=3
        )
        column = row.column(align=True)
        column.operator("selenite.add_stage", text="", icon="ADD")
        column.operator("selenite.remove_stage", text="", icon="REMOVE")
        column.operator("selenite.move_stage", text="", icon="TRIA_UP").direction = "UP"
        column.operator("selenite.move_stage", text="", icon="TRIA_DOWN").direction = "DOWN"
        layout.operator("selenite.load_stages", icon="FILE_FOLDER")
        item = _active(settings)
        if item is None:
            layout.label(text="Tick parameters, then add")
            return
        for name in item.parameters.splitlines():
            paragraph(layout, context, with_labels(name, context.scene.selenite.rows))
        layout.operator("selenite.take_ticked", icon="CHECKMARK")
        column = layout.column()
        for name in ("iterations", "spp", "height"):
            parts = column.split(factor=_LABEL, align=True)
            parts.prop(item, f"own_{name}")
            if getattr(item, name):
                parts.prop(item, name, text="")
            else:
                parts.label(text="As in the fit")


def _ticked(settings: bpy.types.PropertyGroup) -> list[str]:
    return [row_name(row) for row in settings.rows if row.enabled]


def _active(settings: bpy.types.PropertyGroup) -> bpy.types.PropertyGroup | None:
    found: bpy.types.PropertyGroup | None = chosen(settings.stages, settings.active_stage)
    return found


CLASSES = (
    SELENITE_OT_add_stage,
    SELENITE_OT_take_ticked,
    SELENITE_OT_remove_stage,
    SELENITE_OT_move_stage,
    SELENITE_OT_load_stages,
    SELENITE_UL_stages,
    SELENITE_PT_stages,
)
