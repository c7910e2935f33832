# SPDX-License-Identifier: GPL-3.0-or-later
"""Estimate in a real window: progress, Esc, what is shown."""

import bpy
from _driving import in_window, made, photographed, picture, press_escape, run

from selenite.interface import panels, state


def prepare():
    """A ball in front and one that the photo does not show, the colours of both ticked."""
    made.studio(roughness=0.4)
    made.hidden_ball()
    settings = photographed(0.3)
    for row in settings.rows:
        row.enabled = row.parameter == "base_color"
    settings.iterations, settings.height = 6, 24


def steps():
    """See `_driving.run`."""
    prepare()
    yield 0.5
    in_window(bpy.ops.selenite.estimate, "INVOKE_DEFAULT")
    assert not bpy.ops.selenite.start.poll(), "nothing else starts meanwhile"
    press_escape()
    yield state.is_idle
    assert not state.EXPECTED, "Esc tells nothing"
    in_window(bpy.ops.selenite.estimate, "INVOKE_DEFAULT")
    yield state.is_idle
    yield 0.5
    picture("estimated")
    (lines,) = state.EXPECTED.values()
    assert lines[1].startswith("Balanced: about") and "Base Color of Hidden" in lines[1]


run(steps, panels, {panels.SELENITE_PT_fit})
