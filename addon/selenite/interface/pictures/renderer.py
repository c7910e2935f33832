# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders of moments of a fit, off the main thread: the newest wish counts."""

from __future__ import annotations

from collections.abc import Iterator

from ... import native
from ...advice.information.job import BackgroundJob, Step
from ...report.pictures.moments import Moment, Moments


class RenderMoment:
    """Work for a BackgroundJob: one picture, which is in `moments` then."""

    def __init__(self, moments: Moments, moment: Moment) -> None:
        self.moments, self.moment = moments, moment
        self._progress = native.core().ProgressToken()

    def steps(self) -> Iterator[Step]:
        """A single one."""
        self.moments.render(self.moment, self._progress)
        yield Step(1.0, "")

    def cancel(self) -> None:
        """The render ends within a tile."""
        self._progress.cancel()


class Renderer:
    """At most one render at a time. `trouble`: why the last one failed, "" if it did not."""

    def __init__(self) -> None:
        self.trouble = ""
        self._job: BackgroundJob[RenderMoment] | None = None

    @property
    def busy(self) -> bool:
        """A render runs, or its end was not seen yet."""
        return self._job is not None

    def want(self, moments: Moments, moment: Moment) -> None:
        """Starts to render it, unless that is under way. Another render is cancelled first; this
        one starts when that has ended."""
        if self._job is None:
            self._job = BackgroundJob(RenderMoment(moments, moment))
            self._job.start()
        elif self._job.work.moment != moment or self._job.work.moments is not moments:
            self._job.cancel()

    def poll(self) -> bool:
        """Whether a render has ended since the last time."""
        if self._job is None or self._job.progress()[0]:
            return False
        job, self._job = self._job, None
        self.trouble = ""
        try:
            job.join()
        except (ValueError, RuntimeError, MemoryError) as error:
            self.trouble = str(error)
        return True

    def stop(self) -> None:
        """Waits for the end of what runs."""
        if self._job is not None:
            self._job.cancel()
            self._job.join()
            self._job = None
