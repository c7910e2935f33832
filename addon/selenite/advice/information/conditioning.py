# SPDX-License-Identifier: GPL-3.0-or-later
"""Stages by conditioning: first what the photos determine, then everything."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...fit import cost
from ...fit.job import MULTI_START, FitJob, fitted_values, scene_at
from ...fit.plan import FitPlan
from ...fit.request import RunRequest
from ...fit.staging.request import StageRequest, first_then_all
from ...fit.unknowns import Unknown, labels
from . import fisher
from .job import Step
from .photo_information import PhotoInformation

#: Where it is computed what the photos determine.
AT_START, AT_SEARCHED = "at the start", "at the values that multi-start found"
#: Multi-start ends with the first step: a stage for its sake needs no other.
_SEARCH_ITERATIONS = 1
_POLL = 0.05  # seconds


class StageChoice:
    """Driven from outside: `for step in choice.steps(): ...`; then `plan`, whose request has the
    stages and, as `staging`, the sentence that says why.

    Where a fit of everything would begin with multi-start, so does the choice, with the same seed:
    at a start far away the photos may determine another set of parameters. The stages then begin
    with multi-start too, so that the run finds the same values.
    """

    def __init__(self, plan: FitPlan, plan_of: Callable[[RunRequest], FitPlan]) -> None:
        """plan: without stages, at its start. plan_of: the plan of another request. Raises BadInput
        as FitJob."""
        self.plan = plan
        self._plan_of = plan_of
        self._why_not = cost.too_many(plan)
        self._search = None if self._why_not else _search(plan)
        self._photos: PhotoInformation | None = None
        self._cancelled = False

    def cancel(self) -> None:
        """From any thread: `steps` ends within a tile."""
        self._cancelled = True
        if self._search is not None:
            self._search.cancel()
        if self._photos is not None:
            self._photos.cancel()

    def steps(self) -> Iterator[Step]:
        """Raises BadInput for derivatives that are not finite, FitFailed, and the native
        Cancelled."""
        request = self.plan.request
        late: list[Unknown] = []
        why = self._why_not
        if not why:
            seen, begin = self.plan, 0.0
            if self._search is not None:
                begin = 0.5
                for step in _driven(self._search):
                    yield Step(begin * step.fraction, step.text)
                seen = _at_result(self.plan, self._search)
            self._photos = PhotoInformation(seen, seen.scene)
            if self._cancelled:  # while there was nothing to cancel
                self._photos.cancel()
            for step in self._photos.at_photos():
                yield Step(begin + (1 - begin) * step.fraction, step.text)
            photos = [one.precision() for one in self._photos.informations(request.settings)]
            where = AT_START if self._search is None else AT_SEARCHED
            indices, why = deferred(photos, self._photos.ranges, self._photos.groups, where)
            late = [self.plan.unknowns[index] for index in indices]
        if not late:
            self.plan = replace(self.plan, request=replace(request, staging=f"All at once: {why}"))
            return
        names = [item.name for item in self.plan.unknowns]
        words = labels(self.plan.unknowns)
        names_of_late = ", ".join(words[item.name] for item in late)
        first = [name for name in names if name not in {item.name for item in late}]
        stages = first_then_all(
            f"without {names_of_late}", first, names, request.settings.iterations
        )
        if self._search is not None:
            stages = (StageRequest("search", tuple(names), _SEARCH_ITERATIONS), *stages)
        staging = f"{names_of_late} last: {why}"
        self.plan = self._plan_of(replace(request, stages=stages, staging=staging))
        yield Step(1.0, "")


def _search(plan: FitPlan) -> FitJob | None:
    """The fit of everything that the stage "search" will be; None where it has no multi-start."""
    settings = replace(plan.request.settings, iterations=_SEARCH_ITERATIONS)
    job = FitJob(replace(plan, request=replace(plan.request, settings=settings)), refined=False)
    return job if job.progress().phase == MULTI_START else None


def _driven(job: FitJob) -> Iterator[Step]:
    """Runs the job to its end; its thread ends too where nobody asks for the next step."""
    job.start()
    try:
        while (state := job.progress()).running:
            searching = state.phase == MULTI_START
            yield Step(state.fraction if searching else 1.0, MULTI_START)
            time.sleep(_POLL)
    finally:
        job.cancel()
        job.join()


def _at_result(plan: FitPlan, job: FitJob) -> FitPlan:
    """The plan with the best values of a fit as its start."""
    result = job.result()
    values = fitted_values(plan, result)
    unknowns = [
        replace(item, start=values[item.owner, item.parameter.name]) for item in plan.unknowns
    ]
    return replace(plan, scene=scene_at(plan, result), unknowns=unknowns)


def deferred(
    photos: Sequence[np.ndarray],
    ranges: np.ndarray,
    groups: Sequence[Sequence[int]],
    where: str = AT_START,
) -> tuple[list[int], str]:
    """Which parameters wait for the last stage, and why; none: all at once.

    photos: `FisherInformation.precision` of each, (n, n). groups: components of each parameter. A
    parameter is determined where all its components are. where: for the sentence.
    """
    everything = [k for group in groups for k in group]
    count = len(groups)

    def errors(free: Sequence[int]) -> dict[int, float]:
        """Standard error of each component of `free`, all but these being known."""
        found = fisher.errors(photos, ranges, free)
        return dict(zip(free, found, strict=True))

    def known(index: int, found: dict[int, float]) -> bool:
        group = list(groups[index])
        sizes = np.array([found[k] for k in group])
        return bool(fisher.determined(sizes, ranges[group]).all())

    together = errors(everything)
    left = [index for index in range(count) if known(index, together)]
    if len(left) == count:
        return [], f"the photos determine every parameter {where}"
    if left:
        waiting = [index for index in range(count) if index not in left]
        return waiting, f"not determined by the photos {where}"
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
        cause = "the photos determine no parameter, not even with the others known"
        return [], f"{where} {cause}"
    waiting = [index for index in range(count) if index not in left]
    cause = "the photos do not separate all parameters"
    return waiting, f"{where} {cause}, and this one suffers most from it"
