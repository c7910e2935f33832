# SPDX-License-Identifier: GPL-3.0-or-later
"""Suggest Next Camera in a real window: progress, Esc, a camera, and its undo step."""

import sys
import tempfile
from pathlib import Path

import bpy

sys.path[:0] = [str(Path(__file__).resolve().parents[i]) for i in (0, 1)]

import made_scenes as made  # noqa: E402
from _driving import in_window, picture, press_escape, run, window  # noqa: E402

from selenite.interface import panels, state  # noqa: E402


def prepare():
    """A sphere, a photo of it, base colour and roughness ticked."""
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    made.studio(roughness=0.4)
    made.light(energy=300)
    bpy.context.view_layer.update()
    photo = made.photo(Path(tempfile.mkdtemp()) / "Camera.png", value=0.3)
    settings = bpy.context.scene.selenite
    assert in_window(bpy.ops.selenite.refresh_rows) == {"FINISHED"}
    in_window(bpy.ops.selenite.add_capture)
    settings.captures[0].photo = bpy.data.images.load(str(photo))
    for row in settings.rows:
        row.enabled = row.owner == "Body" and row.parameter in ("base_color", "roughness")


def looking():
    """The thread works and a tick has seen it."""
    return state.NEXT.step is not None


def steps():
    """See `_driving.run`."""
    window()[3].show_region_ui = True
    bpy.context.preferences.view.ui_scale = 0.6
    prepare()
    yield 0.5
    in_window(bpy.ops.ed.undo_push, message="before")
    in_window(bpy.ops.selenite.suggest_camera, "INVOKE_DEFAULT")
    yield looking
    picture("looking")
    assert not bpy.ops.selenite.start.poll(), "nothing else starts meanwhile"
    press_escape()
    yield lambda: state.NEXT.job is None
    assert "Next photo" not in bpy.data.objects, "Esc changes nothing"
    in_window(bpy.ops.selenite.suggest_camera, "INVOKE_DEFAULT")
    yield lambda: state.NEXT.job is None
    yield 0.5
    picture("found")
    assert bpy.context.view_layer.objects.active == bpy.data.objects["Next photo"]
    assert any("Next photo" in line or "No place" in line for line in state.NEXT.lines)
    in_window(bpy.ops.ed.undo)
    yield 0.5
    assert "Next photo" not in bpy.data.objects, "one undo step"
    in_window(bpy.ops.ed.redo)
    yield 0.5
    assert "Next photo" in bpy.data.objects


run(steps, panels, {panels.SELENITE_PT_fit, panels.SELENITE_PT_advanced, panels.SELENITE_PT_result})
