# SPDX-License-Identifier: GPL-3.0-or-later
"""Selenite: finds the material parameters that make a render match photos.

The folders follow the sentence "read the scene -> render it with derivatives -> compare with the
photos -> step -> write the values back": `scene_read`, the native modules, `fit`, `write_back`.
`import selenite` needs neither bpy nor the native modules; both are imported where they are used.
"""

from __future__ import annotations

import importlib.util
import sys
from typing import Any

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


#: What the panel and the terminal say where numpy is not installed.
NUMPY_MISSING = (
    "Selenite needs the Python package numpy,",
    "which this Blender does not have.",
    "On Debian install python3-numpy:",
    "sudo apt install python3-numpy",
    "Then restart Blender.",
)
_notice: type | None = None


def register() -> None:
    """Called by Blender when the add-on is switched on.

    Debian's Blender runs without numpy. There the add-on is a panel that says what to install.
    """
    if importlib.util.find_spec("numpy") is None:
        _register_notice()
        return
    from . import interface

    interface.register()


def unregister() -> None:
    """Called by Blender when the add-on is switched off."""
    global _notice
    if _notice is not None:
        import bpy

        bpy.utils.unregister_class(_notice)
        _notice = None
        return
    from . import interface

    interface.unregister()


def _register_notice() -> None:
    global _notice
    import bpy

    class SELENITE_PT_notice(bpy.types.Panel):
        bl_label = "Selenite"
        bl_space_type = "VIEW_3D"
        bl_region_type = "UI"
        bl_category = "Selenite"

        def draw(self, _context: object) -> None:
            layout: Any = self.layout
            for line in NUMPY_MISSING:
                layout.label(text=line)

    bpy.utils.register_class(SELENITE_PT_notice)
    _notice = SELENITE_PT_notice
    sys.stderr.write(" ".join(NUMPY_MISSING) + "\n")
