# SPDX-License-Identifier: GPL-3.0-or-later
"""Check in Cycles in a real window: progress, Esc, the numbers, a file load during a check."""

import bpy
from _driving import ENDLESS, FOLDER, in_window, made, photographed, picture, press_escape, run

from selenite.interface import panels, state
from selenite.scene_read.blender_process import DRAWN


def prepare():
    """A sphere with a photo of another grey; base colour is fitted in a moment."""
    made.studio()
    settings = photographed(0.1)
    next(item for item in settings.rows if item.parameter == "base_color").enabled = True
    settings.height, settings.iterations, settings.picture_spp = 24, 5, 16
    settings.output = str(FOLDER / "out")
    return settings


def rendering():
    """The other Blender has started to render."""
    progress = state.CHECK.progress
    return progress is not None and "picture" in progress.text


def escaped():
    """A simulated key is lost now and then on a busy machine, so it is pressed until it acts."""
    if state.CHECK.job is not None:
        press_escape()
    return state.CHECK.job is None


def users_blocks():
    """Names of all datablocks but the images that the add-on draws for itself."""
    return sorted(item.name for item in bpy.data.user_map() if not item.get(DRAWN))


def steps():
    """See `_driving.run`."""
    settings = prepare()
    in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
    yield lambda: not state.RUN.is_active
    blocks = users_blocks()
    engine = bpy.context.scene.render.engine

    in_window(bpy.ops.selenite.check_in_cycles, "INVOKE_DEFAULT")
    yield lambda: state.CHECK.job is None
    assert state.CHECK.lines and state.CHECK.sheet.is_file()
    yield 0.5
    picture("checked")
    assert users_blocks() == blocks
    assert bpy.context.scene.render.engine == engine

    settings.picture_spp = ENDLESS
    state.RUN.last = None  # takes the settings as they are now
    in_window(bpy.ops.selenite.check_in_cycles, "INVOKE_DEFAULT")
    left = state.CHECK.job.folder
    yield rendering
    yield escaped
    assert state.CHECK.message == "Check cancelled" and not left.exists()

    in_window(bpy.ops.selenite.check_in_cycles, "INVOKE_DEFAULT")
    yield rendering
    picture("checking")
    in_window(bpy.ops.selenite.cancel)
    yield lambda: state.CHECK.job is None
    yield 0.5

    in_window(bpy.ops.selenite.set_cycles, "EXEC_DEFAULT", True)
    yield 0.5
    assert bpy.context.scene.render.engine == "CYCLES"
    picture("set")
    in_window(bpy.ops.ed.undo)
    yield 0.5
    assert bpy.context.scene.render.engine == engine

    in_window(bpy.ops.selenite.check_in_cycles, "INVOKE_DEFAULT")
    left = state.CHECK.job.folder
    yield rendering
    in_window(bpy.ops.wm.read_homefile, use_empty=True)  # the modal operator is cancelled
    yield 0.5
    assert state.CHECK.job is None and not left.exists(), "loading a file ends the check"


# The window is too low for all panels.
run(steps, panels, shown=[panels.SELENITE_PT_result, panels.SELENITE_PT_cycles])
