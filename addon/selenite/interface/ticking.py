# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that go on while Blender stays usable: a timer calls them until their work is done."""

from __future__ import annotations

from typing import cast

import bpy

from .state import is_idle


class Ticking:
    """Base of a modal operator that looks at something at each tick of a timer; one at a time."""

    tick = 0.2  # seconds
    _timer: bpy.types.Timer | None = None

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Nothing runs that would slow it down."""
        cast("type[bpy.types.Operator]", cls).poll_message_set("A fit or a check is running")
        return is_idle()

    def _add_timer(self, context: bpy.types.Context) -> set[str]:
        """What `invoke` returns."""
        manager = context.window_manager
        self._timer = manager.event_timer_add(self.tick, window=context.window)
        manager.modal_handler_add(cast("bpy.types.Operator", self))
        return {"RUNNING_MODAL"}

    def _remove_timer(self, context: bpy.types.Context) -> None:
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None


def redraw(context: bpy.types.Context) -> None:
    """Only the sidebars: redrawing a whole 3D view at every tick makes Blender slow."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "UI":
                        region.tag_redraw()
