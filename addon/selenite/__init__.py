# SPDX-License-Identifier: GPL-3.0-or-later
"""Selenite: finds the material parameters that make a render match photos.

The folders follow the sentence "read the scene -> render it with derivatives -> compare with the
photos -> step -> write the values back": `scene_read`, the native modules, `fit_run`, `write_back`.
`import selenite` needs neither bpy nor the native modules; both are imported where they are used.
"""

from __future__ import annotations

bl_info = {
    "name": "Selenite",
    "author": "The Selenite authors",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "3D View > Sidebar > Selenite",
    "description": "Fits material parameters to photos by differentiable rendering",
    "category": "Material",
}

__version__ = "0.1.0"


def register() -> None:
    """Called by Blender when the add-on is switched on."""
    from . import interface

    interface.register()


def unregister() -> None:
    """Called by Blender when the add-on is switched off."""
    from . import interface

    interface.unregister()
