# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that fill the list of captures."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path, PurePath

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, StringProperty

from ...capture.request import CaptureRequest
from ...capture.scene_captures import ids_of, pair_by_name, photo_of
from ...messages import message
from ...native import NativeUnavailable
from ...scene_read.camera import named_cameras
from ...scene_read.scene import read_scene
from ..operators.filling import fill, tick_usual_of_first
from ..state import is_idle
from ..texts import announce
from .examining import examine

#: Formats that are read, see docs/guide/photos.md.
_ENDINGS = ("png", "jpg", "jpeg", "tif", "tiff", "exr", "hdr")
#: Folders beside the .blend where photos mostly are.
_FOLDERS = ("photos", "Photos", "images", "captures")


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
            background = photo_of(row.camera)
            row.photo = background.image if background is not None else None
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
    """Load photos and pair them with cameras of the same name: Camera.png, Camera#2.png. Where none
    is chosen, all that are named so. At the first time also lists the parameters and ticks the
    usual ones of the active material"""

    bl_idname = "selenite.load_photos"
    bl_label = "Load Photos"
    bl_options = {"REGISTER", "UNDO"}

    directory: StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})
    files: CollectionProperty(
        type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"}
    )
    filename: StringProperty(subtype="FILE_NAME", options={"HIDDEN", "SKIP_SAVE"})
    filter_glob: StringProperty(
        default=";".join(f"*.{item};*.{item.upper()}" for item in _ENDINGS),
        options={"HIDDEN", "SKIP_SAVE"},
    )
    filter_folder: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    display_type: EnumProperty(
        items=(("DEFAULT", "", ""), ("LIST_VERTICAL", "", ""), ("LIST_HORIZONTAL", "", ""),
               ("THUMBNAIL", "", "")),
        default="THUMBNAIL",
        options={"HIDDEN", "SKIP_SAVE"},
    )  # fmt: skip

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Opens the file browser with thumbnails, where the photos probably are."""
        self.directory, self.filename = _start_folder(context.scene), ""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """A photo without a camera of its name gets a row without a camera."""
        settings, cameras = context.scene.selenite, named_cameras(context.scene)
        paths = [str(PurePath(self.directory, item.name)) for item in self.files if item.name]
        paths = paths or _named_like(cameras, self.directory)
        if not paths:
            text = "No photo is chosen, and none here is named like a camera"
            announce(
                self,
                {"WARNING"},
                message(
                    "operators.choose-photos-press-all",
                    "{text}; choose photos, or press A for all",
                    text=text,
                ),
            )
            return {"CANCELLED"}
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
        settings.active_capture = max(0, min(settings.active_capture, len(settings.captures) - 1))
        self._read(context.scene)
        if failed:
            announce(
                self,
                {"ERROR"},
                message(
                    "operators.cannot-read-give-image",
                    "Cannot read {names}; give image files",
                    names=", ".join(failed),
                ),
            )
        if rest:
            announce(
                self,
                {"WARNING"},
                message(
                    "operators.no-camera-of-name",
                    "{count} photos have no camera of their name; choose it in the list",
                    count=len(rest),
                ),
            )
        elif not failed:
            announce(
                self,
                {"INFO"},
                message(
                    "operators.photos-loaded-see-what",
                    "{count} photos loaded; see what is ticked, then Start Fit",
                    count=len(paths),
                ),
            )
        return {"FINISHED"} if len(failed) < len(paths) else {"CANCELLED"}

    def _read(self, scene: bpy.types.Scene) -> None:
        """The list of parameters, at the first time with the usual ticks; and what is wrong with
        the photos."""
        settings = scene.selenite
        is_first = not len(settings.rows)
        if not bpy.app.background and is_idle():
            bpy.ops.selenite.update_rows("INVOKE_DEFAULT", usual=is_first, examines=True)
            return
        try:
            values = read_scene(scene, surveys=bpy.app.background, bakes=False)
        except NativeUnavailable as error:
            announce(self, {"WARNING"}, str(error))
            return
        fill(scene, values)
        if is_first:
            tick_usual_of_first(settings)
        examine(scene, values)


def _named_like(cameras: Mapping[str, object], folder: str) -> list[str]:
    """The photos of a folder that are named like cameras, as Front.png and Front#2.png."""
    try:
        names = sorted(path.name for path in Path(folder).iterdir()) if folder else []
    except OSError:
        return []
    files = [name for name in names if name.rpartition(".")[2].lower() in _ENDINGS]
    pairs, _ = pair_by_name(list(cameras), [str(PurePath(folder, name)) for name in files])
    return [item.photo for item in pairs]


def _start_folder(scene: bpy.types.Scene) -> str:
    """That of the photos that are there, else one beside the file that is named like it, else that
    of the file."""
    for row in scene.selenite.captures:
        if row.photo is not None and row.photo.filepath:
            return str(Path(bpy.path.abspath(row.photo.filepath)).parent) + os.sep
    own = bpy.path.abspath("//")
    for name in _FOLDERS if own else ():
        if (Path(own) / name).is_dir():
            return str(Path(own) / name) + os.sep
    return own or str(Path.home()) + os.sep


CLASSES = (
    SELENITE_OT_add_capture,
    SELENITE_OT_remove_capture,
    SELENITE_OT_load_photos,
)
