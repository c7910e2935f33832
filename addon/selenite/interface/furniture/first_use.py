# SPDX-License-Identifier: GPL-3.0-or-later
"""What another file begins with: nothing of the one before, and the preferences of the user in
scenes that Selenite has not been used in."""

from __future__ import annotations

import bpy
from bpy.app.handlers import persistent

from .. import state
from .preferences import preferences


def register() -> None:
    """From now on, and for every file that is loaded."""
    bpy.app.handlers.load_post.append(_begin)
    # A timer that a file load takes away keeps its function for ever, in bpy 4.5, and with it bpy:
    # as a module it then never ends.
    bpy.app.timers.register(_prepare, first_interval=0.1, persistent=True)


def unregister() -> None:
    """The inverse."""
    if _begin in bpy.app.handlers.load_post:
        bpy.app.handlers.load_post.remove(_begin)
    if bpy.app.timers.is_registered(_prepare):
        bpy.app.timers.unregister(_prepare)


@persistent
def _begin(*_arguments: object) -> None:
    state.forget()
    _prepare()


def _prepare() -> None:
    """A scene without captures, parameters and own quality gets that of the preferences."""
    wanted = preferences().preset
    for scene in bpy.data.scenes:
        settings = getattr(scene, "selenite", None)
        if settings is None or settings.is_property_set("preset"):
            continue
        untouched = not len(settings.captures) and not len(settings.rows)
        if untouched and wanted != settings.preset:
            settings.preset = wanted
