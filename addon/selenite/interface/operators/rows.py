# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators of the list of parameters."""

from __future__ import annotations

import bpy

from ...native import NativeUnavailable
from ...scene_read.scene import read_scene
from .. import request
from ..rows.owners import active_owner
from ..texts import announce
from .filling import list_parameters, tick_usual


class SELENITE_OT_refresh_rows(bpy.types.Operator):
    """List every parameter of the materials, lights and world of the scene; ticks and bounds of
    known ones stay"""

    bl_idname = "selenite.refresh_rows"
    bl_label = "Refresh Parameters"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Ticks and bounds of rows that are known already stay."""
        try:
            problems = list_parameters(context.scene)
        except NativeUnavailable as error:
            announce(self, {"ERROR"}, str(error))
            return {"CANCELLED"}
        for problem in problems:
            announce(self, {"WARNING"}, problem.line())
        return {"FINISHED"}


class SELENITE_OT_reset_rows(bpy.types.Operator):
    """Set start, bounds and rate of every parameter to their defaults"""

    bl_idname = "selenite.reset_rows"
    bl_label = "Reset Parameters"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Also reads the current values again."""
        try:
            values = read_scene(context.scene)
            for row in context.scene.selenite.rows:
                request.reset_row(row, request.owner_of(row, values), values)
        except NativeUnavailable as error:
            announce(self, {"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class SELENITE_OT_tick_usual(bpy.types.Operator):
    """Tick what is usually unknown: of a material base colour, roughness, transmission and IOR, of
    a lamp its power, of the world its strength. Locked ones are left out"""

    bl_idname = "selenite.tick_usual"
    bl_label = "Usual"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Something is listed."""
        return active_owner(context.scene.selenite) is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Of the active owner; the ticks of others stay."""
        settings = context.scene.selenite
        owner = active_owner(settings)
        if owner is None or not tick_usual(settings, owner.name):
            announce(
                self, {"WARNING"}, "All of them are locked; Show Locked and the tooltips say why"
            )
            return {"CANCELLED"}
        return {"FINISHED"}


class SELENITE_OT_untick(bpy.types.Operator):
    """Untick every parameter of the chosen material, lamp or world"""

    bl_idname = "selenite.untick"
    bl_label = "None"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Something is listed."""
        return active_owner(context.scene.selenite) is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        """The ticks of others stay."""
        settings = context.scene.selenite
        owner = active_owner(settings)
        for row in settings.rows:
            if owner is not None and row.owner == owner.name:
                row.enabled = False
        return {"FINISHED"}


CLASSES = (
    SELENITE_OT_refresh_rows,
    SELENITE_OT_reset_rows,
    SELENITE_OT_tick_usual,
    SELENITE_OT_untick,
)
