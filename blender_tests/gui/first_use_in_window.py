# SPDX-License-Identifier: GPL-3.0-or-later
"""The first fit of a new user in a real window, from the sample scene to its applied values: every
click is counted, ticks of the interface are, and the time that Cancel takes. With SELENITE_GUIDE in
the environment the fit is long enough for the pictures of docs/guide."""

import os
import time
from pathlib import Path

import bpy
from _driving import (
    ENDLESS,
    click_tab,
    in_window,
    picture,
    press_escape,
    run,
    running,
    whole_screen,
)

from selenite.interface import panels, state
from selenite.interface.pictures.thumbnails import THUMBNAILS
from selenite.interface.pictures.view import VIEW

CLICKS: list[str] = []
MOST_CLICKS = 6
TICK = 0.1
TICKS: list[float] = []


def click(what):
    """Notes what a user does."""
    CLICKS.append(what)


def has_sidebar():
    """The 3D View shows it."""
    screen = bpy.context.window_manager.windows[0].screen
    views = [area for area in screen.areas if area.type == "VIEW_3D"]
    return all(area.spaces.active.show_region_ui for area in views)


def browser():
    """(window, area) of the file browser; None while there is none."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "FILE_BROWSER":
                return window, area
    return None


def in_browser(operator, **options):
    """As a click in the file browser."""
    window, area = browser()
    region = next(item for item in area.regions if item.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        return operator(**options)


def count_ticks():
    """Ten a second, as the interface is alive."""
    TICKS.append(time.monotonic())
    return TICK


def lost():
    """Share of the ticks that did not come in their time."""
    expected = (TICKS[-1] - TICKS[0]) / TICK
    return max(0.0, 1 - (len(TICKS) - 1) / expected)


def show_window():
    """The sidebar as a user finds it: at its usual size, in the usual scale."""
    for area in bpy.context.window_manager.windows[0].screen.areas:
        if area.type == "VIEW_3D":
            area.spaces.active.show_region_ui = True
    bpy.context.preferences.view.ui_scale = 1.0


def steps():
    """See `_driving.run`."""
    show_window()
    yield 1.0
    click_tab()
    yield 1.0
    click("Open Sample Scene")
    in_window(bpy.ops.selenite.open_sample, "EXEC_DEFAULT")
    yield lambda: state.SAMPLE.step is not None
    picture("0_opening")
    while state.SAMPLE.job is not None:  # another Blender starts, as fast as it can
        yield 0.2
    yield 1.0
    assert "Pendant" in bpy.data.objects, state.SAMPLE.lines
    assert has_sidebar()
    yield 1.0
    picture("1_open")
    click("Load Photos")
    in_window(bpy.ops.selenite.load_photos, "INVOKE_DEFAULT")
    yield lambda: browser() is not None
    yield 5.0  # thumbnails are made
    assert Path(browser()[1].spaces.active.params.directory.decode()).name == "photos"
    assert browser()[1].spaces.active.params.display_type == "THUMBNAIL"
    assert browser()[1].spaces.active.params.filename == ""
    whole_screen("2_photos")
    click("the button of the browser")
    in_browser(bpy.ops.file.execute)
    settings = bpy.context.scene.selenite
    yield lambda: len(settings.captures) == 2 and len(settings.rows) > 0 and state.is_idle()
    yield lambda: state.PAIRING.job is None
    assert not any(state.PROBLEMS.values()), state.PROBLEMS
    yield 1.0
    ticked = {row.parameter for row in settings.rows if row.enabled}
    assert ticked == {"base_color", "roughness", "transmission", "ior"}, ticked
    picture("3_ready")
    if "SELENITE_GUIDE" in os.environ:
        settings.preset, settings.height = "draft", 96
    else:
        settings.height, settings.iterations, settings.search = 32, 8, "off"
    click("Start Fit")
    in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
    bpy.app.timers.register(count_ticks)
    yield running
    yield lambda: len(VIEW.areas) == 2 or not state.RUN.is_active
    assert len(VIEW.areas) == 2, "the pictures open with the fit"
    yield 2.0
    picture("4_running")
    fractions = []
    while state.RUN.is_active:
        fractions.append(state.RUN.phase.fraction)
        yield 0.2
    bpy.app.timers.unregister(count_ticks)
    assert fractions == sorted(fractions), "progress never runs backwards"
    yield lambda: THUMBNAILS.key is not None
    yield 1.5
    picture("5_result")
    click("Apply")
    in_window(bpy.ops.selenite.apply)
    yield 1.0
    picture("5_applied")
    assert len(bpy.context.scene.selenite.results) == 4, state.RUN.message
    print(f"CLICKS {len(CLICKS)}: {', '.join(CLICKS)}")
    print(f"TICKS LOST {100 * lost():.2f} % of {len(TICKS)}")
    assert len(CLICKS) <= MOST_CLICKS

    settings = bpy.context.scene.selenite
    settings.iterations, settings.loss, settings.optimiser = ENDLESS, "mae", "adam"
    in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
    yield running
    began = time.monotonic()
    in_window(bpy.ops.selenite.cancel)
    while state.RUN.is_active:
        yield 0.01
    print(f"CANCEL {time.monotonic() - began:.3f} s")
    assert len(bpy.context.scene.selenite.results) == 4, "Cancel keeps the result before"
    in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
    yield running
    began = time.monotonic()
    press_escape()
    while state.RUN.is_active:
        yield 0.01
    print(f"ESC {time.monotonic() - began:.3f} s")
    yield 1.0
    picture("6_stopped")


run(steps, panels)
