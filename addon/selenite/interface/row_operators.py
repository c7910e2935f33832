# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that fill the lists of captures and parameters."""

from pathlib import PurePath

import bpy
from bpy.props import CollectionProperty, StringProperty

from .. import native
from ..cycles_check.render_settings import contents_of
from ..native import NativeUnavailable
from ..scene_read.camera import named_cameras
from ..scene_read.capture_request import CaptureRequest
from ..scene_read.photos import ids_of, pair_by_name
from ..scene_read.scene import read_scene
from . import request
from .state import CHECK, remember_shapes


class SELENITE_OT_refresh_rows(bpy.types.Operator):
    """List every parameter of the materials, lights and world of the scene"""

    bl_idname = "selenite.refresh_rows"
    bl_label = "Refresh Parameters"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Ticks and bounds of rows that are known already stay."""
        try:
            values = read_scene(context.scene)
        except NativeUnavailable as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        native.core().prepare()  # while the user ticks
        request.refresh_rows(context.scene, values)
        remember_shapes(context.scene.name, values)
        CHECK.contents[context.scene.name] = contents_of(context.scene)
        for problem in values.problems:
            self.report({"WARNING"}, problem.line())
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
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class SELENITE_OT_add_capture(bpy.types.Operator):
    """Add a photo row for the scene's camera"""

    bl_idname = "selenite.add_capture"
    bl_label = "Add Capture"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """A camera that has a row already is not added again."""
        settings = context.scene.selenite
        used = {row.camera for row in settings.captures}
        row = settings.captures.add()
        settings.active_capture = len(settings.captures) - 1
        if context.scene.camera is not None and context.scene.camera not in used:
            row.camera = context.scene.camera
            backgrounds = row.camera.data.background_images
            row.photo = next((item.image for item in backgrounds if item.image), None)
        return {"FINISHED"}


class SELENITE_OT_remove_capture(bpy.types.Operator):
    """Remove the active photo row; camera and photo stay"""

    bl_idname = "selenite.remove_capture"
    bl_label = "Remove Capture"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is something to remove."""
        return len(context.scene.selenite.captures) > 0

    def execute(self, context: bpy.types.Context) -> set[str]:
        """The row before becomes the active one."""
        settings = context.scene.selenite
        settings.captures.remove(settings.active_capture)
        settings.active_capture = max(0, settings.active_capture - 1)
        return {"FINISHED"}


class SELENITE_OT_load_photos(bpy.types.Operator):
    """Load photos and pair them with cameras of the same name: Camera.png, and Camera#2.png for a
    second photo of Camera"""

    bl_idname = "selenite.load_photos"
    bl_label = "Load Photos"
    bl_options = {"REGISTER", "UNDO"}

    directory: StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})
    files: CollectionProperty(
        type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"}
    )
    filter_image: bpy.props.BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    filter_folder: bpy.props.BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Opens the file browser."""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """A photo without a camera of its name gets a row without a camera."""
        settings, cameras = context.scene.selenite, named_cameras(context.scene)
        paths = [str(PurePath(self.directory, item.name)) for item in self.files if item.name]
        pairs, rest = pair_by_name(list(cameras), paths)
        rows = dict(zip(ids_of(context.scene), settings.captures, strict=True))
        failed = []
        for item in [*pairs, *(CaptureRequest("", path) for path in rest)]:
            try:
                photo = bpy.data.images.load(item.photo, check_existing=True)
            except RuntimeError:
                failed.append(item.photo)
                continue
            known = rows.get(item.id) if item.id else None
            row = known or settings.captures.add()
            row.photo = photo
            row.camera = cameras.get(item.camera)
        if failed:
            self.report({"ERROR"}, f"Cannot read {', '.join(failed)}; give image files")
        if rest:
            text = "have no camera of their name; choose it in the list"
            self.report({"WARNING"}, f"{len(rest)} photos {text}")
        return {"FINISHED"} if len(failed) < len(paths) else {"CANCELLED"}


CLASSES = (
    SELENITE_OT_refresh_rows,
    SELENITE_OT_reset_rows,
    SELENITE_OT_add_capture,
    SELENITE_OT_remove_capture,
    SELENITE_OT_load_photos,
)
