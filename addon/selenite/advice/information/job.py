# SPDX-License-Identifier: GPL-3.0-or-later
"""Work that proceeds step by step, in a thread of its own."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar


@dataclass(frozen=True)
class Step:
    """How far it has come; `fraction` between 0 and 1."""

    fraction: float
    text: str


class Work(Protocol):
    """What a BackgroundJob drives."""

    def steps(self) -> Iterator[Step]:
        """Works from one step to the next; the result is left in the object itself."""

    def cancel(self) -> None:
        """From any thread: `steps` ends soon, by an exception or not."""


W_co = TypeVar("W_co", bound=Work, covariant=True)


class BackgroundJob(Generic[W_co]):
    """Start, progress, cancel, join. Blender is not touched from the thread."""

    def __init__(self, work: W_co) -> None:
        self.work = work
        self._step = Step(0.0, "")
        self._error: Exception | None = None
        self._cancelled = False
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self) -> None:
        """Returns at once."""
        self._thread.start()

    def progress(self) -> tuple[bool, Step]:
        """Whether it runs, and how far it has come."""
        return self._thread.is_alive(), self._step

    def cancel(self) -> None:
        """Asks the thread to stop; it does within a tile."""
        self._cancelled = True
        self.work.cancel()

    def join(self) -> bool:
        """Waits for the end; False if it was cancelled. Raises what went wrong."""
        self._thread.join()
        if self._cancelled:
            return False
        if self._error is not None:
            raise self._error
        return True

    def wait(self, seconds: float | None = None) -> bool:
        """Waits for the end, at most so long; whether it has ended. None: without a limit."""
        self._thread.join(seconds)
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            for step in self.work.steps():
                self._step = step
                if self._cancelled:
                    return
        except Exception as error:  # raised by `join`, in the thread that asked
            self._error = error
