# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws what the Image Editors show of a fit, while it runs and after it.

A timer of Blender's calls `VIEW` a few times a second. What it draws while a fit runs takes at most
a twentieth of the time of the main thread; renders are made in a thread of their own.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ... import native
from ...capture.scene_captures import ids_of
from ...fit.job import DESCENT, FitFailed
from ...messages import message
from ...report.pictures import plots, sheet
from ...report.pictures.canvas import encoded
from ...report.pictures.comparison import (
    BEFORE_AFTER,
    ERROR_SCALE,
    PHOTO,
    Choice,
    Pictures,
    compared,
)
from ...report.pictures.moments import RESULT, START, Moment, Moments
from ..chosen import chosen
from ..running.outcome import Outcome
from ..running.run import FittingPhase
from ..state import CHECK, RUN
from ..texts import translated
from ..ticking import redraw
from . import images
from .properties import listen, settings
from .renderer import Renderer
from .thumbnails import THUMBNAILS

if TYPE_CHECKING:
    from ..._core import Progress

#: Seconds between two calls of the timer, between two pictures, between two pages of plots.
TICK, PICTURE_EVERY, PLOTS_EVERY = 0.2, 0.5, 1.0
#: How often the time that a drawing took fits between it and the next one.
_TIMES = 20.0
#: Images that are drawn in the size that their editor has room for.
_TO_SIZE = (images.COMPARISON, images.PLOTS, images.SHEET)
#: Ticks after which an editor that was opened has its size.
_LAID_OUT = 3


