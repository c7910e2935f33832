# SPDX-License-Identifier: GPL-3.0-or-later
"""Apply and restore: the only operators that change materials, lights and world."""

from __future__ import annotations

import bpy

from ... import write_back
from ...parameters import Values
from ...problems import BadInput, Problem
from ...scene_read.scene import millimetres, read_scene, reading
from ...scene_read.values import Owner, SceneValues
from ...write_back import Key
from ...write_back import grids as grid_objects
from ..problem_reports import report_problems
from ..request import refresh_rows, show_current
from ..result.kept import three
from ..rows import fields as field_rows
from ..state import is_idle
from ..texts import announce
from ..ticking import ReadsScene, built


class SELENITE_OT_apply(ReadsScene, bpy.types.Operator):  # type: ignore[misc]
    """Write the fitted values to materials, lights and world"""

    bl_idname = "selenite.apply"
    bl_label = "Apply"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a result that is not applied."""
        settings = context.scene.selenite
        if not len(settings.results) or settings.applied:
            return False
        return not any(map(field_rows.is_field, settings.results)) or super().poll(context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Where a field is to be shown, Blender stays usable while the scene is read."""
        if not any(map(field_rows.is_field, context.scene.selenite.results)):
            return self._with(context, None)
        return self._read(context, reading(context.scene, bakes=False))

    def execute(self, context: bpy.types.Context) -> set[str]:
        """At once."""
        if not any(map(field_rows.is_field, context.scene.selenite.results)):
            return self._with(context, None)
        values = built(self, lambda: read_scene(context.scene, surveys=False, bakes=False))
        return {"CANCELLED"} if values is None else self._with(context, values)

    def _with(self, context: bpy.types.Context, found: SceneValues | None) -> set[str]:
        """All values or none; one undo step. found: where there are fields."""
        settings = context.scene.selenite
        grids = any(map(field_rows.is_grid, settings.results))
        missing = grid_objects.why_not() if grids else ""
        try:
            if missing and all(map(field_rows.is_grid, settings.results)):
                cause, _, cure = missing.partition(": ")
                raise BadInput(Problem("Fitted grids", f"{cause} and stay in their files", cure))
            before = _write(context.scene, "value")
        except BadInput as error:
            report_problems(self, error)
            return {"CANCELLED"}
        try:
            lines = field_rows.apply(context.scene, found, with_grids=not missing) if found else []
        except BadInput as error:
            _put(context.scene, before)
            report_problems(self, error)
            return {"CANCELLED"}
        for row in settings.results:
            if not field_rows.is_field(row):
                row.original = three(before[row.owner, row.parameter])
        for line in lines:
            announce(self, {"INFO"}, line)
        if missing:
            announce(self, {"WARNING"}, f"The fitted grids stay in their files: {missing}")
        settings.applied = True
        _refresh(context, "value")
        return {"FINISHED"}


class SELENITE_OT_restore(bpy.types.Operator):
    """Put back the values that stood in the scene before Apply"""

    bl_idname = "selenite.restore"
    bl_label = "Restore Originals"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """A result was applied."""
        return context.scene.selenite.applied

    def execute(self, context: bpy.types.Context) -> set[str]:
        """All values or none; one undo step."""
        try:
            # First, for it brings the medium's node back and unlinks the base colour.
            field_rows.restore(context.scene)
            _write(context.scene, "original")
        except BadInput as error:
            report_problems(self, error)
            return {"CANCELLED"}
        context.scene.selenite.applied = False
        _refresh(context, "original")
        return {"FINISHED"}


def _write(scene: bpy.types.Scene, which: str) -> dict[Key, Values]:
    rows = [row for row in scene.selenite.results if not field_rows.is_field(row)]
    values = {(row.owner, row.parameter): tuple(getattr(row, which)[: row.width]) for row in rows}
    return _put(scene, values)


def _put(scene: bpy.types.Scene, values: dict[Key, Values]) -> dict[Key, Values]:
    owners = {
        row.owner: Owner(row.owner, row.kind, row.datablock, row.library, {}, {})
        for row in scene.selenite.results
        if row.kind != "object"
    }
    for owner in owners.values():
        names = {name for of, name in values if of == owner.name}
        if owner.kind == "material" and any(owner.find(name) is None for name in names):
            owner.parameters.update(write_back.constants_of(owner))
    return write_back.write(scene, owners, values)


def _refresh(context: bpy.types.Context, which: str) -> None:
    """The current values in the list of parameters, which are known; what a field changes in the
    nodes of its owner is read."""
    settings = context.scene.selenite
    written = {(row.owner, row.parameter): row for row in settings.results}
    for row in settings.rows:
        found = written.get((row.owner, row.parameter))
        if found is not None and not field_rows.is_field(found):
            current = tuple(getattr(found, which)[: found.width])
            show_current(row, current, millimetres(context.scene))
    if not len(settings.rows) or not any(map(field_rows.is_field, settings.results)):
        return
    if bpy.app.background or not is_idle():
        refresh_rows(context.scene, read_scene(context.scene, surveys=False, bakes=False))
    else:
        bpy.ops.selenite.update_rows("INVOKE_DEFAULT")


CLASSES = (SELENITE_OT_apply, SELENITE_OT_restore)
