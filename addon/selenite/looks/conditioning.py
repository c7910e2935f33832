# SPDX-License-Identifier: GPL-3.0-or-later
"""Stages by conditioning: first what the photos determine at the start, then everything."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..fit_run import cost
from ..fit_run.plan import FitPlan
from ..fit_run.request import RunRequest
from ..fit_run.staging.request import first_then_all
from ..fit_run.unknowns import Unknown, labels
from . import information
from .job import Step
from .photos import Looks


class StageChoice:
    """Driven from outside: `for step in choice.steps(): ...`; then `plan`, whose request has the
    stages and, as `staging`, the sentence that says why."""

    def __init__(self, plan: FitPlan, plan_of: Callable[[RunRequest], FitPlan]) -> None:
        """plan: without stages, at its start. plan_of: the plan of another request."""
        self.plan = plan
        self._plan_of = plan_of
        self._why_not = _why_not(plan)
        self._looks = None if self._why_not else Looks(plan, plan.scene)

    def cancel(self) -> None:
        """From any thread: `steps` ends within a tile."""
        if self._looks is not None:
            self._looks.cancel()

    def steps(self) -> Iterator[Step]:
        """Raises BadInput for derivatives that are not finite, and the native Cancelled."""
        request = self.plan.request
        held: list[Unknown] = []
        why = self._why_not
        if self._looks is not None:
            yield from self._looks.at_photos()
            photos = [
                information.precision(one) for one in self._looks.informations(request.settings)
            ]
            waiting, why = held_back(photos, self._looks.ranges, self._looks.groups)
            held = [self.plan.unknowns[index] for index in waiting]
        if not held:
            self.plan = replace(self.plan, request=replace(request, staging=f"All at once: {why}"))
            return
        names = [item.name for item in self.plan.unknowns]
        words = labels(self.plan.unknowns)
        late = ", ".join(words[item.name] for item in held)
        first = [name for name in names if name not in {item.name for item in held}]
        stages = first_then_all(f"without {late}", first, names, request.settings.iterations)
        staging = f"{late} last: {why}"
        self.plan = self._plan_of(replace(request, stages=stages, staging=staging))
        yield Step(1.0, "")


def held_back(
    photos: Sequence[np.ndarray], ranges: np.ndarray, groups: Sequence[Sequence[int]]
) -> tuple[list[int], str]:
    """Which parameters wait for the last stage, and why; none: all at once.

    photos: `information.precision` of each, (n, n). groups: components of each parameter. A
    parameter is determined where all its components are.
    """
    everything = [k for group in groups for k in group]
    count = len(groups)

    def errors(free: Sequence[int]) -> dict[int, float]:
        """Standard error of each component of `free`, all but these being known."""
        found = information.errors(photos, ranges, free)
        return dict(zip(free, found, strict=True))

    def known(index: int, found: dict[int, float]) -> bool:
        group = list(groups[index])
        sizes = np.array([found[k] for k in group])
        return bool(information.determined(sizes, ranges[group]).all())

    together = errors(everything)
    left = [index for index in range(count) if known(index, together)]
    if len(left) == count:
        return [], "the photos determine every parameter at the start"
    if left:
        waiting = [index for index in range(count) if index not in left]
        return waiting, "not determined by the photos at the start"
    alone = {k: error for group in groups for k, error in errors(group).items()}
    left = [index for index in range(count) if known(index, alone)]
    while left:
        free = [k for index in left for k in groups[index]]
        found = errors(free)
        if all(known(index, found) for index in left):
            break
        growth = {index: max(found[k] / alone[k] for k in groups[index]) for index in left}
        left.remove(max(left, key=growth.__getitem__))
    if len(left) in (0, count):
        return [], "at the start the photos determine no parameter, not even with the others known"
    waiting = [index for index in range(count) if index not in left]
    why = "the photos do not tell all parameters apart at the start, and this suffers most by it"
    return waiting, why


def _why_not(plan: FitPlan) -> str:
    """Why nothing is looked at; "" if it is."""
    if plan.fields:
        return "a grid has too many values to say what the photos know of them"
    count = sum(item.parameter.width for item in plan.unknowns)
    if count > cost.FEW:
        return f"{count} numbers are unknown, stages are chosen for up to {cost.FEW}"
    return ""
