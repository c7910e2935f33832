# SPDX-License-Identifier: GPL-3.0-or-later
"""Rotate Environment: how the world's panorama stood while the photos were taken."""

from __future__ import annotations

from dataclasses import replace

import bpy

from ...advice.information.world_rotation import RotationSearch, said
from ...capture.scene_captures import captures_of, packed_photos
from ...messages import joined
from ...problems import BadInput
from ...scene_read.reading.render_depsgraph import Reading
from ...scene_read.scene import reading
from ...write_back import environments
from ..progress.background import draw_work
from ..request import fit_settings
from ..running.run import CANCELLED
from ..state import ROTATION
from ..texts import announce, paragraph
from ..ticking import WorksInThread

#: Of the renders that are compared: angles show in small ones.
_HEIGHT, _SPP = 64, 64


class SELENITE_OT_rotate_environment(WorksInThread):
    """Find the rotation and strength of the world's image at which the scene looks most like the
    photos, and set them, the rotation in a Mapping node. Esc cancels"""

    bl_idname = "selenite.rotate_environment"
    bl_label = "Rotate Environment"
    bl_options = {"REGISTER", "UNDO"}

    background = ROTATION
    failure = "The environment is not rotated"

    def _asking(self, context: bpy.types.Context) -> Reading[RotationSearch]:
        scene = context.scene
        values = yield from reading(scene)
        if values.problems:
            raise BadInput(values.problems)
        settings = fit_settings(scene)
        values.physical_refraction = settings.physical_refraction
        small = replace(settings, height=min(settings.height, _HEIGHT), spp=_SPP)
        return RotationSearch(values, captures_of(scene), small, packed_photos())

    def _end(self, work: RotationSearch | None) -> set[str]:
        scene: bpy.types.Scene | None = bpy.data.scenes.get(ROTATION.scene_name)
        if work is None or work.result is None or scene is None:
            ROTATION.lines = [CANCELLED]
            return {"CANCELLED"}
        done = environments.rotate(scene, work.values, work.result.angle, work.strength)
        ROTATION.lines = [*work.warnings, *said(work)]
        announce(self, {"INFO"}, joined("; ", (done, ROTATION.lines[-1])))
        return {"FINISHED"}


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """The button, how far it has come, and what was found."""
    if not draw_work(layout, ROTATION):
        layout.operator("selenite.rotate_environment", icon="FILE_REFRESH")
    for line in ROTATION.lines:
        paragraph(layout, context, line)


CLASSES = (SELENITE_OT_rotate_environment,)
