# SPDX-License-Identifier: GPL-3.0-or-later
"""Estimate and automatic stages in a real window: progress, Esc, what is told, the fit after it."""

import sys
import tempfile
from pathlib import Path

import bpy

sys.path[:0] = [str(Path(__file__).resolve().parents[i]) for i in (0, 1)]

import made_scenes as made  # noqa: E402
from _driving import in_window, picture, press_escape, run, window  # noqa: E402

from selenite.interface import panels, state  # noqa: E402


def prepare():
    """A ball in front and one that the photo does not show, the colours of both ticked."""
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    made.studio(roughness=0.4)
    behind = made.sphere("Behind", made.material("Hidden", base_color=(0.2, 0.3, 0.6)))
    behind.location, behind.scale = (0.0, 0.0, -2.0), (0.5, 0.5, 0.5)
    bpy.context.view_layer.update()
    photo = made.photo(Path(tempfile.mkdtemp()) / "Camera.png", value=0.3)
    settings = bpy.context.scene.selenite
    assert in_window(bpy.ops.selenite.refresh_rows) == {"FINISHED"}
    in_window(bpy.ops.selenite.add_capture)
    settings.captures[0].photo = bpy.data.images.load(str(photo))
    for row in settings.rows:
        row.enabled = row.parameter == "base_color"
    settings.iterations, settings.height = 6, 24


def steps():
    """See `_driving.run`."""
    window()[3].show_region_ui = True
    bpy.context.preferences.view.ui_scale = 0.6
    prepare()
    yield 0.5
    in_window(bpy.ops.selenite.estimate, "INVOKE_DEFAULT")
    assert not bpy.ops.selenite.start.poll(), "nothing else starts meanwhile"
    press_escape()
    yield lambda: state.ESTIMATE.job is None
    assert not state.EXPECTED, "Esc tells nothing"
    in_window(bpy.ops.selenite.estimate, "INVOKE_DEFAULT")
    yield lambda: state.ESTIMATE.job is None
    yield 0.5
    picture("estimated")
    (lines,) = state.EXPECTED.values()
    assert lines[1].startswith("Balanced: about") and "Base Color of Hidden" in lines[1]
    settings = bpy.context.scene.selenite
    settings.stage_mode = "auto"
    in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
    assert state.STAGES.job is not None and state.RUN.job is None
    press_escape()
    yield lambda: state.STAGES.job is None
    assert state.RUN.job is None, "Esc starts no fit"
    in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
    yield lambda: state.STAGES.job is None
    yield lambda: state.RUN.job is None
    yield 0.5
    picture("staged")
    assert len(state.RUN.result["stages"]) == 2
    assert state.RUN.plan.request.staging.startswith("Base Color of Hidden last")


run(steps, panels, {panels.SELENITE_PT_fit})
