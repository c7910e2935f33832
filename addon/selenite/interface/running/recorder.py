# SPDX-License-Identifier: GPL-3.0-or-later
"""A run is kept on disk by a thread: who polls a fit must not wait for a disk."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

from ...advice.information.job import Step
from ...fit.checkpoint import Recorder
from ...fit.inputs import Inputs
from ...fit.job import FitJob
from ...fit.request import RunRequest


class BackgroundRecorder:
    """As Recorder; what it writes is written in a thread."""

    def __init__(self, folder: Path, request: RunRequest, inputs: Inputs) -> None:
        """Makes the folder if there is none."""
        self._recorder = Recorder(folder, request, inputs)
        self._said = self._recorder.trouble
        self._thread: threading.Thread | None = None

    @property
    def folder(self) -> Path:
        """Where the run is kept."""
        return self._recorder.folder

    @property
    def trouble(self) -> str:
        """Why the newest state is not on disk, "" if it is."""
        return self._recorder.trouble

    def update(self, job: FitJob) -> str:
        """Begins to write, if that is due. Returns why the last time failed, "" where it did not or
        where that was returned already."""
        if self.is_writing:
            return ""
        before, self._said = self._said, self.trouble
        if self._recorder.is_due:
            self._thread = threading.Thread(target=self._recorder.update, args=(job,), daemon=True)
            self._thread.start()
        return self._said if self._said != before else ""

    @property
    def is_writing(self) -> bool:
        """Whether a state is on its way to the disk."""
        return self._thread is not None and self._thread.is_alive()

    @property
    def notes(self) -> tuple[str, ...]:
        """What went wrong so far."""
        return self._recorder.notes()

    def wait(self) -> None:
        """Until what is being written is on disk."""
        if self._thread is not None:
            self._thread.join()

    def close(self) -> tuple[str, ...]:
        """The run has ended in this session: nothing is left to resume. Waits. Returns what went
        wrong with the record."""
        self.wait()
        left = self._recorder.finished()
        return (*self.notes, *((left,) if left else ()))


class Closing:
    """Closes the record of a run that is not wanted, as work for a thread."""

    def __init__(self, recorder: BackgroundRecorder) -> None:
        self._recorder = recorder

    def steps(self) -> Iterator[Step]:
        """One."""
        yield Step(0.0, "removing the record")
        self._recorder.close()

    def cancel(self) -> None:
        """It goes on to its end."""
