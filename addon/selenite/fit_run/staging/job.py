# SPDX-License-Identifier: GPL-3.0-or-later
"""A fit in stages: one native fit after another, behind the interface of a single one."""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...problems import BadInput, Problem
from ..diagnosis import still_falling
from ..job import FitJob, Progress, SavedState
from ..plan import FitPlan
from . import plan as stage_plan
from .history import joined
from .plan import Point, Stage

#: What a stage may stop because of for the next one to start.
_ENDED_WELL = ("all iterations done", "converged", "loss below tolerance")


def make_job(
    plan: FitPlan, before: Sequence[dict[str, Any]] = (), state: SavedState | None = None
) -> FitJob | StagedJob:
    """The job that a plan asks for; before and state: see StagedJob. Raises BadInput."""
    if not plan.stages:
        return FitJob(plan, state=state)
    if not before:
        return StagedJob(plan, before, state)
    try:
        job = StagedJob(plan, before, state)
        job.so_far()  # joins their histories, as the end of the run will
    except (ValueError, LookupError, TypeError, AttributeError, OverflowError) as error:
        cause = f"its results so far do not belong to its stages ({error!r})"
        cure = "delete its state.json: the run then begins anew"
        raise BadInput(Problem("Run", cause, cure)) from error
    return job


class Ended:
    """In place of a job: a stage whose result is known."""

    def __init__(self, plan: FitPlan, result: dict[str, Any]) -> None:
        self.plan = plan
        self._result = result

    def start(self) -> None:
        """There is nothing to do."""

    cancel = join = request_state = start

    def take_state(self) -> None:
        """There is none."""

    def progress(self) -> Progress:
        """At the end."""
        values = {
            name: [float(x) for x in np.ravel(value)]
            for name, value in self._result["values_best"].items()
        }
        done, seconds = self._result["iterations"], self._result["seconds"]
        reason = self._result["stopped_because"]
        return Progress(False, done, done, math.nan, seconds, 0.0, reason, values)

    def preview(self, _index: int) -> None:
        """No picture is rendered."""

    def field(self, name: str) -> np.ndarray | None:
        """Of the known result."""
        found: np.ndarray | None = self._result["fields_last"].get(name)
        return found

    def notes(self) -> tuple[str, ...]:
        """Nothing is diagnosed again."""
        return ()

    def so_far(self) -> dict[str, Any]:
        """The known result."""
        return self._result

    result = so_far


