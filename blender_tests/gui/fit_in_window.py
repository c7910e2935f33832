# SPDX-License-Identifier: GPL-3.0-or-later
"""Start, live progress, Esc, Apply, undo, and a file load during a run, in a real window."""

import sys
import tempfile
from pathlib import Path

import bpy

sys.path[:0] = [str(Path(__file__).resolve().parents[i]) for i in (0, 1)]

import made_scenes as made  # noqa: E402
from _driving import in_window, picture, press_escape, run, window  # noqa: E402

from selenite.interface import panels, state  # noqa: E402

ENDLESS = 1_000_000  # iterations


def prepare():
    """A sphere, a photo darker than its render, base colour ticked."""
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    material = made.studio()
    bpy.context.view_layer.update()
    photo = made.photo(Path(tempfile.mkdtemp()) / "Camera.png", value=0.1)
    settings = bpy.context.scene.selenite
    assert in_window(bpy.ops.selenite.refresh_rows) == {"FINISHED"}
    in_window(bpy.ops.selenite.add_capture)
    settings.captures[0].photo = bpy.data.images.load(str(photo))
    row = next(item for item in settings.rows if item.parameter == "base_color")
    row.enabled = True
    settings.height, settings.iterations, settings.tolerance = 24, ENDLESS, 0.0
    return material


def running():
    """The native thread works and a tick has seen it."""
    progress = state.RUN.progress
    return progress is not None and progress.iteration > 1


def steps():
    """See `_driving.run`."""
    window()[3].show_region_ui = True
    bpy.context.preferences.view.ui_scale = 0.6  # all panels fit the window and are drawn
    material = prepare()
    name, before = material.name, tuple(made.socket(material, "base_color").default_value)
    yield 0.5
    picture("ready")
    in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
    assert state.RUN.job is not None
    yield running
    yield 1.0  # the panels below slide into place
    picture("running")
    press_escape()
    yield lambda: state.RUN.job is None
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
    in_window(bpy.ops.selenite.cancel)
    yield lambda: state.RUN.job is None
    assert state.RUN.message.startswith("Cancelled")

    in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
    yield running
    in_window(bpy.ops.wm.read_homefile, use_empty=True)  # the modal operator is cancelled
    yield 0.5
    assert state.RUN.job is None, "loading a file ends the fit"


run(steps, panels)
