# SPDX-License-Identifier: GPL-3.0-or-later
"""How a script of this folder drives a Blender window; not a script itself."""

import os
import subprocess
import sys
import tempfile
import traceback
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import made_geometry as geometry  # noqa: E402, F401 - scripts take it from here
import made_scenes as made  # noqa: E402

PICTURES = Path(os.environ.get("SELENITE_PICTURES", tempfile.mkdtemp()))
FOLDER = Path(tempfile.mkdtemp())  # for what a script writes
ENDLESS = 1_000_000  # iterations or samples


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


def whole_screen(name):
    """A picture of all windows, as a file browser has its own."""
    subprocess.run(["import", "-window", "root", str(PICTURES / f"{name}.png")], check=True)


def click_tab(below=35):
    """A click on the tab of the sidebar that is so many pixels below its upper end, at a scale of
    the interface of 1; the first one is ours."""
    shown, area = window()[:2]
    region = next(item for item in area.regions if item.type == "UI")
    x, y = region.x + region.width - 10, region.y + region.height - below
    shown.event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=y)
    shown.event_simulate(type="LEFTMOUSE", value="PRESS", x=x, y=y)
    shown.event_simulate(type="LEFTMOUSE", value="RELEASE", x=x, y=y)


def photographed(value):
    """The panel's settings, with its rows and a photo of one grey for the scene's camera."""
    bpy.context.view_layer.update()
    photo = made.photo(FOLDER / "Camera.png", value=value)
    settings = bpy.context.scene.selenite
    assert in_window(bpy.ops.selenite.refresh_rows) == {"FINISHED"}
    in_window(bpy.ops.selenite.add_capture)
    settings.captures[0].photo = bpy.data.images.load(str(photo))
    return settings


def running():
    """The native thread of a fit works and a tick has seen it."""
    from selenite.interface import state

    fitting = state.RUN.fitting
    progress = fitting.progress if fitting is not None else None
    return progress is not None and progress.iteration > 1


def press_escape():
    """With the pointer in the middle of the 3D View."""
    shown, area = window()[:2]
    x, y = area.x + area.width // 2, area.y + area.height // 2
    shown.event_simulate(type="ESC", value="PRESS", x=x, y=y)
    shown.event_simulate(type="ESC", value="RELEASE", x=x, y=y)


def run(steps, panels, shown=None):
    """Registers the add-on and goes through the generator `steps`; `shown`: panels of the tab,
    with the head; None: all of them.

    The steps begin without any object. Each yield waits: a number of seconds, or a condition that
    must come true. Blender quits at the end, with status 1 after a failure.
    """
    import selenite

    # Panels of another tab leave room: the sidebar shows its first one, which the head is in, and
    # a script cannot choose another one in Blender 3.4.
    for item in panels.CLASSES if shown is not None else ():
        if issubclass(item, bpy.types.Panel) and item not in (panels.SELENITE_PT_head, *shown):
            item.bl_category = "Other"
    selenite.register()
    sequence, waiting = _in_empty_scene(steps), [0.0, 0]
    bpy.app.timers.register(lambda: _drive(sequence, waiting), first_interval=1.0, persistent=True)


def _in_empty_scene(steps):
    """The steps, in a window that shows the sidebar."""
    window()[3].show_region_ui = True
    bpy.context.preferences.view.ui_scale = 0.6  # more panels fit the window and are drawn
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    yield from steps()


def _drive(sequence, waiting):
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
