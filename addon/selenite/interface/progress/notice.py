# SPDX-License-Identifier: GPL-3.0-or-later
"""The end of a fit is noticed: a report, afterwards a line in the status bar, and the result in
sight."""

from __future__ import annotations

from contextlib import suppress
from functools import partial

import bpy

from ...messages import joined, phrase, unpacked
from ..state import is_idle
from ..texts import shown, translated

#: Seconds that Blender shows a report in the status bar at most, and that the same line then stays
#: there for who has looked away.
_REPORTED_FOR, _SHOWN_FOR = 10.0, 15.0
_SENTENCE = [""]  # of the last fit


def notify(operator: bpy.types.Operator, scene: bpy.types.Scene) -> None:
    """Reports the verdict, leaves it in the status bar, and scrolls to the result."""
    words = joined(" ", unpacked(scene.selenite.verdict)) or translated("see Result")
    text = shown(phrase(translated("Fit ended: {}").replace("{}", "{words}"), words=words))
    operator.report({"INFO"}, text)
    if bpy.app.background:
        return
    _SENTENCE[0] = text
    bpy.app.timers.register(partial(_stay, text), first_interval=_REPORTED_FOR)
    scroll_up()


def scroll_up() -> None:
    """To the head of the tab, a moment later: progress and Stop, or the result, are there."""
    if not bpy.app.background:
        bpy.app.timers.register(_scroll_up, first_interval=0.1)


def _stay(text: str) -> None:
    """Not earlier: a report stands in the same bar."""
    if is_idle() and text == _SENTENCE[0]:
        _set_status(text)
        bpy.app.timers.register(_give_back, first_interval=_SHOWN_FOR)


def _give_back() -> None:
    if is_idle():
        _set_status(None)


def _set_status(text: str | None) -> None:
    for window in bpy.context.window_manager.windows:
        window.workspace.status_text_set(text)


def _scroll_up() -> None:
    """The head and the result below it are the first panels of the tab."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions if area.type == "VIEW_3D" else ():
                if region.type == "UI" and region.width > 1:
                    shown = bpy.context.temp_override(window=window, area=area, region=region)
                    with suppress(RuntimeError), shown:  # a tab without anything to scroll
                        bpy.ops.view2d.reset()
