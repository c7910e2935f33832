# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators of the list of parameters."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty

from ...scene_read.scene import read_scene, reading
from ...scene_read.values import SceneValues
from .. import request
from ..captures.examining import examine
from ..rows.owners import active_owner, owns
from ..texts import announce
from ..ticking import ReadsScene, built
from .filling import fill, tick_usual, tick_usual_of_first


class _Refreshes(ReadsScene, bpy.types.Operator):  # type: ignore[misc]
    """Base of what lists the parameters: in a window Blender reads the scene in a thread."""

    usual: BoolProperty(
        options={"HIDDEN", "SKIP_SAVE"}, description="Also tick the usual parameters"
    )
    examines: BoolProperty(
        options={"HIDDEN", "SKIP_SAVE"}, description="Also compare the photos with the cameras"
    )

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Blender stays usable."""
        return self._read(context, reading(context.scene, bakes=False))

    def execute(self, context: bpy.types.Context) -> set[str]:
        """At once. Ticks and bounds of rows that are known already stay."""
        values = built(
            self, lambda: read_scene(context.scene, surveys=bpy.app.background, bakes=False)
        )
        return {"CANCELLED"} if values is None else self._with(context, values)

    def _with(self, context: bpy.types.Context, found: SceneValues) -> set[str]:
        for problem in fill(context.scene, found):
            announce(self, {"WARNING"}, problem.line())
        if self.usual:
            tick_usual_of_first(context.scene.selenite)
        if self.examines:
            examine(context.scene, found)
        return {"FINISHED"}


class SELENITE_OT_refresh_rows(_Refreshes):
    """List every parameter of the materials, lights and world of the scene; ticks and bounds of
    known ones stay"""

    bl_idname = "selenite.refresh_rows"
    bl_label = "Refresh Parameters"
    bl_options = {"REGISTER", "UNDO"}


class SELENITE_OT_update_rows(_Refreshes):
    """List the parameters as a part of what has just been done, whose undo step this belongs to"""

    bl_idname = "selenite.update_rows"
    bl_label = "Update Parameters"
    bl_options = {"INTERNAL"}


class SELENITE_OT_reset_rows(_Refreshes):
    """Set start, bounds and rate of every parameter to their defaults"""

    bl_idname = "selenite.reset_rows"
    bl_label = "Reset Parameters"
    bl_options = {"REGISTER", "UNDO"}

    def _with(self, context: bpy.types.Context, found: SceneValues) -> set[str]:
        """Also takes the current values from what was read."""
        for row in context.scene.selenite.rows:
            request.reset_row(row, request.owner_of(row, found), found)
        return {"FINISHED"}


class _Ticks(bpy.types.Operator):
    """Base of what acts on the rows of the active owner."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Something is listed."""
        return active_owner(context.scene.selenite) is not None


class SELENITE_OT_tick_usual(_Ticks):
    """Tick what is usually unknown: of a material base colour, roughness, transmission and IOR, of
    a lamp its power, of the world its strength. Locked ones are left out"""

    bl_idname = "selenite.tick_usual"
    bl_label = "Usual"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Of the active owner; the ticks of others stay."""
        settings = context.scene.selenite
        owner = active_owner(settings)
        if owner is None or not tick_usual(settings, owner):
            announce(
                self, {"WARNING"}, "All of them are locked; Show Locked and the tooltips say why"
            )
            return {"CANCELLED"}
        return {"FINISHED"}


class SELENITE_OT_untick(_Ticks):
    """Untick every parameter of the chosen material, lamp or world"""

    bl_idname = "selenite.untick"
    bl_label = "None"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """The ticks of others stay."""
        settings = context.scene.selenite
        owner = active_owner(settings)
        for row in settings.rows:
            if owner is not None and owns(owner, row):
                row.enabled = False
        return {"FINISHED"}


CLASSES = (
    SELENITE_OT_refresh_rows,
    SELENITE_OT_update_rows,
    SELENITE_OT_reset_rows,
    SELENITE_OT_tick_usual,
    SELENITE_OT_untick,
)
