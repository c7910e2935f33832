# SPDX-License-Identifier: GPL-3.0-or-later
"""The image of the world while it is fitted and afterwards, in the sidebar.

A datablock without users holds the picture, so that no saved file has it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import bpy
import numpy as np

from .. import native
from ..advice.information.job import Step
from ..environments.bright_spots import Sun
from ..fit.fields import EnvironmentUnknown, fitted_environment
from ..fit.fields.environment import view_of
from ..fit.job import FitFailed
from ..scene_read.reading.render_depsgraph import Reading
from ..scene_read.scene import reading
from ..scene_read.values import SceneValues
from ..write_back import suns
from .pictures import images
from .progress.background import draw_work
from .state import RUN, SPOTS
from .texts import announce, translated
from .ticking import WorksInThread, redraw

if TYPE_CHECKING:
    from ..scene_read.hosts import BpyStruct

IMAGE = "Selenite Environment"
#: Seconds between two pictures.
_EVERY = 1.0


def begin() -> None:
    """A fit has started: its environment, if it has one, is drawn now and then."""
    if field() is not None and not bpy.app.background and not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=_EVERY, persistent=True)


def end() -> None:
    """The add-on goes."""
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    image: bpy.types.Image | None = bpy.data.images.get(IMAGE)
    if image is not None:
        bpy.data.images.remove(image)


def field() -> EnvironmentUnknown | None:
    """The image of the world among what the last fit has fitted."""
    fields = RUN.plan.fields if RUN.plan is not None else ()
    return next((item for item in fields if isinstance(item, EnvironmentUnknown)), None)


def update() -> bool:
    """Draws the newest values; returns whether the fit goes on."""
    unknown = field()
    if unknown is None:
        return False
    values, fitting, done = None, RUN.fitting, RUN.done
    if fitting is not None:
        try:
            values = fitting.job.field(unknown.name)
        except FitFailed:
            return False
    elif done is not None:
        values = fitted_environment(done.plan.fields, done.result.fields)
    show(unknown.start if values is None else values)
    return fitting is not None


def show(values: np.ndarray) -> bpy.types.Image:
    """Puts radiance (h, w, 3), row 0 at the top, into the datablock and its preview."""
    picture = native.image().srgb_encode(view_of(values))
    image, pixels = images.put(IMAGE, picture)
    preview: BpyStruct = image.preview_ensure()
    if preview is not None:
        preview.image_size = picture.shape[1::-1]
        preview.image_pixels_float.foreach_set(pixels)
    return image


class SELENITE_PT_environment(bpy.types.Panel):
    """The image of the world that is fitted"""

    bl_idname = "SELENITE_PT_environment"
    bl_label = "Environment"
    bl_parent_id = "SELENITE_PT_fit"
    bl_options = {"DEFAULT_CLOSED"}
    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "Selenite"

    def draw(self, context: bpy.types.Context) -> None:
        """The newest picture and its size, where the image of the world is fitted; what else can be
        done with the world's image."""
        unknown = field()
        if unknown is not None:
            rows, columns = unknown.values.shape[:2]
            text = translated("{} x {} directions").format(columns, rows)
            self.layout.label(text=text, icon="WORLD")
            image: BpyStruct = bpy.data.images.get(IMAGE)
            if image is not None and image.preview is not None:
                self.layout.template_icon(icon_value=image.preview.icon_id, scale=8.0)
        if not draw_work(self.layout, SPOTS):
            self.layout.operator("selenite.lamps_from_environment", icon="LIGHT_SUN")


class SpotSearch:
    """Looks for the bright spots of the world's image. Then `suns` and the `rest` (h, w, 3) of the
    image are there."""

    def __init__(self, values: SceneValues, most: int) -> None:
        self.values = values
        self.suns: list[Sun] = []
        self.rest: np.ndarray | None = None
        self._most = most

    def steps(self) -> Iterator[Step]:
        """One. Raises BadInput."""
        yield Step(0.0, "looking for bright spots")
        self.suns, self.rest = suns.proposed(self.values, self._most)

    def cancel(self) -> None:
        """It looks to the end."""


class SELENITE_OT_lamps_from_environment(WorksInThread):
    """Make Sun lamps of the bright spots of the world's image, and take their light out of it. Esc
    cancels"""

    bl_idname = "selenite.lamps_from_environment"
    bl_label = "Lamps from Environment"
    bl_options = {"REGISTER", "UNDO"}
    background = SPOTS
    failure = "No lamps are made"

    count: bpy.props.IntProperty(
        name="Suns", default=4, min=1, soft_max=16, description="At most, the strongest first"
    )

    def _asking(self, context: bpy.types.Context) -> Reading[SpotSearch]:
        values = yield from reading(context.scene)
        return SpotSearch(values, self.count)

    def _end(self, work: SpotSearch | None) -> set[str]:
        """All or nothing; one undo step."""
        scene: bpy.types.Scene | None = bpy.data.scenes.get(SPOTS.scene_name)
        if work is None or work.rest is None or scene is None:
            return {"CANCELLED"}
        done = suns.add(scene, work.values, work.suns, work.rest)
        for item in work.suns:
            announce(self, {"INFO"}, suns.text(item))
        announce(self, {"INFO"}, done)
        return {"FINISHED"}


def _tick() -> float | None:
    running = update()
    redraw(bpy.context)
    return _EVERY if running else None


CLASSES = (
    SELENITE_OT_lamps_from_environment,
    SELENITE_PT_environment,
)
