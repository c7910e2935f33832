# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel's settings of a scene, which Blender knows only while the add-on is registered."""

from __future__ import annotations

_registered_here = False


def make_known() -> None:
    """Registers the add-on unless it is: so a .blend's captures are those of the panel. Call it
    before the file is opened."""
    global _registered_here
    import bpy

    from .. import register

    if not hasattr(bpy.types.Scene, "selenite"):
        register()
        _registered_here = True


def release() -> None:
    """Undoes what `make_known` has done, at the end of a command."""
    global _registered_here
    if _registered_here:
        from .. import unregister

        _registered_here = False
        unregister()
