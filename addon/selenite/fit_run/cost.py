# SPDX-License-Identifier: GPL-3.0-or-later
"""How long a fit will take on this machine: one short fit, scaled by the paths of another."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from .captures import Capture
from .job import FitJob
from .plan import FitPlan
from .settings import FitSettings

#: Height at which a fit is timed, its iterations, and seconds that are enough to believe.
_TIMED_HEIGHT, _TIMED_ITERATIONS, _LONG_ENOUGH = 64, 2, 0.5
#: A path with derivatives costs about so many without; manual page "fitting".
_DERIVATIVES, _FIELD_DERIVATIVES = 1.3, 2.2
# Of the native fit's settings: a validation every so many iterations, of so many samples.
_VALIDATION_EVERY, _VALIDATION_TIMES, _VALIDATION_LEAST = 5, 4, 16


def pixels_at(captures: Sequence[Capture], height: int) -> int:
    """Pixels of all captures when they are compared at `height`, never above their photo's."""
    total = 0
    for item in captures:
        columns, rows = item.photo_size
        used = min(height, rows)
        total += used * max(1, round(used * columns / rows))
    return total


def paths(settings: FitSettings, captures: Sequence[Capture], *, fields: bool = False) -> float:
    """Paths of a whole fit, in paths without derivatives; captures of any height."""
    step = settings.spp * (_FIELD_DERIVATIVES if fields else _DERIVATIVES)
    validations = -(-settings.iterations // _VALIDATION_EVERY) + 1
    validation = max(_VALIDATION_LEAST, _VALIDATION_TIMES * settings.spp)
    per_pixel = settings.iterations * step + validations * validation
    return pixels_at(captures, settings.height) * per_pixel


def seconds_per_path(plan_of: Callable[[FitSettings], FitPlan], settings: FitSettings) -> float:
    """Seconds (by the clock) of a short fit over its paths. Waits for it.

    Where small pictures are done in no time, whole ones are timed: a small fit is mostly overhead.
    plan_of: the plan with given settings. Raises BadInput and FitFailed as FitJob does.
    """
    height = min(settings.height, _TIMED_HEIGHT)
    found = _timed(plan_of(_short(settings, height)))
    if found[0] < _LONG_ENOUGH and height < settings.height:
        found = _timed(plan_of(_short(settings, settings.height)))
    return found[0] / found[1]


def _short(settings: FitSettings, height: int) -> FitSettings:
    return replace(settings, height=height, iterations=_TIMED_ITERATIONS, tolerance=0.0)


def _timed(plan: FitPlan) -> tuple[float, float]:
    """(seconds, paths)"""
    job = FitJob(replace(plan, stages=()))
    job.start()
    job.join()
    seconds: float = job.result()["seconds"]
    return seconds, paths(plan.request.settings, plan.captures, fields=bool(plan.fields))


def expected(plan: FitPlan, settings: FitSettings, per_path: float) -> float:
    """Seconds of a fit of the plan's unknowns and captures with other settings."""
    return per_path * paths(settings, plan.captures, fields=bool(plan.fields))
