# SPDX-License-Identifier: GPL-3.0-or-later
"""What stays of a run after its end."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ...fit.plan import FitPlan
from ...report.finished_fit import FinishedFit
from ...scene_read.values import Owner


@dataclass
class Outcome:
    """What a run that was kept has left, for this session. folder: of the result, once written."""

    plan: FitPlan
    result: FinishedFit
    scene_name: str
    owners: dict[str, Owner]
    folder: Path | None = None
