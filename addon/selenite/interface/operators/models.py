# SPDX-License-Identifier: GPL-3.0-or-later
"""Models of a body in turn, on a copy of the file; the chosen one replaces the material."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import cast

import bpy

from ...capture.scene_captures import captures_of
from ...fit import model_chain
from ...fit.model_chain import Tried
from ...messages import joined, packed, unpacked
from ...problems import BadInput, Problem, listed
from ...scene_read.blender_process import BlenderProcess
from ...scene_read.scene import read_scene
from ...write_back import body_models
from ..chosen import chosen
from ..output_folder import output_folder
from ..problem_reports import report_problems
from ..progress.notice import scroll_up
from ..request import fit_settings, refresh_rows
from ..rows.owners import active_owner
from ..running.command import RunsCommand, command_job, settings_words
from ..state import MODELS, is_idle
from ..texts import announce, paragraph

#: The choice of the panel that fits the ticked parameters.
AS_TICKED = "ticked"
#: Of problems with that choice.
_TITLE = "Body"


class SELENITE_OT_fit_models(RunsCommand):
    """Fit models of the body in turn, each from the last one, as long as they explain photos better
    that no fit sees. Esc stops and keeps the best"""

    bl_idname = "selenite.fit_models"
    bl_label = "Fit Models"
    bl_options = {"UNDO"}

    command = MODELS
    failure = "The models are not fitted"

    def _job(self, context: bpy.types.Context) -> tuple[BlenderProcess, Sequence[str]]:
        scene = context.scene
        problems: list[Problem] = []
        model_chain.with_hold_out(captures_of(scene), _TITLE, problems)
        material = _material(scene, problems)
        if material is None or problems:
            raise BadInput(problems)
        scroll_up()
        job = command_job("selenite-models-")
        model = "auto" if scene.selenite.body == AS_TICKED else scene.selenite.body
        words = ["fit", str(job.scene_file), f"--model={material.name}:{model}"]
        words += [
            f"--out={output_folder(scene)}",
            *settings_words(fit_settings(scene), scene.selenite.preset),
        ]
        return job, words

    def _end(self, scene: bpy.types.Scene, report: Mapping[str, object]) -> set[str]:
        settings = scene.selenite
        tried = [
            Tried.of_json(row) for row in cast("Sequence[Mapping[str, object]]", report["models"])
        ]
        settings.models.clear()
        for one in tried:
            row = settings.models.add()
            row.name, row.kept = one.step.name, one.kept
            row.error = -1.0 if one.found.error is None else one.found.error
            row.scene = str(one.found.scene)
        settings.active_model = max(at for at, one in enumerate(tried) if one.kept)
        settings.models_sentence = packed([model_chain.in_short(tried)])
        settings.models_material = bpy.data.materials.get(str(report["model_of"]))
        settings.model_applied = ""
        settings.results.clear()  # of the material as it was
        MODELS.lines = []
        announce(self, {"INFO"}, joined(" ", unpacked(settings.models_sentence)))
        scroll_up()
        return {"FINISHED"}


class SELENITE_OT_apply_model(bpy.types.Operator):
    """Give the body the material of the chosen model, with its grids. The one before stays in the
    file"""

    bl_idname = "selenite.apply_model"
    bl_label = "Apply Model"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is one that is not applied."""
        settings = context.scene.selenite
        row = chosen(settings.models, settings.active_model)
        return row is not None and row.name != settings.model_applied and is_idle()

    def execute(self, context: bpy.types.Context) -> set[str]:
        """In place of one that was applied before; one undo step."""
        settings = context.scene.selenite
        row = chosen(settings.models, settings.active_model)
        material = settings.models_material
        try:
            if material is None:
                cure = "undo its removal, or fit again"
                raise BadInput(Problem(_TITLE, "its material is gone", cure))
            if settings.model_applied:
                material = body_models.give_back(context.scene, material)
            settings.models_material = body_models.take(context.scene, material, Path(row.scene))
        except BadInput as error:
            report_problems(self, error)
            return {"CANCELLED"}
        settings.model_applied, settings.body = row.name, AS_TICKED
        return _refreshed(context)


