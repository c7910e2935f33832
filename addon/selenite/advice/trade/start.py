# SPDX-License-Identifier: GPL-3.0-or-later
"""From a request to a measurement or an estimate: the same for the command line and the panel."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from ...capture.prepared import Capture, read_captures
from ...fit.plan import FitPlan, prepare
from ...fit.request import RunRequest
from ...fit.settings import PRESETS, FitSettings
from ...fit.unknowns import fitted_owners
from ...problems import BadInput, Problem
from ...scene_read.values import SceneValues
from .expected import Estimate
from .measure import Trade

_TALLEST = max(preset.height for preset in PRESETS.values())


def trade_of(
    values: SceneValues, request: RunRequest, packed: Mapping[str, bytes], budget: float
) -> Trade:
    """A measurement that can start: the scene's values are the truth, so starts of the request do
    not count. Without captures every camera of the scene takes part. Raises BadInput."""
    request = replace(
        request,
        unknowns=tuple(replace(item, start=None) for item in request.unknowns),
        settings=replace(request.settings, height=_TALLEST),
        stages=(),
    )
    empty = None if request.captures else _without_photos(values)

    def captures_at(height: int) -> list[Capture]:
        if empty is not None:
            return empty(height)
        owners = fitted_owners(values, request.unknowns)
        return read_captures(values, request.captures, height, [], [], packed, owners)

    plan = prepare(values, request, packed, empty)
    if plan.fields:
        title = f"Parameter '{plan.fields[0].name}'"
        cause = "known values of a grid or image cannot be made from the scene"
        raise BadInput(Problem(title, cause, "leave it out"))
    tallest = min(_TALLEST, max(item.reference.shape[0] for item in plan.captures))
    return Trade(plan, captures_at, budget, tallest)


def estimate_of(
    values: SceneValues,
    request: RunRequest,
    packed: Mapping[str, bytes],
    *,
    without_photos: bool = False,
) -> Estimate:
    """An estimate that can start, at the starts of the request; stages do not count.
    without_photos: if there are none, every camera of the scene takes part as if it had taken one.
    Raises BadInput and NativeUnavailable."""
    empty = _without_photos(values) if without_photos and not request.captures else None

    def plan_of(settings: FitSettings) -> FitPlan:
        return prepare(values, replace(request, settings=settings, stages=()), packed, empty)

    return Estimate(plan_of, request.settings)


def _without_photos(values: SceneValues) -> Callable[[int], list[Capture]]:
    """Every camera of the scene, no photo, no mask; never more pixels than the scene renders."""

    def captures(height: int) -> list[Capture]:
        found = []
        for camera in values.cameras:
            rows = min(height, camera.height)
            columns = max(1, round(rows * camera.aspect))
            black = np.zeros((rows, columns, 3), np.float32)
            weight = np.ones((rows, columns), np.float32)
            size = (camera.width, camera.height)
            found.append(Capture(camera.name, camera.name, "", size, black, weight, camera.aspect))
        return found

    return captures
