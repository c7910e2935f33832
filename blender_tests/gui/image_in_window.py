# SPDX-License-Identifier: GPL-3.0-or-later
"""An image of a base colour in a real window: its row, its fit, Apply, undo, redo, Restore."""

import bpy
from _driving import FOLDER, in_window, made, photographed, picture, run

from selenite.interface import panels, state

NAME = "Body"


def prepare():
    """A sphere, a photo darker than its render, an image of few texels ticked and shown."""
    made.studio()
    settings = photographed(0.1)
    parameters = [item.parameter for item in settings.rows]
    settings.active_row = parameters.index("base_color_texture")
    row = settings.rows[settings.active_row]
    row.enabled, row.texels, row.unseen = True, 8, "fill"
    settings.height, settings.iterations, settings.tolerance = 24, 5, 0.0
    settings.output = str(FOLDER / "out")


def shown():
    """The image that the base colour takes, by file name; "" for none. Pointers are stale after an
    undo, so the material is looked up each time."""
    socket = made.socket(bpy.data.materials[NAME], "base_color")
    return socket.links[0].from_node.image.name if socket.is_linked else ""


def steps():
    """See `_driving.run`."""
    prepare()
    yield 0.5
    picture("ready")
    in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
    yield lambda: not state.RUN.is_active
    settings = bpy.context.scene.selenite
    assert len(settings.results) == 1, state.RUN.message
    assert "% seen by the photos" in settings.results[0].text
    assert shown() == ""
    yield 0.5
    picture("fitted")
    in_window(bpy.ops.selenite.apply, "EXEC_DEFAULT", True)
    yield 0.5
    assert shown() == "Body_base_color.png"
    yield state.is_idle
    yield 0.5
    picture("applied")
    in_window(bpy.ops.ed.undo)
    yield 0.5
    assert shown() == ""
    in_window(bpy.ops.ed.redo)
    yield 0.5
    assert shown() == "Body_base_color.png"
    in_window(bpy.ops.selenite.restore, "EXEC_DEFAULT", True)
    yield 0.5
    assert shown() == ""
    left = set(bpy.data.materials[NAME].keys()) - {"cycles"}  # that one is Blender's own
    assert not left, left


run(steps, panels, (panels.SELENITE_PT_parameters, panels.SELENITE_PT_result))
