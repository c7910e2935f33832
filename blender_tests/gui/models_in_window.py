# SPDX-License-Identifier: GPL-3.0-or-later
"""Models of a body in a real window: progress, Esc, Cancel, the list, Apply and undo."""

import math

import bpy
from _driving import FOLDER, in_window, made, photographed, picture, press_escape, run

from selenite.interface import panels, state

MANY = 5000  # iterations of small pictures: they take longer than the script


def prepare():
    """A sphere with photos of another grey from three sides; small pictures."""
    made.studio()
    settings = photographed(0.1)
    for index in (1, 2):
        item = made.camera(f"Camera {index}")
        turn = 2 * math.pi * index / 3
        item.location = (5 * math.sin(turn), -5 * math.cos(turn), 0.0)
        item.rotation_euler = (math.pi / 2, 0.0, turn)
        row = settings.captures.add()
        row.camera = item
        row.photo = bpy.data.images.load(str(made.photo(FOLDER / f"Camera {index}.png", value=0.1)))
    settings.height, settings.iterations, settings.picture_spp = 16, 3, 8
    settings.output = str(FOLDER / "out")
    settings.body = "opaque"
    return settings


def fitting():
    """The other process fits."""
    step = state.MODELS.step
    return step is not None and "iteration" in step.text


def ended():
    """A simulated key is lost now and then on a busy machine, so it is pressed until it acts."""
    if state.MODELS.job is not None:
        press_escape()
    return state.MODELS.job is None


def steps():
    """See `_driving.run`."""
    settings = prepare()
    yield 0.5
    picture("chosen")
    settings.iterations = MANY
    in_window(bpy.ops.selenite.fit_models, "INVOKE_DEFAULT")
    left = state.MODELS.job.folder
    yield fitting
    picture("fitting")
    in_window(bpy.ops.selenite.cancel)
    yield lambda: state.is_idle()
    assert not left.exists() and not len(settings.models), "a cancelled run leaves nothing"

    in_window(bpy.ops.selenite.fit_models, "INVOKE_DEFAULT")
    yield fitting
    yield ended
    settings = bpy.context.scene.selenite
    assert [row.name for row in settings.models] == ["opaque"], "Esc keeps what it has"
    assert settings.models[0].kept
    yield 0.5
    picture("ended")

    in_window(bpy.ops.selenite.apply_model, "EXEC_DEFAULT", True)
    yield state.is_idle
    yield 0.5
    assert bpy.data.objects["Body"].active_material["selenite_material_before"] == "Body before"
    picture("applied")
    in_window(bpy.ops.ed.undo)
    yield 0.5
    assert "selenite_material_before" not in bpy.data.objects["Body"].active_material

    in_window(bpy.ops.selenite.fit_models, "INVOKE_DEFAULT")
    left = state.MODELS.job.folder
    yield fitting
    in_window(bpy.ops.wm.read_homefile, use_empty=True)  # the modal operator is cancelled
    yield 0.5
    assert state.MODELS.job is None and not left.exists(), "loading a file ends the process"


run(steps, panels, shown=[panels.SELENITE_PT_models, panels.SELENITE_PT_fit])