class SELENITE_OT_restore_model(bpy.types.Operator):
    """Give the body the material back that it had before"""

    bl_idname = "selenite.restore_model"
    bl_label = "Restore Material"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """A model was applied."""
        settings = context.scene.selenite
        return bool(settings.model_applied) and settings.models_material is not None and is_idle()

    def execute(self, context: bpy.types.Context) -> set[str]:
        """One undo step."""
        settings = context.scene.selenite
        try:
            before = body_models.give_back(context.scene, settings.models_material)
        except BadInput as error:
            report_problems(self, error)
            return {"CANCELLED"}
        settings.models_material, settings.model_applied = before, ""
        return _refreshed(context)


class SELENITE_UL_models(bpy.types.UIList):
    """Model and how far its renders are off"""

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
        """Name, error of the photos held out, a tick for what was kept."""
        parts = layout.split(factor=0.65)
        parts.label(text=item.name.capitalize(), icon="CHECKMARK" if item.kept else "BLANK1")
        parts.label(text=f"{100 * item.error:.3g} %" if item.error >= 0 else "", translate=False)


class SELENITE_PT_models(bpy.types.Panel):
    """Which model of the body explains the photos"""

    bl_idname = "SELENITE_PT_models"
    bl_label = "Models"
    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "Selenite"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Some were fitted."""
        return len(context.scene.selenite.models) > 0

    def draw(self, context: bpy.types.Context) -> None:
        """By how much each has helped, the list, and what becomes of the chosen one."""
        settings, layout = context.scene.selenite, self.layout
        if not news(settings):  # else it is in the head
            for text in unpacked(settings.models_sentence):
                paragraph(layout, context, text)
        layout.template_list(
            "SELENITE_UL_models", "", settings, "models", settings, "active_model", rows=3
        )
        buttons = layout.row(align=True)
        buttons.operator("selenite.apply_model", icon="CHECKMARK")
        buttons.operator("selenite.restore_model", text="Restore", icon="LOOP_BACK")


def news(settings: bpy.types.PropertyGroup) -> list[str]:
    """By how much each model has helped, until one is applied."""
    waits = len(settings.models) and not settings.model_applied
    return unpacked(settings.models_sentence) if waits else []


def next_step(settings: bpy.types.PropertyGroup) -> tuple[str, str] | None:
    """(operator, icon) of what comes next where a model is asked for; None where none is."""
    if settings.body == AS_TICKED:
        return None
    if len(settings.models) and not settings.model_applied:
        return "selenite.apply_model", "CHECKMARK"
    return "selenite.fit_models", "PLAY"


def _material(scene: bpy.types.Scene, problems: list[Problem]) -> bpy.types.Material | None:
    """The one whose parameters are listed, or the only one of the scene."""
    owner = active_owner(scene.selenite)
    if owner is not None and owner.material is not None:
        found: bpy.types.Material = owner.material
        return found
    used = {
        slot.material.name: slot.material
        for item in scene.objects
        for slot in item.material_slots
        if slot.material is not None
    }
    if len(used) == 1:
        return next(iter(used.values()))
    cure = "choose the material in the list of parameters"
    problems.append(Problem(_TITLE, f"its material is not clear: {listed(used)}", cure))
    return None


def _refreshed(context: bpy.types.Context) -> set[str]:
    """The parameters are others now."""
    if bpy.app.background:
        refresh_rows(context.scene, read_scene(context.scene, surveys=False, bakes=False))
    else:
        bpy.ops.selenite.update_rows("INVOKE_DEFAULT")
    return {"FINISHED"}


CLASSES = (
    SELENITE_OT_fit_models,
    SELENITE_OT_apply_model,
    SELENITE_OT_restore_model,
    SELENITE_UL_models,
)
