# SPDX-License-Identifier: GPL-3.0-or-later
"""The running fit. Kept in Python, not in the .blend, and without pointers into it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from .. import native
from ..fit_run.job import FitJob, Progress
from ..fit_run.plan import FitPlan
from ..scene_read.values import Owner


@dataclass
class Run:
    """At most one fit at a time. `result` stays after its end, for the result folder."""

    job: FitJob | None = None
    scene_name: str = ""
    owners: dict[str, Owner] = field(default_factory=dict)
    progress: Progress | None = None
    keep: bool = True
    plan: FitPlan | None = None
    result: dict[str, Any] | None = None
    message: str = ""

    def start(self, job: FitJob, scene_name: str, owners: dict[str, Owner]) -> None:
        """Starts the native thread."""
        self.job, self.scene_name, self.owners = job, scene_name, owners
        self.progress, self.keep, self.message = None, True, ""
        self.plan, self.result = job.plan, None
        job.start()

    def ask_to_stop(self, *, keep: bool) -> None:
        """Returns at once; the modal operator sees the end at its next tick."""
        self.keep = keep
        if self.job is not None:
            self.job.cancel()

    def stop(self, *, keep: bool) -> None:
        """Waits for the thread and forgets the job."""
        self.ask_to_stop(keep=keep)
        if self.job is not None:
            self.job.join()
        self.job = None


RUN = Run()


@lru_cache(maxsize=1)
def why_native_is_missing() -> str:
    """Empty if the native modules load. Asked once: a running Blender cannot replace them."""
    return native.why_unavailable()
