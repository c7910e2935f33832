# SPDX-License-Identifier: GPL-3.0-or-later
"""The end of a fit is noticed: a report, a line in the status bar, and the result in sight."""

from __future__ import annotations

from contextlib import suppress

import bpy

from ..state import is_idle
from ..texts import announce, shown, translated

#: Seconds that the line stays in the status bar.
_SHOWN_FOR = 15.0


def notify(
    operator: bpy.types.Operator, context: bpy.types.Context, scene: bpy.types.Scene
) -> None:
    """Reports the verdict, shows it in the status bar, and scrolls to the result."""
    verdict = scene.selenite.verdict
    words = shown(verdict) if verdict else translated("see Result")
    text = translated("Fit ended: {}").format(words)
    announce(operator, {"INFO"}, text)
    if bpy.app.background:
        return
    for window in context.window_manager.windows:
        window.workspace.status_text_set(text)
    bpy.app.timers.register(_give_back, first_interval=_SHOWN_FOR)
    bpy.app.timers.register(_scroll_to_result, first_interval=0.1)


def _give_back() -> None:
    if not is_idle():
        return
    for window in bpy.context.window_manager.windows:
        window.workspace.status_text_set(None)


def _scroll_to_result() -> None:
    """The head and the result below it are the first panels of the tab."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions if area.type == "VIEW_3D" else ():
                if region.type == "UI" and region.width > 1:
                    shown = bpy.context.temp_override(window=window, area=area, region=region)
                    with suppress(RuntimeError), shown:  # a tab without anything to scroll
                        bpy.ops.view2d.reset()
