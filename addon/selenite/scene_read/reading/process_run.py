# SPDX-License-Identifier: GPL-3.0-or-later
"""A step of a reading that another process does."""

from __future__ import annotations

import time
from abc import abstractmethod
from collections.abc import Callable

from ...problems import BadInput, Failed, Problem
from ..blender_process import BlenderProcess

_POLL = 0.05  # seconds


class _NothingWaits:
    """As `entry` of a render: the other process needs no turn of this one."""

    def let_on(self) -> bool:
        """Nobody has entered."""
        return False

    def open(self) -> None:
        """Nobody waits."""


class ProcessRun:
    """Goes on beside Blender, as a `GraphRender` does. Nothing of it remains after `close`."""

    def __init__(self) -> None:
        self.stopped = False  # set from any thread: it ends soon
        self.entry = _NothingWaits()
        self.problem: Problem | None = None
        self.report: dict[str, object] = {}
        self._process: BlenderProcess | None = None

    @abstractmethod
    def _begin(self) -> BlenderProcess | None:
        """A process that has its request; None where nothing is left to do. Raises BadInput and
        OSError."""

    @abstractmethod
    def _said(self, error: Exception) -> Problem:
        """What went wrong, as a problem."""

    def start(self, *, waits: bool, note: Callable[[str], None] | None = None) -> None:
        """waits: returns at the end; `note` is told how far it is."""
        try:
            self._process = self._begin()
            if self._process is not None:
                self._process.start()
        except (BadInput, OSError) as error:
            self._fail(error)
        said = ""
        while waits and self.is_running():
            if note is not None and (text := self.text()) != said:
                said = text
                note(said)
            time.sleep(_POLL)

    def is_running(self) -> bool:
        """Whether the other process is at work; ends it where nobody wants it any more."""
        if self._process is None:
            return False
        if self.stopped:
            self._process.close()
        return self._process.progress().running

    def text(self) -> str:
        """How far it is."""
        return self._process.progress().text if self._process is not None else ""

    def close(self) -> None:
        """Takes in the report of the other process, and removes it."""
        process, self._process = self._process, None
        if process is None:
            return
        try:
            if not (self.stopped or self.problem or process.progress().running):
                self.report = process.result()
        except (BadInput, Failed, OSError) as error:
            self._fail(error)
        finally:
            process.close()

    def _fail(self, error: Exception) -> None:
        self.problem = error.problems[0] if isinstance(error, BadInput) else self._said(error)
