# SPDX-License-Identifier: GPL-3.0-or-later
"""A measurement of time against error, as work for a thread: nothing of it needs Blender."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping
from pathlib import Path

from ...advice.information.job import Step
from ...advice.trade import report
from ...advice.trade.measure import Trade
from ...advice.trade.start import trade_of
from ...fit.request import RunRequest
from ...report.results import new_folder
from ...scene_read.geometry.bodies import judge_bodies
from ...scene_read.values import SceneValues


class Measuring:
    """Measures, and writes what was found into `folder`. `trade` is there once photos are read.

    trouble: why nothing could be written. remark: why there is no plot. Who cancels keeps what has
    been measured. `steps` raises BadInput and FitFailed.
    """

    def __init__(
        self,
        values: SceneValues,
        request: RunRequest,
        packed: Mapping[str, bytes],
        budget: float,
        parent: Path,
    ) -> None:
        """values: without a survey of bodies. parent: of the folder."""
        self.trade: Trade | None = None
        self.folder: Path | None = None
        self.trouble = self.remark = ""
        self._asked = values, request, packed, budget
        self._parent = parent
        self._stop = threading.Event()

    def steps(self) -> Iterator[Step]:
        """Many times a second, once the photos are read."""
        values, request, packed, budget = self._asked
        yield Step(0.0, "surveying bodies")
        values.bodies = judge_bodies(values)
        yield Step(0.0, "reading the photos")
        trade = trade_of(values, request, packed, budget)
        if self._stop.is_set():
            return
        self.trade = trade
        for step in trade.steps():
            yield Step(step.fraction, step.text)
            if self._stop.is_set():
                trade.cancel()
        yield Step(1.0, "writing the table")
        content = report.report(trade)
        try:
            self.folder = new_folder(self._parent, "-trade")
            report.write(content, self.folder)
        except OSError as error:
            cure = "choose another folder"
            self.trouble = f"Cannot write to '{self._parent}': {error}; {cure}"
        self.remark = report.why_no_plot(content)

    def cancel(self) -> None:
        """From any thread: `steps` ends soon."""
        self._stop.set()
        if self.trade is not None:
            self.trade.cancel()
