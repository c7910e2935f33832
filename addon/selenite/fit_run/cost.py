# SPDX-License-Identifier: GPL-3.0-or-later
"""How long a fit will take on this machine: one short fit, scaled by the paths of another."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from .captures import Capture
from .job import FitJob
from .plan import FitPlan
from .settings import FitSettings
from .unknowns import Unknown

#: Height at which a fit is timed, its iterations, and seconds that are enough to believe.
_TIMED_HEIGHT, _TIMED_ITERATIONS, _LONG_ENOUGH = 64, 2, 0.5
#: Unknowns up to which a fit is verified, and steps by least squares unless told otherwise.
FEW = 12
#: A path with derivatives costs about so many without; docs/measurements/derivatives.md.
_DERIVATIVES, _FIELD_DERIVATIVES = 1.3, 2.2
# Of the native fit's settings: a validation every so many iterations, of so many samples.
_VALIDATION_EVERY, _VALIDATION_TIMES, _VALIDATION_LEAST = 5, 2, 16
# Of the search: side of its pictures, samples of a pixel without and with derivatives.
_SEARCH_SIDE, _SEARCH_LOOKS, _SEARCH_STEPS = 40, 850, 680
# Of the verification: least samples, the share of them that have derivatives, and its passes: with
# a sixteenth and a quarter of them before a whole one, which is mostly the last. Then, after a
# search, pictures of the answer and of up to three rivals with a sixteenth of them.
_VERIFICATION_LEAST, _VERIFICATION_SHARE, _VERIFICATION_PASSES = 64, 4, 1.4
_RIVAL_PICTURES, _RIVAL_SHARE = 4, 16
# Beside voxels, in units of the last pass's samples: those of all passes, those of them with both
# ends of each difference, and what the pixels in focus cost together, as if samples of all.
_BESIDE_SHARE, _BESIDE_PASSES, _BESIDE_DIFFERENCES, _BESIDE_FOCUS = 5, 1.75, 0.75, 1.5
# Of the steps: iterations that take a difference for each parameter that needs one, and how many
# share those of a round from then on.
_ALL_DIFFERENCES, _ROUND = 4, 3
# After a search beside images, before each turn of the scalars and after the last: sets of values
# that are compared, on average, where a roughness is unknown, and pictures by which each IOR is
# looked for.
_TRIALS, _IOR_PICTURES, _CYCLE = 1.5, 4, 10
# Of albedo grids: numbers up to which voxels are stepped together with the scalars.
_FEW_VOXELS = 3 * 12**3
#: Iterations after which the values of most fits that are verified have settled.
_SETTLED_AFTER = 15


def pixels_at(captures: Sequence[Capture], height: int) -> int:
    """Pixels of all captures when they are compared at `height`, never above their photo's."""
    total = 0
    for item in captures:
        columns, rows = item.photo_size
        used = min(height, rows)
        total += used * max(1, round(used * columns / rows))
    return total


def refinement_spp(settings: FitSettings) -> int:
    """Samples of a pixel in the last look at the answer of a fit."""
    return max(_VERIFICATION_LEAST, settings.iterations * settings.spp)


def too_many(plan: FitPlan) -> str:
    """Why a fit's report can't tell what the photos know of the unknowns; "" if it can."""
    if plan.fields:
        return "a grid or image has too many values to say what the photos know of them"
    count = sum(item.parameter.width for item in plan.unknowns)
    if count > FEW:
        return f"{count} numbers are unknown, a fit verifies up to {FEW}"
    return ""


