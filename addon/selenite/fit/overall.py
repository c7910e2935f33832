# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a whole run has come: one share over all stages and phases, which never falls."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from ..messages import joined, message
from ..problems import BadInput
from .cost import phase_paths
from .job import DESCENT, MULTI_START
from .plan import FitPlan
from .settings import FitSettings
from .staging.shape_apart import is_shape

if TYPE_CHECKING:
    from .._core import Progress

#: In the order of a fit. The last four may repeat, then the share waits.
PHASES = (MULTI_START, DESCENT, "refinement", "comparison", "roughness-profile", "parts")
#: What is shown in place of a refinement where the steps before it have converged.
GOOD_ENOUGH = "good-enough"
#: What follows the native fit: looking for wrong lights, filling texels that no photo sees.
FINISHING = "finishing"
_FINISHING_SHARE = 0.02
#: What the native module and this one call a phase -> what a user sees.
_PHASES = {
    "starting": message("phase.starting", "starting"),
    "multi-start": message("phase.multi-start", "multi-start"),
    "descent": message("phase.descent", "descent"),
    "refinement": message("phase.refinement", "refinement"),
    GOOD_ENOUGH: message("phase.good-enough", "good enough, refining"),
    "comparison": message("phase.comparison", "comparison"),
    "parts": message("phase.parts", "parts"),
    "roughness-profile": message("phase.roughness-profile", "roughness profile"),
    FINISHING: message("phase.finishing", "finishing"),
}
#: Iterations after which most fits that are refined have converged, as the native schedule counts.
_CONVERGED_AFTER = 15
#: Of a phase whose length is a guess: where its share begins to wait for the end.
_SURE = 0.8
#: Seconds, and share of the run, before the time left is worth a sentence.
_FIRST_SECONDS, _FIRST_SHARE = 2.0, 0.02
_SMOOTH = 0.2  # of a new estimate of the time left


@dataclass(frozen=True)
class Shown:
    """fraction: of the whole run, 0 to 1. left: seconds, None while unknown."""

    fraction: float = 0.0
    left: float | None = None
    phase: str = "starting"

    @property
    def text(self) -> str:
        """ "43 %, refinement, 12 min left"; without a part that is not known."""
        parts = [
            f"{100 * self.fraction:.0f} %",
            _PHASES.get(self.phase, self.phase),
            time_text(self.left),
        ]
        return joined(", ", (part for part in parts if part))


class Overall:
    """Fed with the Progress of a FitJob."""

    def __init__(self, plan: FitPlan) -> None:
        self._weights = _weights(plan)
        self._descents = _descents(plan, self._weights)
        self._fraction = 0.0
        self._left: float | None = None
        self._seconds = 0.0  # of the newest progress

    def update(self, progress: Progress) -> Shown:
        """The newest state. A phase that ends early moves the share on, never back."""
        before = sum(sum(stage.values()) for stage in self._weights[: progress.stage])
        stage = self._weights[min(progress.stage, len(self._weights) - 1)]
        place = PHASES.index(progress.phase) if progress.phase in PHASES else 0
        before += sum(stage[name] for name in PHASES[:place])
        here = before + stage[PHASES[place]] * self._of_phase(progress)
        total = sum(sum(each.values()) for each in self._weights)
        share = (1 - _FINISHING_SHARE) * min(here / total, 1.0)
        if math.isfinite(share):
            self._fraction = max(self._fraction, share)
        self._keep_time(progress.seconds)
        is_last = progress.stage >= len(self._weights) - 1
        is_good = is_last and 0 < progress.iteration < progress.iterations
        phase = GOOD_ENOUGH if is_good and progress.phase == "refinement" else progress.phase
        return Shown(self._fraction, self._left, phase)

    def finishing(self, share: float) -> Shown:
        """After the native fit. share: of that last part, 0 to 1."""
        inside = 1 - _FINISHING_SHARE * (1 - min(max(share, 0.0), 1.0))
        self._fraction = max(self._fraction, inside)
        return Shown(self._fraction, None, FINISHING)

    def _of_phase(self, progress: Progress) -> float:
        """Share of the present phase."""
        if progress.phase != DESCENT:
            return min(max(progress.phase_fraction, 0.0), 1.0)
        expected = self._descents[min(progress.stage, len(self._descents) - 1)]
        done = progress.own_iteration / max(expected[0], 1)
        if expected[1] or done <= _SURE:
            return min(done, 1.0)
        # How many iterations it takes is a guess: the share comes ever closer to the end.
        rest = 1 - _SURE
        return _SURE + rest * (1 - math.exp(-(done - _SURE) / rest))

    def _keep_time(self, seconds: float) -> None:
        passed, self._seconds = max(seconds - self._seconds, 0.0), seconds
        if seconds < _FIRST_SECONDS or self._fraction < _FIRST_SHARE:
            return
        new = seconds * (1 - self._fraction) / self._fraction
        old = self._left
        expected = new if old is None else max(old - passed, 0.0)
        self._left = (1 - _SMOOTH) * expected + _SMOOTH * new


def time_text(seconds: float | None) -> str:
    """ "12 min left", "1 h 5 min left"; "" where nothing is known."""
    if seconds is None or not math.isfinite(seconds):
        return ""
    if seconds < 60:
        return message("overall.less-than-min-left", "less than 1 min left")
    minutes = math.ceil(seconds / 60)
    if minutes < 60:
        return message("overall.min-left", "{minutes} min left", minutes=minutes)
    return message(
        "overall.h-min-left",
        "{hours} h {minutes} min left",
        hours=minutes // 60,
        minutes=minutes % 60,
    )


def _weights(plan: FitPlan) -> list[dict[str, float]]:
    """Stage by stage, the paths of each phase."""
    found = []
    for part, settings, native in _parts(plan):
        try:
            paths = phase_paths(settings, part, native)
        except BadInput:  # the job itself says what is wrong
            paths = {}
        weights = {name: paths.get(name, 0.0) for name in PHASES}
        if not sum(weights.values()) > 0:
            weights[DESCENT] = 1.0
        found.append(weights)
    return found


def _descents(plan: FitPlan, weights: Sequence[dict[str, float]]) -> list[tuple[int, bool]]:
    """Stage by stage: iterations that are expected, and whether that number is sure."""
    found = []
    for (_, settings, _), stage in zip(_parts(plan), weights, strict=True):
        refined = stage["refinement"] > 0
        expected = min(settings.iterations, _CONVERGED_AFTER) if refined else settings.iterations
        found.append((expected, expected == settings.iterations))
    return found


def _parts(plan: FitPlan) -> list[tuple[FitPlan, FitSettings, dict[str, str]]]:
    """(plan, settings, native settings of its own) of each stage; of the fit where it has none."""
    if not plan.stages:
        return [(plan, plan.request.settings, {})]
    found = []
    for index, stage in enumerate(plan.stages):
        names = stage.request.parameters
        part = replace(
            plan,
            scene=stage.scene,
            captures=stage.captures,
            unknowns=[item for item in plan.unknowns if item.name in names],
            fields=[item for item in plan.fields if item.name in names],
            stages=(),
        )
        before = [name for item in plan.stages[:index] for name in item.request.parameters]
        native = {} if all(is_shape(name) for name in before) else {"search": "off"}
        if index < len(plan.stages) - 1:
            native["refinement"] = "off"
        found.append((part, stage.settings, native))
    return found