class LiveView:
    """What was drawn last, and when the next drawing is due. `seconds`: what the main thread spent
    on drawings, `drawings` of them, since the fit began."""

    def __init__(self) -> None:
        self.renderer = Renderer()
        self.areas: dict[int, str] = {}  # of editors that were opened: address -> image
        self.seconds, self.drawings = 0.0, 0
        self.is_unwanted = False  # the user has closed the editors
        self._moments: Moments | None = None
        self._tiles: dict[str, dict[str, np.ndarray]] = {}
        self._keys: dict[str, object] = {}
        self._due: dict[str, float] = {}
        self._drawn: dict[str, float] = {}  # in the last tick: when that ended
        self._unfitted: dict[int, int] = {}  # editors to zoom: address -> ticks
        self._forgotten: Outcome | None = None

    # -- called by operators, properties and handlers

    def begin(self) -> None:
        """A fit has started."""
        self.seconds, self.drawings = 0.0, 0
        self._forget()
        self.wake()

    def wake(self) -> None:
        """Something is to be drawn anew."""
        self._due.clear()
        if not bpy.app.background and not bpy.app.timers.is_registered(_tick):
            bpy.app.timers.register(_tick, first_interval=0.05, persistent=True)

    def open(self, area: bpy.types.Area, name: str) -> None:
        """An Image Editor shows one of our images from now on."""
        self.areas[area.as_pointer()] = name
        self._unfitted[area.as_pointer()] = _LAID_OUT
        images.assign(area, name)
        self._keys.clear()
        self.wake()

    def close(self, area: bpy.types.Area) -> None:
        """No longer."""
        self.areas.pop(area.as_pointer(), None)

    def switch(self, content: str) -> None:
        """The first of the editors shows something else."""
        found = next(
            (area for _, area in images.editors() if area.as_pointer() in self.areas), None
        )
        if found is not None:
            self.open(found, images.NAMES[content])

    def stop(self) -> None:
        """Another file is loaded, or the add-on goes: nothing of the run is shown any more."""
        self._forget()
        self.areas.clear()
        self._forgotten = RUN.done
        if bpy.app.timers.is_registered(_tick):
            bpy.app.timers.unregister(_tick)

    # -- called by the timer

    def update(self) -> bool:
        """Draws what is due. Returns whether there is a reason to be called again."""
        self._count_redraw()
        self._keep_editors()
        shown = images.shown_names()
        if not shown and not self._lacks_thumbnails():
            self.renderer.stop()
            return RUN.fitting is not None
        finished = self.renderer.poll()
        if finished:
            self._due.clear()
        fitting, done = RUN.fitting, RUN.done
        if fitting is not None:
            self._while_running(shown, fitting)
        elif done is not None and done is not self._forgotten:
            if self._moments is None or self._moments.result is not done.result:
                self._forget()
                self._moments = Moments(done.plan, done.result)
            self._after_fit(shown, self._moments)
        if images.CYCLES in shown:
            self._show_cycles()
        self._fit_editors()
        return True

    def capture_index(self) -> int:
        """Of the panel's active row among the photos of the fit; the first where that is none."""
        fit = RUN.fitting or RUN.last
        scene: bpy.types.Scene | None = bpy.data.scenes.get(fit.scene_name) if fit else None
        if scene is None or fit is None:
            return 0
        name = chosen(ids_of(scene), scene.selenite.active_capture)
        ids = [item.id for item in fit.plan.captures]
        return ids.index(name) if name in ids else 0

    def row(self, moments: Moments) -> int:
        """Which moment is chosen: START, RESULT or a row of the history."""
        shown = settings()
        if shown.moment == "START":
            return START
        iterations = moments.iterations
        if shown.moment == "RESULT" or not len(iterations):
            return RESULT
        wanted = round(shown.timeline / 100 * float(iterations[-1]))
        return int(np.flatnonzero(iterations <= wanted)[-1])

    def moment_text(self) -> str:
        """For the panel: which iteration the timeline is at."""
        if self._moments is None or settings().moment != "ITERATION":
            return ""
        row = self.row(self._moments)
        iterations = self._moments.iterations
        text = translated("Iteration {} of {}")
        return text.format(iterations[row], iterations[-1]) if len(iterations) else ""

    def _while_running(self, shown: set[str], fitting: FittingPhase) -> None:
        job, plan, progress = fitting.job, fitting.plan, fitting.progress
        if images.COMPARISON in shown and self._is_due(images.COMPARISON):
            begin = time.perf_counter()
            index = self.capture_index()
            capture, picture = plan.captures[index], job.preview(index)
            where = "starting" if progress is None else _phase(progress)
            page = compared(
                Pictures(capture.reference, capture.weight, picture),
                _choice(),
                f"{capture.id}: {where}",
                images.room_of(images.COMPARISON),
            )
            self._draw(images.COMPARISON, page, begin, PICTURE_EVERY)
        if images.PLOTS in shown and self._is_due(images.PLOTS):
            begin = time.perf_counter()
            try:
                history = job.history()
            except FitFailed:
                return
            if len(history.iteration):
                room = images.room_of(images.PLOTS)
                page = plots.page(plots.of_fit(plan, history), room).pixels
                self._draw(images.PLOTS, page, begin, PLOTS_EVERY)

    def _after_fit(self, shown: set[str], moments: Moments) -> None:
        plan, row = moments.plan, self.row(moments)
        if images.COMPARISON in shown:
            self._show_moment(moments, Moment(self.capture_index(), row))
        if images.PLOTS in shown:
            mark = float(moments.iterations[row]) if row >= 0 else None
            room = images.room_of(images.PLOTS)
            if self._changed(images.PLOTS, (id(moments), mark, room)):
                begin = time.perf_counter()
                history = moments.result.fit.history
                page = plots.page(
                    plots.of_fit(plan, history, moments.result.fit, mark), room
                ).pixels
                self._draw(images.PLOTS, page, begin, 0.0)
        if images.SHEET in shown:
            self._show_sheet(moments)
        if self._lacks_thumbnails():
            self._show_thumbnails(moments)

    def _lacks_thumbnails(self) -> bool:
        """Whether the result in the panel is that of this session and has not been drawn small."""
        done = RUN.done
        if done is None or done is self._forgotten or self.renderer.trouble:
            return False
        return THUMBNAILS.key != (id(done.result), self.capture_index())

    def _show_thumbnails(self, moments: Moments) -> None:
        """Once nothing else is rendered."""
        index = self.capture_index()
        picture = moments.kept(Moment(index, RESULT))
        if picture is None:
            if not self.renderer.busy:
                self.renderer.want(moments, Moment(index, RESULT))
            return
        capture = moments.plan.captures[index]
        key = (id(moments.result), index)
        THUMBNAILS.show(key, capture.reference, capture.weight, picture)
        redraw(bpy.context)

    def _show_moment(self, moments: Moments, moment: Moment) -> None:
        """What is there of it, and wishes for what is not."""
        choice = _choice()
        capture = moments.plan.captures[moment.photo]
        needed = [moment]
        if choice.mode == BEFORE_AFTER:
            needed = [Moment(moment.photo, START), moment]
        if choice.mode == PHOTO:
            needed = []
        missing = [item for item in needed if moments.kept(item) is None]
        picture = moments.kept(moment)
        start = moments.kept(Moment(moment.photo, START)) if len(needed) == 2 else None
        if missing and not self.renderer.trouble:
            self.renderer.want(moments, missing[0])
        words = _moment_words(moments, moment.row)
        if missing:
            words += f" ({self.renderer.trouble or 'rendering'})"
        room = images.room_of(images.COMPARISON)
        there = (picture is None, start is None)
        if self._changed(images.COMPARISON, (id(moments), moment, choice, there, room)):
            begin = time.perf_counter()
            pictures = Pictures(capture.reference, capture.weight, picture, start)
            page = compared(pictures, choice, f"{capture.id}: {words}", room)
            self._draw(images.COMPARISON, page, begin, 0.0)

    def _show_sheet(self, moments: Moments) -> None:
        """Photo by photo, as their renders end."""
        captures = moments.plan.captures
        for index, capture in enumerate(captures):
            if capture.id in self._tiles:
                continue
            both = [Moment(index, START), Moment(index, RESULT)]
            pictures = [moments.kept(item) for item in both]
            start, final = pictures
            if start is None or final is None:
                if not self.renderer.trouble:
                    self.renderer.want(moments, both[0] if start is None else both[1])
                break
            self._tiles[capture.id] = sheet.small(capture.reference, capture.weight, start, final)
        room = images.room_of(images.SHEET)
        if self._tiles and self._changed(images.SHEET, (id(moments), len(self._tiles), room)):
            begin = time.perf_counter()
            page = sheet.of_fit(self._tiles, ERROR_SCALE, room[0] if room else None).pixels
            self._draw(images.SHEET, page, begin, 0.0)

    def _show_cycles(self) -> None:
        """The sheet that the last check wrote."""
        if CHECK.sheet is None or not self._changed(images.CYCLES, str(CHECK.sheet)):
            return
        try:
            picture = native.image().read(str(CHECK.sheet))[0]
        except OSError:
            return
        begin = time.perf_counter()
        self._draw(images.CYCLES, encoded(picture), begin, 0.0)

    # -- bookkeeping

    def _draw(self, name: str, page: np.ndarray, begin: float, every: float) -> None:
        image: bpy.types.Image | None = bpy.data.images.get(name)
        size = tuple(image.size) if image is not None else ()
        images.show(name, page)
        if size != (page.shape[1], page.shape[0]):
            self._unfitted |= {
                address: _LAID_OUT for address, own in self.areas.items() if own == name
            }
        cost = time.perf_counter() - begin
        self.seconds, self.drawings = self.seconds + cost, self.drawings + 1
        self._drawn[name] = time.monotonic()
        self._due[name] = self._drawn[name] + max(every, _TIMES * cost)

    def _count_redraw(self) -> None:
        """A display without a graphics card takes longer to show a picture than it takes to make:
        by so much this tick is late."""
        now = time.monotonic()
        for name, ended in self._drawn.items():
            late = max(0.0, now - ended - TICK)
            self._due[name] = max(self._due.get(name, 0.0), now + _TIMES * late)
        self._drawn.clear()

    def _is_due(self, name: str) -> bool:
        return time.monotonic() >= self._due.get(name, 0.0)

    def _changed(self, name: str, key: object) -> bool:
        if self._keys.get(name) == key and bpy.data.images.get(name) is not None:
            return False
        self._keys[name] = key
        return True

    def _forget(self) -> None:
        self.renderer.stop()
        self.renderer.trouble = ""
        self._moments = None
        THUMBNAILS.forget()
        self._tiles, self._keys, self._due = {}, {}, {}

    def _keep_editors(self) -> None:
        """After undo, or saving, an editor has lost its image; the user may also have given it
        another one, which stays."""
        there = {area.as_pointer(): area for _, area in images.editors()}
        for address, name in list(self.areas.items()):
            area = there.get(address)
            image = images.image_of(area) if area is not None else None
            if area is None or (image is not None and image.name != name):
                del self.areas[address]
            elif image is None:
                images.assign(area, name)
                self._keys.pop(name, None)

    def _fit_editors(self) -> None:
        """Zooms what was opened, until it is laid out."""
        for window, area in images.editors():
            if area.as_pointer() in self._unfitted:
                drawn_to_size = self.areas.get(area.as_pointer()) in _TO_SIZE
                large = bpy.context.preferences.system.pixel_size > 1
                images.fit(window, area, whole=large or not drawn_to_size)
        self._unfitted = {address: n - 1 for address, n in self._unfitted.items() if n > 1}


VIEW = LiveView()
listen(VIEW.wake, VIEW.switch)


def _tick() -> float | None:
    return TICK if VIEW.update() else None


def _choice() -> Choice:
    shown = settings()
    return Choice(shown.mode, shown.wipe, shown.scale)


def _phase(progress: Progress) -> str:
    if progress.phase != DESCENT:
        return progress.phase
    return message(
        "view.iteration",
        "iteration {iteration} of {iterations}",
        iteration=progress.iteration,
        iterations=progress.iterations,
    )


def _moment_words(moments: Moments, row: int) -> str:
    if row == START:
        return "start"
    if row == RESULT:
        return "fit"
    words = message(
        "view.iteration-2",
        "iteration {iteration} of {last}",
        iteration=moments.iterations[row],
        last=moments.iterations[-1],
    )
    return (
        message("view.fitted-grids-images", "{words}, fitted grids and images", words=words)
        if moments.plan.fields
        else words
    )