class StagedJob:
    """As FitJob: start, progress, preview, cancel, join, result. Each stage starts at the best
    values of the one before; what is not in a stage keeps its value.

    No thread is added: whoever polls or joins starts the next stage.
    """

    def __init__(
        self,
        plan: FitPlan,
        before: Sequence[dict[str, Any]] = (),
        state: SavedState | None = None,
    ) -> None:
        """Validates every stage natively and starts nothing. Raises BadInput.

        before: results of the first stages, which are not run again. When all have one, `start`
        runs nothing and the job is at its end. state: of the stage after those.
        """
        self.plan = plan
        self._point = Point(
            {item.name: item.start for item in plan.unknowns},
            {field.name: field.values for field in plan.fields},
        )
        for stage in plan.stages[1:]:
            FitJob(plan_of(plan, stage, self._point))
        self._ended: list[dict[str, Any]] = []
        self._next_stage = threading.Lock()  # `parts` belong together, in whatever thread
        self._cancelled = False
        for result, stage in zip(before, plan.stages[1:], strict=False):
            self._ended.append(dict(result))
            self._point = after(plan, stage, self._point, result)
        stage = plan.stages[len(self._ended)]
        own = plan_of(plan, stage, self._point)
        self._job: FitJob | Ended
        if len(before) == len(plan.stages):
            self._job = Ended(own, dict(before[-1]))
        else:
            self._job = FitJob(
                own, from_start=not self._ended, to_end=not self._stages_left(), state=state
            )

    def start(self) -> None:
        """Returns at once."""
        self._job.start()

    def progress(self) -> Progress:
        """Cheap; starts the next stage when one has ended. Raises FitFailed."""
        state = self._job.progress()
        while self._go_on(state.stopped_because):
            state = self._job.progress()
        index = len(self._ended)
        last = not self._stages_left() or self._cancelled
        done = sum(item["iterations"] for item in self._ended)
        seconds = sum(item["seconds"] for item in self._ended)
        values = {name: list(value) for name, value in self._point.values.items()}
        stage = self.plan.stages[index].request
        return replace(
            state,
            iteration=done + state.iteration,
            iterations=done + sum(item.settings.iterations for item in self.plan.stages[index:]),
            seconds=seconds + state.seconds,
            seconds_left=0.0 if last and not state.running else self._seconds_left(state),
            values=values | state.values,
            stage=f"{index + 1} of {len(self.plan.stages)}: {stage.name}",
            stage_index=index,
        )

    def preview(self, index: int) -> np.ndarray | None:
        """Newest picture of a photo, (h, w, 3), at the height of the stage."""
        return self._job.preview(index)

    def cancel(self) -> None:
        """Asks the thread to stop; no further stage starts."""
        self._cancelled = True
        self._job.cancel()

    def join(self) -> None:
        """Runs all stages to their end."""
        self._job.join()
        while self._go_on(self._job.progress().stopped_because):
            self._job.join()

    def request_state(self) -> None:
        """Asks for the whole state of the stage that runs."""
        self._job.request_state()

    def take_state(self) -> bytes | None:
        """The state that was asked for, of the stage that runs now."""
        return self._job.take_state()

    def field(self, name: str) -> np.ndarray | None:
        """The newest values of a field of the stage that runs, see FitJob."""
        return self._job.field(name)

    def parts(self) -> list[dict[str, Any]]:
        """The native results so far of every stage that has begun; from any thread."""
        with self._next_stage:
            ended, job = list(self._ended), self._job
        return [*ended, job.so_far()]

    def history(self) -> dict[str, Any]:
        """Of all stages that have begun."""
        found: dict[str, Any] = self.so_far()["history"]
        return found

    def so_far(self) -> dict[str, Any]:
        """As `result`, at any time."""
        result = joined(self.plan, self.parts(), self._point)
        if self._cancelled and self._stages_left() and result["stopped_because"] in _ENDED_WELL:
            result["stopped_because"] = "cancelled"  # between two stages
        return result

    def result(self) -> dict[str, Any]:
        """After the end: as the native result, the best of the newest stage and what the stages
        before it found; the key `stages` describes each. Raises FitFailed."""
        self.progress()
        found = self.so_far()
        return found | {"notes": (*self._job.notes(), *still_falling(found))}

    def _go_on(self, stopped_because: str) -> bool:
        """Starts the next stage; False when there is none or the run was stopped."""
        if not self._stages_left() or self._cancelled or stopped_because not in _ENDED_WELL:
            return False
        result = self._job.result()
        ended = [*self._ended, result]
        stage = self.plan.stages[len(ended)]
        self._point = after(self.plan, stage, self._point, result)
        own = plan_of(self.plan, stage, self._point)
        job = FitJob(own, from_start=False, to_end=len(ended) + 1 == len(self.plan.stages))
        with self._next_stage:
            self._ended, self._job = ended, job
        job.start()
        return True

    def _stages_left(self) -> int:
        return len(self.plan.stages) - len(self._ended) - 1

    def _seconds_left(self, state: Progress) -> float:
        """Of this stage as measured; of later ones by their paths. NaN while unknown."""
        index = len(self._ended)
        stages = self.plan.stages
        if math.isnan(state.seconds_left) or not state.iteration:
            return math.nan
        pace = state.seconds / state.iteration / _paths(stages[index])
        rest = sum(stage.settings.iterations * _paths(stage) for stage in stages[index + 1 :])
        return state.seconds_left + pace * rest


def plan_of(plan: FitPlan, stage: Stage, point: Point) -> FitPlan:
    """The plan of one stage that starts at `point`."""
    names = stage.request.parameters
    scene = stage.scene.with_values(
        stage_plan.constants(point.values, plan.unknowns, list(stage.fields))
    )
    for field in stage.fields:
        scene = field.placed(scene, point.fields[field.name])
    return replace(
        plan,
        request=replace(plan.request, settings=stage.settings, stages=()),
        scene=scene,
        captures=stage.captures,
        unknowns=[
            replace(item, start=point.values[item.name])
            for item in plan.unknowns
            if item.name in names
        ],
        fields=[field for field in plan.fields if field.name in names],
        stages=(),
    )


def after(plan: FitPlan, stage: Stage, point: Point, result: Mapping[str, Any]) -> Point:
    """Where `stage` starts: at the best values of the stage before it. A field that comes into the
    scene with it is filled with the colour that was fitted."""
    values = point.values | {
        name: tuple(map(float, np.ravel(value))) for name, value in result["values_best"].items()
    }
    fields = point.fields | dict(result["fields_best"])
    before = plan.stages[: plan.stages.index(stage)]
    fitted = {name for item in before for name in item.request.parameters}
    waiting = [field for field in plan.fields if field.name not in fitted]
    fields |= stage_plan.at_colours(values, plan.unknowns, waiting)
    return Point(values, fields)


def _paths(stage: Stage) -> int:
    """Paths of an iteration, the measure of its cost."""
    pixels = sum(item.reference.shape[0] * item.reference.shape[1] for item in stage.captures)
    return pixels * stage.settings.spp
