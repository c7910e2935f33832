# SPDX-License-Identifier: GPL-3.0-or-later
"""The moment at which the thread of a render job enters our engine.

Blender notes in one place, for all threads, whether Python may change its data. A panel that draws
sets it to no; each call of a class puts back at its end what it found at its begin. An engine that
is entered while a panel draws thus leaves it at no, and Blender refuses every change until it is
started again. So the thread waits, after the evaluation, until an operator lets it in.
"""

from __future__ import annotations

import threading

import bpy

#: Seconds that the thread waits, in case no operator comes; and an operator for the thread.
_PATIENCE, _SHORT = 1.0, 0.2


class Entry:
    """Between the main thread and that of a render job. `arm` and `disarm` on the main thread."""

    def __init__(self) -> None:
        self._ready, self._open, self._entered = (threading.Event() for _ in range(3))

    def arm(self) -> None:
        """From now the next evaluation for a render waits at its end."""
        bpy.app.handlers.frame_change_post.append(self._wait)

    def disarm(self) -> None:
        """The inverse; twice is no fault."""
        self.open()
        if self._wait in bpy.app.handlers.frame_change_post:
            bpy.app.handlers.frame_change_post.remove(self._wait)

    def open(self) -> None:
        """Nobody waits any more. From any thread."""
        self._open.set()

    def let_in(self, patience: float = 0.0) -> bool:
        """In a call of an operator: if the thread waits, or does so within `patience` seconds, it
        enters now. Whether it has."""
        if not self._ready.wait(patience) or self._entered.is_set():
            return False
        self._open.set()
        return self._entered.wait(_SHORT)

    def entered(self) -> None:
        """In the thread, inside."""
        self._entered.set()

    def _wait(self, *_: object) -> None:
        if threading.current_thread() is not threading.main_thread():
            self._ready.set()
            self._open.wait(_PATIENCE)
