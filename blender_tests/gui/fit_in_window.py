# SPDX-License-Identifier: GPL-3.0-or-later
"""Start, live progress, Esc, Apply, undo, and a file load during a run, in a real window."""

import os
import sys
import tempfile
import traceback
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import made_scenes as made  # noqa: E402

import selenite  # noqa: E402
from selenite.interface import panels, state  # noqa: E402

PICTURES = Path(os.environ.get("SELENITE_PICTURES", tempfile.mkdtemp()))
ENDLESS = 1_000_000  # iterations


def window():
    """(window, area, region, space) of the 3D View."""
    shown = bpy.context.window_manager.windows[0]
    area = next(item for item in shown.screen.areas if item.type == "VIEW_3D")
    region = next(item for item in area.regions if item.type == "WINDOW")
    return shown, area, region, area.spaces.active


def in_window(operator, *arguments, **options):
    """Runs an operator as a click in the 3D View does."""
    shown, area, region, _ = window()
    with bpy.context.temp_override(window=shown, area=area, region=region):
        return operator(*arguments, **options)


def picture(name):
    """A screenshot; the operator redraws first, so every panel is drawn."""
    in_window(bpy.ops.screen.screenshot, filepath=str(PICTURES / f"{name}.png"))


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
    """Each yield waits: a number of seconds, or a condition that must come true."""
    window()[3].show_region_ui = True
    bpy.context.preferences.view.ui_scale = 0.6  # all panels fit the window and are drawn
    material = prepare()
    name, before = material.name, tuple(made.socket(material, "base_color").default_value)
    yield 0.5
    picture("ready")
    in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
    assert state.RUN.job is not None
    yield running
    picture("running")
    shown, area = window()[:2]
    x, y = area.x + area.width // 2, area.y + area.height // 2
    shown.event_simulate(type="ESC", value="PRESS", x=x, y=y)
    shown.event_simulate(type="ESC", value="RELEASE", x=x, y=y)
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


def drive(sequence, waiting):
    """Timer: goes on when the wait is over; quits at the end, with status 1 after a failure."""
    try:
        if callable(waiting[0]) and not waiting[0]():
            waiting[1] += 1
            assert waiting[1] < 600, "waited in vain"
            return 0.1
        waiting[:] = [next(sequence), 0]
        return 0.1 if callable(waiting[0]) else waiting[0]
    except StopIteration:
        in_window(bpy.ops.wm.quit_blender)
    except Exception:  # the window must close whatever happens
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)
    return None


# The sidebar shows its first tab, and a script cannot choose another one in Blender 3.4.
for item in panels.CLASSES:
    if issubclass(item, bpy.types.Panel):
        item.bl_category = "Item"
selenite.register()
sequence, waiting = steps(), [0.0, 0]
bpy.app.timers.register(lambda: drive(sequence, waiting), first_interval=1.0, persistent=True)