def paths(settings: FitSettings, plan: FitPlan) -> float:
    """Paths of a whole fit of the plan's unknowns and captures, in paths without derivatives; the
    settings are those of the fit, not the plan's."""
    scalars = sum(item.parameter.width for item in plan.unknowns)
    by_least_squares = settings.optimiser != "adam" and 0 < scalars <= FEW
    searches = settings.search == "on" or (
        settings.search == "auto"
        and by_least_squares
        and (not plan.fields or _start_even(plan, scalars))
    )
    differences = sum(_by_difference(item) for item in plan.unknowns)
    iterations, spp = settings.iterations, settings.spp
    along = bool(plan.fields) and searches and by_least_squares and _few_voxels(plan)
    verified = refinement_spp(settings) if along or not too_many(plan) else 0
    if along:
        iterations, verified = -(-iterations // 2), verified // _BESIDE_SHARE
    of_fields = 0.0
    if plan.fields:
        # In turns: five iterations each, after a search ten of the fields.
        of_fields = iterations * (1 - (1 / (3 if searches else 2) if by_least_squares else 0))
    elif by_least_squares:
        iterations = min(iterations, _SETTLED_AFTER)
    of_scalars = iterations - of_fields
    by_differences = 0.0
    if by_least_squares:
        first = min(of_scalars, _ALL_DIFFERENCES)
        by_differences = spp * differences * (first + (of_scalars - first) / _ROUND)
    validations = -(-iterations // _VALIDATION_EVERY) + 1
    validation = max(_VALIDATION_LEAST, _VALIDATION_TIMES * spp)
    steps = spp * (of_fields * _FIELD_DERIVATIVES + of_scalars * _DERIVATIVES)
    per_pixel = steps + by_differences + validations * validation
    if searches and any(item.kind.is_image for item in plan.fields):
        scales = [item.parameter.scale for item in plan.unknowns]
        trials = _TRIALS if "roughness" in scales else 1
        looked_for = _IOR_PICTURES * spp * scales.count("log_excess")
        turns = max(round(iterations / _CYCLE), 1) + 1
        per_pixel += turns * (trials * (looked_for + validation) - validation)
    if verified:
        roughnesses = sum(item.parameter.scale == "roughness" for item in plan.unknowns)
        slopes = _DERIVATIVES + differences + roughnesses  # these from both sides
        looks = _VERIFICATION_PASSES * (1 + slopes / _VERIFICATION_SHARE)
        if along:  # a roughness looks sharp there, mostly
            ends = 2 * (differences - roughnesses)
            looks = _BESIDE_PASSES + _BESIDE_DIFFERENCES * ends + _BESIDE_FOCUS
        per_pixel += validation + looks * verified
        if searches and not along:
            per_pixel += _RIVAL_PICTURES * verified / _RIVAL_SHARE
    total = pixels_at(plan.captures, settings.height) * per_pixel
    if searches:
        small = pixels_at(plan.captures, min(settings.height, _SEARCH_SIDE))
        total += small * (_SEARCH_LOOKS + _SEARCH_STEPS * (_DERIVATIVES + differences))
    return total


def _start_even(plan: FitPlan, scalars: int) -> bool:
    """Whether the native fit searches with one colour in place of each grid of albedos and each
    image: these are few numbers, and nothing is known of the voxels or texels of any field."""
    colours = sum(bool(item.kind.single) for item in plan.fields)
    even = all(
        np.ptp(item.values.reshape(-1, item.values.shape[-1]), axis=0).max() == 0
        for item in plan.fields
    )
    return even and colours > 0 and scalars + 3 * colours <= FEW


def _few_voxels(plan: FitPlan) -> bool:
    """Whether the native fit steps the voxels together with the scalars, in half the iterations,
    and verifies the scalars."""
    grids = all(
        item.kind.parameter == "albedo_grid" and item.values.shape[-1] == 3 for item in plan.fields
    )
    return grids and sum(item.values.size for item in plan.fields) <= _FEW_VOXELS


def _by_difference(unknown: Unknown) -> bool:
    """Whether the native fit takes a difference of pictures for its derivative."""
    of_material = unknown.parameter.effect in ("surface", "volume")
    return of_material and unknown.parameter.scale in ("log", "log_excess", "roughness")


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
    job = FitJob(replace(plan, stages=()))
    job.start()
    begun(job)
    job.join()
    seconds: float = job.result()["seconds"]
    return seconds, paths(plan.request.settings, plan)


def expected(plan: FitPlan, settings: FitSettings, per_path: float) -> float:
    """Seconds of a fit of the plan's unknowns and captures with other settings."""
    return per_path * paths(settings, plan)
