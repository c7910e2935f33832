# SPDX-License-Identifier: GPL-3.0-or-later
"""How long a fit will take on this machine: one short fit, scaled by the paths of another."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from .. import native
from ..capture.prepared import Capture
from ..problems import refused
from .job import FitJob
from .plan import FitPlan
from .settings import FitSettings

#: Height at which a fit is timed, its iterations, and seconds that are enough to believe.
_TIMED_HEIGHT, _TIMED_ITERATIONS, _LONG_ENOUGH = 64, 2, 0.5
#: What a path costs that carries derivatives of scalars, or of every value of a field, in paths
#: without; docs/measurements/race.md. Of a shape two pictures, with the edges' paths.
_PATH = {"none": 1.0, "scalars": 1.3, "fields": 2.2, "shape": 6.0}


def sizes_at(captures: Sequence[Capture], height: int) -> list[tuple[str, str, int, int]]:
    """(id, camera, width, height) of all captures when they are compared at `height`, never above
    that of their photo."""
    sizes = []
    for item in captures:
        columns, rows = item.photo_size
        used = min(height, rows)
        sizes.append((item.id, item.camera, max(1, round(used * columns / rows)), used))
    return sizes


def pixels_at(captures: Sequence[Capture], height: int) -> int:
    """Pixels of all captures when they are compared at `height`."""
    return sum(width * rows for *_, width, rows in sizes_at(captures, height))


def too_many(plan: FitPlan) -> str:
    """Why a fit's report can't tell what the photos know of the unknowns; "" if it can."""
    if plan.fields:
        return "a grid or image has too many values to say what the photos know of them"
    count, few = sum(item.parameter.width for item in plan.unknowns), native.core().few_unknowns
    if count > few:
        return f"{count} numbers are unknown, a fit refines up to {few}"
    return ""


def paths(settings: FitSettings, plan: FitPlan) -> float:
    """Paths of a whole fit of the plan's unknowns and captures, in paths without derivatives; the
    settings are those of the fit, not the plan's. Raises BadInput as FitJob."""
    return sum(phase_paths(settings, plan).values())


def phase_paths(
    settings: FitSettings, plan: FitPlan, own: Mapping[str, str] | None = None
) -> dict[str, float]:
    """As `paths`, by the name of each phase that the fit is expected to have. own: native settings
    in place of those of `settings`."""
    found: dict[str, float] = {}
    for part in _apart(plan):
        with refused("Fit", "change the settings or the bounds"):
            planned = native.core().schedule(
                part.scene,
                sizes_at(part.captures, settings.height),
                [
                    *(item.native() for item in part.unknowns),
                    *(item.native() for item in part.fields),
                ],
                settings.native() | dict(own or {}),
            )
        for row in planned:
            cost = row["pixels"] * row["spp"] * row["renders"] * _PATH[row["derivatives"]]
            found[row["phase"]] = found.get(row["phase"], 0.0) + cost
    return found


def _apart(plan: FitPlan) -> list[FitPlan]:
    """The plan of each shape, and of the rest: vertices move alone."""
    parts = [
        replace(plan, unknowns=[], fields=[item], stages=())
        for item in plan.fields
        if item.kind.is_shape
    ]
    rest = [item for item in plan.fields if not item.kind.is_shape]
    if plan.unknowns or rest or not parts:
        parts.append(replace(plan, fields=rest, stages=()))
    return parts


def seconds_per_path(
    plan_of: Callable[[FitSettings], FitPlan],
    settings: FitSettings,
    begun: Callable[[FitJob], None] = lambda _job: None,
) -> float:
    """Seconds (by the clock) of a short fit over its paths. Waits for it.

    Where small pictures are done in no time, whole ones are timed: a small fit is mostly overhead.
    plan_of: the plan with given settings. begun: gets each job, so that it can be cancelled.
    Raises BadInput and FitFailed as FitJob does.
    """
    height = min(settings.height, _TIMED_HEIGHT)
    found = _timed(plan_of(_short(settings, height)), begun)
    if found[0] < _LONG_ENOUGH and height < settings.height:
        found = _timed(plan_of(_short(settings, settings.height)), begun)
    return found[0] / found[1]


def _short(settings: FitSettings, height: int) -> FitSettings:
    return replace(
        settings, height=height, iterations=_TIMED_ITERATIONS, tolerance=0.0, search="off"
    )


def _timed(plan: FitPlan, begun: Callable[[FitJob], None]) -> tuple[float, float]:
    """(seconds, paths)"""
    timed = _apart(plan)[-1]
    job = FitJob(timed)
    job.start()
    begun(job)
    job.join()
    return job.result().seconds, paths(plan.request.settings, timed)


def expected(plan: FitPlan, settings: FitSettings, per_path: float) -> float:
    """Seconds of a fit of the plan's unknowns and captures with other settings."""
    return per_path * paths(settings, plan)
