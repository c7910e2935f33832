# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that go on while Blender stays usable: a timer calls them until their work is done."""

from __future__ import annotations

import time
from abc import abstractmethod
from collections.abc import Callable
from typing import TypeVar, cast

import bpy

from ..advice.information.job import BackgroundJob, Work
from ..fit.job import FitFailed
from ..messages import joined
from ..native import NativeUnavailable
from ..problems import BadInput
from ..scene_read.reading.job import ReadingJob
from ..scene_read.reading.render_depsgraph import Reading, Stopped, at_once
from .problem_reports import report_problems
from .running.run import ENDING
from .state import READING, Background, is_idle
from .texts import announce, shown, translated

T = TypeVar("T")
#: Events that change nothing but the view, while a scene is being read.
HARMLESS = {
    *("TIMER", "MOUSEMOVE", "INBETWEEN_MOUSEMOVE", "MIDDLEMOUSE"),
    *("WHEELUPMOUSE", "WHEELDOWNMOUSE", "TRACKPADPAN", "TRACKPADZOOM", "MOUSEROTATE"),
}


def built(operator: bpy.types.Operator, make: Callable[[], T]) -> T | None:
    """What `make` gives; None after it has been reported why there is nothing."""
    try:
        return make()
    except BadInput as error:
        report_problems(operator, error)
    except NativeUnavailable as error:
        announce(operator, {"ERROR"}, str(error))
    return None


class Ticking:
    """Base of a modal operator that polls something at each tick of a timer; one at a time."""

    tick = 0.1  # seconds
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


class ReadsScene(Ticking):
    """Base of a modal operator that reads the scene first, by a render job of Blender's. Esc
    cancels it; meanwhile only the view moves, for the scene must stay as it is."""

    tick = 0.05

    @abstractmethod
    def _with(self, context: bpy.types.Context, found: object) -> set[str]:
        """Goes on with what was read. Returns what `modal` returns."""

    def _read(self, context: bpy.types.Context, reading: Reading[object]) -> set[str]:
        """What `invoke` returns."""
        READING.job = ReadingJob(reading)
        answer = self._read_on(context)
        if answer & {"RUNNING_MODAL", "PASS_THROUGH"}:
            return self._add_timer(context)
        return answer

    def _reading(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """What `modal` returns while it is read."""
        if event.type == "ESC" and event.value == "PRESS":
            READING.cancel()
            show_status(context, ENDING)
        if event.type == "TIMER":
            answer = self._read_on(context)
            if not answer & {"RUNNING_MODAL", "PASS_THROUGH"}:
                self._remove_timer(context)
            return answer
        return {"PASS_THROUGH"} if event.type in HARMLESS else {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Until it is read."""
        if READING.job is None:
            self._remove_timer(context)
            return {"CANCELLED"}
        return self._reading(context, event)

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender quits or loads another file."""
        READING.stop()
        self._remove_timer(context)

    def _read_on(self, context: bpy.types.Context) -> set[str]:
        job = READING.job
        assert job is not None
        try:
            goes_on = built(cast("bpy.types.Operator", self), job.step)
        except Stopped:
            goes_on = None
        if goes_on:
            show_status(context, ENDING if job.is_stopped else job.text() or "reading the scene")
            return {"RUNNING_MODAL"}
        READING.job = None
        show_status(context, None)
        redraw(context)
        return {"CANCELLED"} if goes_on is None else self._with(context, job.value)


class WorksInThread(ReadsScene, bpy.types.Operator):
    """Base of an operator that waits for work in a thread. Esc cancels it."""

    background: Background
    #: How the report begins when the work failed.
    failure: str

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Reads what the work needs, then starts the thread; a timer polls both."""
        return self._read(context, self._asking(context))

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Without a window: waits for the end."""
        return self._finish(context) if self._start(context) else {"CANCELLED"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Everything but Esc passes through, so that Blender stays usable."""
        if READING.job is not None:
            return self._reading(context, event)
        if self.background.job is None:  # cancelled from elsewhere
            self._remove_timer(context)
            show_status(context, None)
            redraw(context)
            return {"CANCELLED"}
        if event.type == "ESC" and event.value == "PRESS":
            self.background.cancel()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        running, step = self.background.job.progress()
        self.background.step = getattr(self.background.job.work, "step", step)
        show_status(context, self.background.step.text, self.background.step.fraction)
        return {"PASS_THROUGH"} if running else self._finish(context)

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender quits or loads another file: the thread must end first."""
        self.background.stop()
        super().cancel(context)

    @abstractmethod
    def _asking(self, context: bpy.types.Context) -> Reading[Work]:
        """Reads what is needed; its outcome is what the thread does. Raises BadInput and
        NativeUnavailable."""

    @abstractmethod
    def _end(self, work: object) -> set[str]:
        """Reports what `work` found, None where it was cancelled. Returns what operators return."""

    def _start(self, context: bpy.types.Context) -> bool:
        """Reads at once."""
        work = built(self, lambda: at_once(self._asking(context)))
        if work is not None:
            self._with(context, work)
        return work is not None

    def _with(self, context: bpy.types.Context, found: Work) -> set[str]:
        self.background.start(BackgroundJob(found), context.scene.name)
        return {"RUNNING_MODAL"}

    def _finish(self, context: bpy.types.Context) -> set[str]:
        self._remove_timer(context)
        show_status(context, None)
        job, self.background.job = self.background.job, None
        try:
            return self._end(job.work if job.join() else None)
        except BadInput as error:
            report_problems(self, error)
        except (FitFailed, OSError, ValueError, RuntimeError) as error:
            announce(self, {"ERROR"}, joined(": ", (translated(self.failure), str(error))))
        finally:
            redraw(context)
        return {"CANCELLED"}


#: What the status bar shows; the sidebars are drawn again only when it changes.
_SHOWN: list[str] = [""]
_BLOCKS = 20
#: Seconds between two redraws: each may take a tick on a slow display.
_REDRAW_EVERY = 0.5
_DRAWN_AT: list[float] = [0.0]


def show_status(context: bpy.types.Context, text: str | None, fraction: float = 0.0) -> None:
    """Into the status bar, with the head of the panel; None gives the bar back. Draws only where
    there is something new: drawing is what makes Blender lose ticks."""
    line = ""
    if text is not None:
        done = round(_BLOCKS * min(max(fraction, 0.0), 1.0))
        line = f"Selenite  [{'|' * done}{'.' * (_BLOCKS - done)}]  {shown(text)}"
    now = time.monotonic()
    if line == _SHOWN[0] or (line and now - _DRAWN_AT[0] < _REDRAW_EVERY):
        return
    _SHOWN[0], _DRAWN_AT[0] = line, now
    for window in context.window_manager.windows:
        window.workspace.status_text_set(line or None)
    redraw(context)


def redraw(context: bpy.types.Context) -> None:
    """Only the sidebars: redrawing a whole 3D view at every tick makes Blender slow."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "UI":
                        region.tag_redraw()
