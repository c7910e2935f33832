# SPDX-License-Identifier: GPL-3.0-or-later
"""Suggest Next Camera: puts a camera where another photo would add most information."""

from __future__ import annotations

from dataclasses import replace

import bpy

from ...advice.next_camera import report
from ...advice.next_camera.suggestion import Suggestion, suggestion_of
from ...capture.prepared import Capture
from ...capture.scene_captures import packed_photos
from ...fit.capture_render import as_found, like
from ...fit.request import RunRequest, UnknownRequest
from ...messages import joined, message, thing
from ...parameters import Values
from ...scene_read.camera import named_cameras
from ...scene_read.geometry.bodies import judge_bodies
from ...scene_read.reading.render_depsgraph import Reading
from ...scene_read.scene import reading
from ...scene_read.values import SceneValues
from ...write_back.cameras import add_camera
from ..request import run_request
from ..rows import fields as field_rows
from ..running.run import CANCELLED
from ..state import NEXT, RUN
from ..texts import announce
from ..ticking import WorksInThread


class SELENITE_OT_suggest_camera(WorksInThread):
    """Evaluate many places around the object, and add a camera where another photo would determine
    the ticked parameters best, at the fitted values or else the scene's. Esc cancels"""

    bl_idname = "selenite.suggest_camera"
    bl_label = "Suggest Next Camera"
    bl_options = {"REGISTER", "UNDO"}

    background = NEXT
    failure = "No camera is suggested"

    def _asking(self, context: bpy.types.Context) -> Reading[Suggestion]:
        scene = context.scene
        values = yield from reading(scene)
        values.bodies = judge_bodies(values)
        known = _known(scene, values)
        request = _at(run_request(scene, values), known)
        taken = _taken(scene)
        return suggestion_of(
            values, request, packed_photos(), known,
            as_taken=lambda capture: like(capture, taken.get(capture.id)),
        )  # fmt: skip

    def _end(self, work: Suggestion | None) -> set[str]:
        scene: bpy.types.Scene | None = bpy.data.scenes.get(NEXT.scene_name)
        if work is None or scene is None:
            NEXT.lines = [CANCELLED]
            return {"CANCELLED"}
        like = _like(work)
        if like not in named_cameras(scene):  # deleted or renamed meanwhile
            announce(
                self,
                {"ERROR"},
                message(
                    "next_camera.camera-gone-suggest-again",
                    "Camera '{like}' is gone; suggest again",
                    like=like,
                ),
            )
            return {"CANCELLED"}
        name = _show(scene, work)
        NEXT.lines = report.advice(work)
        announce(self, {"INFO"}, joined(". ", (thing("Camera", name), *NEXT.lines)))
        return {"FINISHED"}


def _known(scene: bpy.types.Scene, values: SceneValues) -> dict[tuple[str, str], Values]:
    """The fitted values of what the scene still has; none once they are applied, for then they are
    the scene's."""
    rows = () if scene.selenite.applied else scene.selenite.results
    return {
        (row.owner, row.parameter): tuple(row.value[: row.width])
        for row in rows
        if not field_rows.is_field(row)
        and row.owner in values.owners
        and row.parameter in values.owners[row.owner].values
    }


def _taken(scene: bpy.types.Scene) -> dict[str, Capture]:
    """Photos of the last fit with the gains and alignments that it has found, by id."""
    done = RUN.outcome_of(scene.name)
    return {item.id: as_found(item, done.result.fit) for item in done.plan.captures} if done else {}


def _at(request: RunRequest, known: dict[tuple[str, str], Values]) -> RunRequest:
    """The request with the fitted values for its starts, inside its bounds."""

    def moved(item: UnknownRequest) -> UnknownRequest:
        value = known.get((item.owner, item.parameter))
        if value is None:
            return item
        low = item.minimum if item.minimum is not None else min(value)
        high = item.maximum if item.maximum is not None else max(value)
        return replace(item, start=tuple(min(max(x, low), high) for x in value))

    return replace(request, unknowns=tuple(map(moved, request.unknowns)))


def _like(found: Suggestion) -> str:
    """The camera that stands at the best place, or whose lens a new one there gets."""
    place = found.rows[0].candidate
    return place.camera.name if place.existing else found.plan.captures[0].camera


def _show(scene: bpy.types.Scene, found: Suggestion) -> str:
    """Adds the camera, or takes the one that stands there; it becomes the active object."""
    place, like = found.rows[0].candidate, _like(found)
    if place.existing:
        camera = named_cameras(scene)[like]
    else:
        camera = add_camera(scene, report.NEW_CAMERA, like, place.camera)
    layer = bpy.context.view_layer
    layer.update()  # it does not know a new object before
    if camera.name in layer.objects:
        for item in layer.objects:
            item.select_set(item == camera)
        layer.objects.active = camera
    return str(camera.name)


CLASSES = (SELENITE_OT_suggest_camera,)
