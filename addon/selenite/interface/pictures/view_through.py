# SPDX-License-Identifier: GPL-3.0-or-later
"""Through the camera of a photo, with the photo over it at half opacity, and back."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import bpy

from ...scene_read import hosts
from ..chosen import chosen
from ..texts import announce

if TYPE_CHECKING:
    from ...scene_read.hosts import BpyStruct

#: What was there before, on the scene: undo and saved files keep it in step with the cameras.
_KEY = "selenite_view_through"
_OPACITY = 0.5


class SELENITE_OT_view_through(bpy.types.Operator):
    """View the scene through the active photo's camera, with the photo over it at half opacity.
    Again: back to what was there"""

    bl_idname = "selenite.view_through"
    bl_label = "View through Camera"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is something to see, or something to go back to."""
        cls.poll_message_set("Choose a row with a camera and a photo")
        return is_through(context.scene) or _row(context.scene) is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        """One undo step; of another row, the former photo's camera is as it was first."""
        scene, row = context.scene, _row(context.scene)
        former = _restore(context) if is_through(scene) else ""
        if former and (row is None or row.camera.name == former):
            return {"FINISHED"}
        if row is None:
            return {"CANCELLED"}
        if not hosts.is_editable(row.camera.data):
            cause = f"Camera '{row.camera.name}' is linked from a library"
            announce(self, {"ERROR"}, f"{cause}, and its photo cannot be shown; make it local")
            return {"CANCELLED"}
        _go_through(context, row)
        if row.how.use_crop or row.how.use_distortion:
            text = "The photo is cropped or distorted: Blender shows it over all of the camera"
            announce(self, {"WARNING"}, text)
        return {"FINISHED"}


def is_through(scene: bpy.types.Scene) -> bool:
    """Whether a photo is shown over its camera's view now."""
    return scene.get(_KEY) is not None


def _row(scene: bpy.types.Scene) -> BpyStruct:  # a SeleniteCapture
    """The active capture, where it has camera and photo."""
    row = chosen(scene.selenite.captures, scene.selenite.active_capture)
    return row if row is not None and row.camera is not None and row.photo is not None else None


def _go_through(context: bpy.types.Context, row: BpyStruct) -> None:
    scene, data = context.scene, row.camera.data
    backgrounds = data.background_images
    at = next((i for i, item in enumerate(backgrounds) if item.image == row.photo), -1)
    made = at < 0
    if made:
        backgrounds.new()
        at = len(backgrounds) - 1
    item = backgrounds[at]
    before: dict[str, object] = {
        "camera": row.camera.name,
        "scene_camera": scene.camera.name if scene.camera is not None else "",
        "shown": data.show_background_images,
        "at": at,
        "made": made,
        "others": [item.show_background_image for item in backgrounds],
        "alpha": item.alpha,
        "depth": item.display_depth,
        "frame": item.frame_method,
    }
    view = _view(context)
    if view is not None:
        before |= {
            "perspective": view.region_3d.view_perspective,
            "overlays": view.overlay.show_overlays,
        }
    scene[_KEY] = json.dumps(before)
    for other in backgrounds:
        other.show_background_image = False
    item.image, item.show_background_image = row.photo, True
    item.alpha, item.display_depth, item.frame_method = _OPACITY, "FRONT", "CROP"
    data.show_background_images = True
    scene.camera = row.camera
    if view is not None:
        view.overlay.show_overlays = True
        view.region_3d.view_perspective = "CAMERA"


def _restore(context: bpy.types.Context) -> str:
    """Puts everything back that is still there; returns the camera's name."""
    scene = context.scene
    before = json.loads(scene[_KEY])
    del scene[_KEY]
    camera: bpy.types.Object | None = bpy.data.objects.get(before["camera"])
    if camera is not None and camera.type == "CAMERA":
        data: BpyStruct = camera.data
        backgrounds = data.background_images
        for item, shown in zip(backgrounds, before["others"], strict=False):
            item.show_background_image = shown
        if before["at"] < len(backgrounds):
            item = backgrounds[before["at"]]
            item.alpha, item.display_depth = before["alpha"], before["depth"]
            item.frame_method = before["frame"]
            if before["made"]:
                backgrounds.remove(item)
        data.show_background_images = before["shown"]
    former: bpy.types.Object | None = bpy.data.objects.get(before["scene_camera"])
    if former is not None or not before["scene_camera"]:
        scene.camera = former
    view = _view(context)
    if view is not None and "perspective" in before:
        view.overlay.show_overlays = before["overlays"]
        if view.region_3d.view_perspective == "CAMERA":
            view.region_3d.view_perspective = before["perspective"]
    return str(before["camera"])


def _view(context: bpy.types.Context) -> BpyStruct:  # a SpaceView3D
    """The 3D View in which the button was pressed, else the first of the window."""
    areas = [context.area] if context.area is not None else []
    areas += list(context.screen.areas) if context.screen is not None else []
    found = next((area for area in areas if area.type == "VIEW_3D"), None)
    return found.spaces.active if found is not None else None


CLASSES = (SELENITE_OT_view_through,)
