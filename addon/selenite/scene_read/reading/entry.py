# SPDX-License-Identifier: GPL-3.0-or-later
"""When the thread of a render job goes on: between two redraws of Blender's windows.

Blender draws its windows after a graph is asked for, and after it is evaluated. A drawing that
competes with the evaluation, or with Python for its lock, lasts several times as long. While
Blender evaluates, it draws its 3D views black. So the thread waits for a redraw before it
evaluates, and for one before it reads.

Blender notes in one place, for all threads, whether Python may change its data. A panel that draws
sets it to no; each call of a class puts back at its end what it found at its begin. An engine that
is entered while a panel draws thus leaves it at no, and Blender refuses every change until it is
started again. So the thread waits, after the evaluation, until an operator lets it in.
"""

from __future__ import annotations

import threading

import bpy

#: Seconds that the thread waits at each place, in case no operator comes; and an operator for the
#: thread.
_PATIENCE, _SHORT = 1.0, 0.2
#: Seconds that an operator waits for the evaluation: so the views of a small scene are never black.
_AT_ONCE = 0.03


class Entry:
    """Between the main thread and that of a render job. `arm` and `disarm` on the main thread."""

    def __init__(self) -> None:
        self._ready, self._entered = threading.Event(), threading.Event()
        self._evaluates, self._open, self._reads = (threading.Event() for _ in range(3))
        self._is_armed = False

    def arm(self) -> None:
        """From now the next evaluation for a render waits at its begin and at its end."""
        self._is_armed = True
        bpy.app.handlers.render_pre.append(self._wait_to_evaluate)
        bpy.app.handlers.frame_change_post.append(self._wait_to_enter)

    def disarm(self) -> None:
        """The inverse; twice is no fault."""
        self.open()
        for handlers, function in (
            (bpy.app.handlers.render_pre, self._wait_to_evaluate),
            (bpy.app.handlers.frame_change_post, self._wait_to_enter),
        ):
            if function in handlers:
                handlers.remove(function)

    def open(self) -> None:
        """Nobody waits any more. From any thread."""
        for event in (self._evaluates, self._open, self._reads):
            event.set()

    def let_on(self) -> bool:
        """In a call of an operator, after a redraw: the thread goes on from where it waits. Whether
        it has entered now."""
        patience = 0.0 if self._evaluates.is_set() else _AT_ONCE
        self._evaluates.set()
        if self._entered.is_set():
            self._reads.set()
            return False
        if not self._ready.wait(patience):
            return False
        self._open.set()
        return self._entered.wait(_SHORT)

    def entered(self) -> None:
        """In the thread, inside. Waits for the redraw."""
        self._entered.set()
        if self._is_armed:
            self._reads.wait(_PATIENCE)

    def _wait_to_evaluate(self, *_: object) -> None:
        if threading.current_thread() is not threading.main_thread():
            self._evaluates.wait(_PATIENCE)

    def _wait_to_enter(self, *_: object) -> None:
        if threading.current_thread() is not threading.main_thread():
            self._ready.set()
            self._open.wait(_PATIENCE)
