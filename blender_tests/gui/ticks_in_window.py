# SPDX-License-Identifier: GPL-3.0-or-later
"""Ticks of the interface that a running fit costs, at ten a second, the time of its thread, and how
long Cancel and Esc take: printed, not judged, since a display without a graphics card and a busy
machine lose ticks by themselves."""

import time

import bpy
from _driving import ENDLESS, in_window, made, photographed, press_escape, run

from selenite.interface import panels, state

TICK, SECONDS = 0.1, 20.0
TICKS: list[float] = []


def count():
    """Notes a tick."""
    TICKS.append(time.monotonic())
    return TICK


def lost():
    """Share of the ticks that did not come, and the longest time between two."""
    gaps = [b - a for a, b in zip(TICKS, TICKS[1:], strict=False)]
    expected = (TICKS[-1] - TICKS[0]) / TICK
    return max(0.0, 1 - len(gaps) / expected), max(gaps)


def measured(title):
    """Counts for a while, then prints; a generator as `steps`."""
    TICKS.clear()
    used = time.thread_time()
    bpy.app.timers.register(count, first_interval=TICK)
    yield SECONDS
    bpy.app.timers.unregister(count)
    share, longest = lost()
    used = (time.thread_time() - used) / (TICKS[-1] - TICKS[0])
    print(f"{title}: {100 * share:.1f} % of {len(TICKS)} ticks lost, longest {longest:.2f} s")
    print(f"{title}: the interface's thread used {100 * used:.1f} % of a core")


def ended(title, began):
    """Waits for the end of the run; a generator."""
    while state.RUN.is_active:
        yield 0.01
    print(f"{title}: {time.monotonic() - began:.3f} s")


def steps():
    """See `_driving.run`."""
    made.studio()
    settings = photographed(0.1)
    next(item for item in settings.rows if item.parameter == "base_color").enabled = True
    settings.iterations, settings.loss, settings.optimiser = ENDLESS, "mae", "adam"
    settings.height = 256
    yield 2.0
    yield from measured("without a fit")
    in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
    yield lambda: state.RUN.progress is not None
    yield from measured("with a fit")
    began = time.monotonic()
    in_window(bpy.ops.selenite.cancel)
    yield from ended("Cancel", began)
    in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
    yield lambda: state.RUN.progress is not None
    began = time.monotonic()
    press_escape()
    yield from ended("Esc", began)


run(steps, panels, {panels.SELENITE_PT_head, panels.SELENITE_PT_fit})
