# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture of what counts of a photo, in the Image Editor."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import bpy
import numpy as np

from ...advice.information.job import Step
from ...capture.prepared import read_captures
from ...capture.request import CaptureRequest
from ...capture.scene_captures import capture_of_row, packed_photos
from ...problems import BadInput, Problem
from ...report.pictures.comparison import marked
from ...scene_read.reading.render_depsgraph import Reading
from ...scene_read.scene import reading
from ...scene_read.values import SceneValues
from ..chosen import chosen
from ..progress.background import draw_work
from ..state import MASK
from ..texts import announce
from ..ticking import CancelsWork, WorksInThread
from . import images

#: Name of the image, which each preview replaces.
IMAGE = "Selenite Mask"


class MaskPreview:
    """Reads a photo and renders the fitted objects, where its mask asks for them. Then `picture`
    (h, w, 3) linear is there, red where the photo does not count, and its `share` that counts."""

    def __init__(
        self,
        values: SceneValues,
        request: CaptureRequest,
        height: int,
        packed: Mapping[str, bytes],
        fitted: set[str],
    ) -> None:
        """fitted: owners of what is ticked."""
        self.picture: np.ndarray | None = None
        self.share = 0.0
        self._asked = values, request, height, packed, fitted

    def steps(self) -> Iterator[Step]:
        """One. Raises BadInput."""
        yield Step(0.0, "reading the photo")
        values, request, height, packed, fitted = self._asked
        problems: list[Problem] = []
        found = read_captures(values, [request], height, problems, [], packed, fitted)
        if problems:
            raise BadInput(problems)
        if found:
            self.picture = marked(found[0].reference, found[0].weight)
            self.share = found[0].mask_share

    def cancel(self) -> None:
        """The photo is read to its end."""


class SELENITE_OT_preview_mask(WorksInThread):
    """Show what counts of the active photo: the rest is red. Reads and renders it at the height of
    the comparison. Esc cancels"""

    bl_idname = "selenite.preview_mask"
    bl_label = "Preview Mask"
    bl_options = {"REGISTER", "UNDO"}
    background = MASK
    failure = "The photo is not shown"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a row to show, and nothing runs."""
        settings = context.scene.selenite
        row = chosen(settings.captures, settings.active_capture)
        return row is not None and super().poll(context)

    def _asking(self, context: bpy.types.Context) -> Reading[MaskPreview]:
        scene, settings = context.scene, context.scene.selenite
        values = yield from reading(scene)
        row = chosen(settings.captures, settings.active_capture)
        request = capture_of_row(row, scene)
        fitted = {item.owner for item in settings.rows if item.enabled}
        return MaskPreview(values, request, settings.height, packed_photos(), fitted)

    def _end(self, work: MaskPreview | None) -> set[str]:
        """Into the first Image Editor of the window; without one, the image is there."""
        if work is None or work.picture is None:
            return {"CANCELLED"}
        image = images.show(IMAGE, work.picture, is_float=True)
        announce(self, {"INFO"}, f"{work.share:.0%} of the photo count")
        screen = bpy.context.screen
        areas = screen.areas if screen is not None else ()
        editor = next((area for area in areas if area.type == "IMAGE_EDITOR"), None)
        if editor is not None:
            editor.spaces.active.image = image  # type: ignore[attr-defined]
        else:
            announce(self, {"INFO"}, f"Open the image '{IMAGE}' in an Image Editor")
        return {"FINISHED"}


class SELENITE_OT_cancel_mask(CancelsWork):
    """Stop; the image stays as it is"""

    bl_idname = "selenite.cancel_mask"
    bl_label = "Cancel"
    background = MASK


def draw(layout: bpy.types.UILayout) -> None:
    """The button, or how far it has come."""
    if not draw_work(layout, MASK, "selenite.cancel_mask"):
        layout.operator("selenite.preview_mask", icon="IMAGE_ALPHA")


CLASSES = (SELENITE_OT_preview_mask, SELENITE_OT_cancel_mask)
