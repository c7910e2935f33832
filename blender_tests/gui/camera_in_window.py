# SPDX-License-Identifier: GPL-3.0-or-later
"""Suggest Next Camera in a real window: progress, Esc, a camera, and its undo step."""

import bpy
from _driving import in_window, made, photographed, picture, press_escape, run

from selenite.interface import panels, state


def prepare():
    """A sphere, a photo of it, base colour and roughness ticked."""
    made.studio(roughness=0.4)
    made.light(energy=300)
    settings = photographed(0.3)
    for row in settings.rows:
        row.enabled = row.owner == "Body" and row.parameter in ("base_color", "roughness")


def running():
    """The thread works and a tick has seen it."""
    return state.NEXT.step is not None


def steps():
    """See `_driving.run`."""
    prepare()
    yield 0.5
    in_window(bpy.ops.ed.undo_push, message="before")
    in_window(bpy.ops.selenite.suggest_camera, "INVOKE_DEFAULT")
    assert not bpy.ops.selenite.start.poll(), "nothing else starts meanwhile"
    press_escape()
    yield state.is_idle
    assert "Next photo" not in bpy.data.objects, "Esc changes nothing"
    in_window(bpy.ops.selenite.suggest_camera, "INVOKE_DEFAULT")
    yield running
    picture("running")
    yield state.is_idle
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
