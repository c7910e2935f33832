# SPDX-License-Identifier: GPL-3.0-or-later
"""Opens and closes the Image Editors that show a fit; keeps their images out of saved files."""

from __future__ import annotations

import atexit
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ...report.pictures.comparison import DIFFERENCE
from ..furniture.preferences import preferences
from ..state import RUN
from ..texts import announce
from . import images
from .properties import SelenitePictures, settings
from .thumbnails import THUMBNAILS
from .view import VIEW

#: Pixels of a 3D View, at a scale of 1, from which on pictures have room beside it.
_ROOM = 900


class _NeedsFit:
    """Base of the operators that show a fit."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """A fit runs or has ended in this session, and there is a window."""
        cls.poll_message_set("Run a fit first")  # type: ignore[attr-defined] # of Operator
        return RUN.plan is not None and context.window is not None


class SELENITE_OT_show_pictures(_NeedsFit, bpy.types.Operator):
    """Split the 3D View, and show photo and render beside it, with the plots below"""

    bl_idname = "selenite.show_pictures"
    bl_label = "Show Pictures"

    def execute(self, context: bpy.types.Context) -> set[str]:
        """An Image Editor that is open already is used."""
        main = images.NAMES[settings(context).content]
        screen = context.window.screen
        free = [area for area in screen.areas if area.type == "IMAGE_EDITOR"]
        VIEW.is_unwanted = False
        if any(area.as_pointer() in VIEW.areas for area in free):
            VIEW.wake()
            return {"FINISHED"}
        first = free[0] if free else self._split_view(context)
        if first is None:
            announce(self, {"ERROR"}, "There is no 3D View to split; open an Image Editor")
            return {"CANCELLED"}
        if len(free) > 1:
            second: bpy.types.Area | None = free[1]
        else:
            second = _split(context, first, "HORIZONTAL", 0.45)
        # After a split the upper area is the one that was there.
        upper, lower = first, second
        if lower is not None and lower.y > upper.y:
            upper, lower = lower, upper
        for area, name in ((upper, main), (lower, images.PLOTS)):
            if area is not None:
                area.type = "IMAGE_EDITOR"
                VIEW.open(area, name)
        return {"FINISHED"}

    @staticmethod
    def _split_view(context: bpy.types.Context) -> bpy.types.Area | None:
        views = [area for area in context.window.screen.areas if area.type == "VIEW_3D"]
        if not views:
            return None
        largest = max(views, key=lambda area: area.width * area.height)
        made = _split(context, largest, "VERTICAL", 0.5)
        if made is None:
            return None
        # The sidebar stays where the user has it: on the right.
        left, right = sorted((largest, made), key=lambda area: area.x)
        picture = left if right is largest else made
        picture.type = "IMAGE_EDITOR"
        return picture


class SELENITE_OT_hide_pictures(bpy.types.Operator):
    """Close the Image Editors that were opened for the pictures"""

    bl_idname = "selenite.hide_pictures"
    bl_label = "Hide Pictures"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """They are open."""
        return bool(VIEW.areas)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """The 3D View takes their place; the next fit leaves it there."""
        VIEW.is_unwanted = True
        for window in context.window_manager.windows:
            ours = [area for area in window.screen.areas if area.as_pointer() in VIEW.areas]
            for area in reversed(ours):
                VIEW.close(area)
                region = images.window_region(area)
                with context.temp_override(window=window, area=area, region=region):
                    bpy.ops.screen.area_close()
        images.put_away()
        return {"FINISHED"}


class SELENITE_OT_compare_pictures(_NeedsFit, bpy.types.Operator):
    """Show how far the fit is from the active photo, in the Image Editor"""

    bl_idname = "selenite.compare_pictures"
    bl_label = "Compare Pictures"

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Photo and render, and their difference."""
        settings(context).mode = DIFFERENCE
        show_content("COMPARISON")
        return {"FINISHED"}


def show_content(content: str) -> None:
    """Opens the pictures, or makes those that are open show something else."""
    settings().content = content
    window = bpy.context.window or bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, screen=window.screen):
        if bpy.ops.selenite.show_pictures.poll():
            bpy.ops.selenite.show_pictures()


def open_at_start() -> None:
    """A fit has started: its pictures are opened a moment later, unless the user does not want
    them."""
    if not bpy.app.background and preferences().pictures and not VIEW.is_unwanted:
        bpy.app.timers.register(_open, first_interval=0.2)


def _open() -> None:
    if RUN.is_active and not VIEW.areas and _has_room():
        show_content(settings().content)


def _has_room() -> bool:
    """Whether a 3D View can be split. What the user has opened in an Image Editor stays there."""
    areas = bpy.context.window_manager.windows[0].screen.areas
    editors = [area for area in areas if area.type == "IMAGE_EDITOR"]
    if editors:
        return all(images.image_of(area) is None for area in editors)
    scale = bpy.context.preferences.system.ui_scale or 1.0
    return any(area.type == "VIEW_3D" and area.width > _ROOM * scale for area in areas)


def _split(
    context: bpy.types.Context, area: bpy.types.Area, direction: str, factor: float
) -> bpy.types.Area | None:
    """The area that a split makes; None where there is no room."""
    screen = context.window.screen
    before = {item.as_pointer() for item in screen.areas}
    region = images.window_region(area)
    with context.temp_override(window=context.window, area=area, region=region):
        try:
            bpy.ops.screen.area_split(direction=direction, factor=factor)  # type: ignore[arg-type]
        except RuntimeError:  # too small
            return None
    return next((item for item in screen.areas if item.as_pointer() not in before), None)


@persistent
def _before_saving(*_names: object) -> None:
    images.put_away()


@persistent
def _after_saving(*_names: object) -> None:
    if VIEW.areas:
        VIEW.wake()


@persistent
def _before_loading(*_names: object) -> None:
    VIEW.stop()


_HANDLERS = (
    ("save_pre", _before_saving),
    ("save_post", _after_saving),
    ("load_pre", _before_loading),
)
CLASSES = (SELENITE_OT_show_pictures, SELENITE_OT_hide_pictures, SELENITE_OT_compare_pictures)


def register() -> None:
    """The properties of the session, and what happens when a file is saved or loaded."""
    manager: Any = bpy.types.WindowManager
    manager.selenite_pictures = bpy.props.PointerProperty(type=SelenitePictures)
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)
    atexit.register(VIEW.renderer.stop)


def unregister() -> None:
    """The inverse."""
    VIEW.stop()
    THUMBNAILS.end()
    images.put_away()
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
    atexit.unregister(VIEW.renderer.stop)
    manager: Any = bpy.types.WindowManager
    del manager.selenite_pictures
