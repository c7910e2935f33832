# SPDX-License-Identifier: GPL-3.0-or-later
"""A reading that goes on while Blender stays usable.

Blender evaluates a scene for a render, and our engine reads it, in the thread of a render job. What
a reading does between two graphs is done by who calls `step`, on the main thread.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeAlias, TypeVar

import bpy

from ...problems import Problem
from .render_depsgraph import Job, Reading, Stopped

T = TypeVar("T")
# A text: an alias that holds a type of Blender's keeps it from ending.
Handler: TypeAlias = "Callable[[bpy.types.Scene], None]"
_POLL = 0.1  # seconds


class ReadingJob(Generic[T]):
    """Call `step` in an operator now and then until it is False; `value` is there then.

    The user must not change the scene meanwhile. In a Blender without windows each step waits.
    """

    value: T

    def __init__(self, reading: Reading[T]) -> None:
        self._reading = reading
        self._render: Job | None = None
        self._answer: Problem | None = None
        self._rests = False
        self.is_stopped = False

    def step(self) -> bool:
        """Whether it goes on. Raises what the reading raises, and Stopped after `cancel`.

        Blender draws all its windows after a graph is asked for, after it is closed, and after what
        its reader does with it. Between these are idle steps, in which others have their turn: a
        drawing may take as long as a tick, and the next step comes at once then.
        """
        if self._rests:
            self._rests = False
            return True
        if self._render is not None:
            if self._render.entry.let_on():
                _redraw_views()
            if not self._render.is_running():
                self._answer = self._close().outcome()
                if self.is_stopped:
                    raise Stopped
                self._rests = True
            return True
        if self.is_stopped:
            raise Stopped
        answer, self._answer = self._answer, None
        try:
            self._render = self._reading.send(answer).job()
        except StopIteration as end:
            self.value = end.value
            return False
        for handlers in _before_undo():
            handlers.append(self._put_back)
        try:
            self._render.start(waits=bpy.app.background)
        except BaseException:
            self._close()
            raise
        self._rests = self._render.is_running()
        return True

    def text(self) -> str:
        """How far the step is that goes on; "" where nobody knows."""
        return self._render.text() if self._render is not None else ""

    def cancel(self) -> None:
        """The reading ends at the next object; `step` goes on until it has."""
        self.is_stopped = True
        if self._render is not None:
            self._render.stopped = True
            self._render.entry.open()

    def abandon(self) -> None:
        """As `cancel`, and nobody calls `step` any more."""
        self.cancel()

        def poll() -> float | None:
            if self._render is None:
                return None
            if self._render.is_running():
                return _POLL
            self._close()
            return None

        if poll() is not None:
            bpy.app.timers.register(poll, first_interval=_POLL)

    def _put_back(self, *_: object) -> None:
        """Before an undo, for which Blender has ended the render: afterwards the copy of the scene
        is gone, and whoever touches it ends the process."""
        self.is_stopped = True
        self._close()

    def _close(self) -> Job:
        render, self._render = self._render, None
        assert render is not None
        for handlers in _before_undo():
            handlers.remove(self._put_back)
        render.close()
        return render


def _redraw_views() -> None:
    """A 3D view that Blender draws during the evaluation for a render is locked, and black until
    it is drawn again."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions if area.type == "VIEW_3D" else ():
                if region.type == "WINDOW":
                    region.tag_redraw()


def _before_undo() -> tuple[list[Handler], list[Handler]]:
    return bpy.app.handlers.undo_pre, bpy.app.handlers.redo_pre
