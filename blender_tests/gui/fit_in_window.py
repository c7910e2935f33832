# SPDX-License-Identifier: GPL-3.0-or-later
"""Start, live progress, Esc, Stop, Cancel, Apply, undo, and a file load during a run, in a real
window. Part of every test run, so it is short."""

import bpy
from _driving import ENDLESS, in_window, made, photographed, picture, press_escape, run, running

from selenite.interface import panels, state
from selenite.interface.running.run import ReadingPhase


def prepare():
    """A sphere, a photo darker than its render, base colour ticked."""
    material = made.studio()
    settings = photographed(0.1)
    row = next(item for item in settings.rows if item.parameter == "base_color")
    row.enabled = True
    settings.height, settings.iterations, settings.tolerance = 24, ENDLESS, 0.0
    settings.loss = "mae"  # what is no sum of squares does not converge
    return material


def reading():
    """Blender's thread evaluates the scene."""
    return isinstance(state.RUN.phase, ReadingPhase)


def steps():
    """See `_driving.run`."""
    material = prepare()
    name, before = material.name, tuple(made.socket(material, "base_color").default_value)
    yield 0.5
    picture("ready")
    in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
    assert state.RUN.is_active
    yield running
    yield 1.0  # the panels below slide into place
    picture("running")
    press_escape()
    yield lambda: not state.RUN.is_active
    settings = bpy.context.scene.selenite
    assert len(settings.results) == 1, "Esc keeps the best values"
    assert tuple(made.socket(bpy.data.materials[name], "base_color").default_value) == before
    in_window(bpy.ops.selenite.apply, "EXEC_DEFAULT", True)
    yield 0.5
    picture("applied")
    after = tuple(made.socket(bpy.data.materials[name], "base_color").default_value)
    assert after != before
    in_window(bpy.ops.ed.undo)
    yield 0.5
    assert tuple(made.socket(bpy.data.materials[name], "base_color").default_value) == before
    in_window(bpy.ops.ed.redo)
    yield 0.5
    assert tuple(made.socket(bpy.data.materials[name], "base_color").default_value) == after

    in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
    yield running
    in_window(bpy.ops.selenite.stop)
    yield lambda: not state.RUN.is_active
    assert "best values so far are kept" in state.RUN.message, "Stop keeps"

    in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
    yield running
    in_window(bpy.ops.selenite.cancel)
    yield lambda: not state.RUN.is_active
    assert state.RUN.message.startswith("Cancelled")
    assert len(bpy.context.scene.selenite.results) == 1, "Cancel keeps the result before"

    for waits in (False, True):  # Blender's thread reads the scene, then ours the photos
        in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
        assert reading()
        while waits and reading():
            yield 0.01
        in_window(bpy.ops.selenite.cancel)
        yield lambda: not state.RUN.is_active
        assert state.RUN.message.startswith("Cancelled")
        assert len(bpy.data.scenes) == 1, "the copy that was read is gone"

    in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
    assert reading()
    in_window(bpy.ops.ed.undo)
    yield lambda: not state.RUN.is_active
    assert len(bpy.data.scenes) == 1, "an undo ends the reading"
    in_window(bpy.ops.ed.redo)
    yield 0.5

    in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
    yield running
    in_window(bpy.ops.wm.read_homefile, use_empty=True)  # the modal operator is cancelled
    yield 0.5
    assert not state.RUN.is_active, "loading a file ends the fit"
    in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
    assert reading()
    in_window(bpy.ops.wm.read_homefile, use_empty=True)
    yield 0.5
    assert not state.RUN.is_active, "loading a file ends the reading"


run(steps, panels)
