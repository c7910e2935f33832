# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture of what counts of a photo, in the Image Editor."""

import bpy

from ...fit_run.captures.prepared import read_captures
from ...fit_run.pictures.comparison import marked
from ...native import NativeUnavailable
from ...problems import Problem
from ...scene_read.photos import capture_of_row, packed_photos
from ...scene_read.scene import read_scene
from ..chosen import chosen
from ..texts import announce
from . import images

#: Name of the image, which each preview replaces.
IMAGE = "Selenite Mask"


class SELENITE_OT_preview_mask(bpy.types.Operator):
    """Show what counts of the active photo: the rest is red. Reads and renders it at the height of
    the comparison"""

    bl_idname = "selenite.preview_mask"
    bl_label = "Preview Mask"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a row to show."""
        settings = context.scene.selenite
        return chosen(settings.captures, settings.active_capture) is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Into the first Image Editor of the window; without one, the image is there."""
        settings = context.scene.selenite
        row = chosen(settings.captures, settings.active_capture)
        problems: list[Problem] = []
        try:
            values = read_scene(context.scene)
            request = capture_of_row(row, context.scene)
            fitted = {item.owner for item in settings.rows if item.enabled}
            height = settings.height
            warnings: list[str] = []
            found = read_captures(
                values, [request], height, problems, warnings, packed_photos(), fitted
            )
        except NativeUnavailable as error:
            announce(self, {"ERROR"}, str(error))
            return {"CANCELLED"}
        for problem in problems:
            announce(self, {"ERROR"}, problem.line())
        if problems or not found:
            return {"CANCELLED"}
        # Red where it does not count.
        image = images.show(IMAGE, marked(found[0].reference, found[0].weight), is_float=True)
        announce(self, {"INFO"}, f"{found[0].mask_share:.0%} of the photo count")
        areas = context.screen.areas if context.screen is not None else ()
        editor = next((area for area in areas if area.type == "IMAGE_EDITOR"), None)
        if editor is not None:
            editor.spaces.active.image = image  # type: ignore[attr-defined]
        else:
            announce(self, {"INFO"}, f"Open the image '{IMAGE}' in an Image Editor")
        return {"FINISHED"}


CLASSES = (SELENITE_OT_preview_mask,)
