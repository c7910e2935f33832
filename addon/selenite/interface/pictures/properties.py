# SPDX-License-Identifier: GPL-3.0-or-later
"""What the Image Editor shows of a fit: on the window manager, without undo or a place in files."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
from bpy.props import EnumProperty, FloatProperty

from ...report.pictures.comparison import BEFORE_AFTER, DIFFERENCE, ERROR_SCALE, PHOTO, RENDER, WIPE

CONTENT_ITEMS = (
    ("COMPARISON", "Active Photo", "The active photo beside its render", 0),
    ("PLOTS", "Plots", "Loss and parameters over the iterations", 1),
    ("SHEET", "All Photos", "Photo, start, fit and differences of every photo, after a fit", 2),
    ("CYCLES", "Check in Cycles", "The sheet of the last check in Cycles", 3),
)
MODE_ITEMS = (
    (PHOTO, "Photo", "The photo alone", 0),
    (RENDER, "Render", "The render alone", 1),
    (WIPE, "Wipe", "The photo on the left of a line, the render on its right", 2),
    (DIFFERENCE, "Difference", "How far the render is from the photo, in linear light", 3),
    (BEFORE_AFTER, "Before, After", "The start on the left, the fit on the right", 4),
)
MOMENT_ITEMS = (
    ("START", "Start", "With the values that the fit started from", 0),
    ("RESULT", "Fit", "With the fitted values", 1),
    ("ITERATION", "Iteration", "With the values of one iteration", 2),
)
#: What is called when something else is to be shown: by the view, which reads these properties.
_LISTENERS: dict[str, Callable[..., None]] = {}


def listen(changed: Callable[[], None], switched: Callable[[str], None]) -> None:
    """From now on `changed` is called after a change, `switched` with another content."""
    _LISTENERS.update(changed=changed, switched=switched)


def _changed(_group: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    if "changed" in _LISTENERS:
        _LISTENERS["changed"]()


def _content_changed(group: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    if "switched" in _LISTENERS:
        _LISTENERS["switched"](group.content)


class SelenitePictures(bpy.types.PropertyGroup):
    """What is shown, and how."""

    content: EnumProperty(
        name="Show", items=CONTENT_ITEMS, update=_content_changed, description="In the Image Editor"
    )
    mode: EnumProperty(
        name="As", items=MODE_ITEMS, default=WIPE, update=_changed, description="Photo and render"
    )
    wipe: FloatProperty(
        name="Wipe",
        default=0.5,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        update=_changed,
        description="Where the line stands between the two pictures",
    )
    scale: FloatProperty(
        name="Full Scale",
        default=ERROR_SCALE,
        min=0.001,
        soft_max=1.0,
        update=_changed,
        description="Difference that has the brightest colour, in linear light where white is 1",
    )
    moment: EnumProperty(
        name="At", items=MOMENT_ITEMS, default="RESULT", update=_changed, description="Which values"
    )
    timeline: FloatProperty(
        name="Timeline",
        default=100.0,
        min=0.0,
        max=100.0,
        precision=0,
        subtype="PERCENTAGE",
        update=_changed,
        description="Iteration whose values are rendered, from the first to the last",
    )


CLASSES = (SelenitePictures,)


def settings(context: bpy.types.Context | None = None) -> SelenitePictures:
    """Those of the session."""
    manager: Any = (context or bpy.context).window_manager
    found: SelenitePictures = manager.selenite_pictures
    return found
