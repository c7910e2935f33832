# SPDX-License-Identifier: GPL-3.0-or-later
"""A request and a scene -> everything a fit needs, or every reason why it cannot start."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ..problems import BadInput, Problem
from ..scene_read.build import build
from ..scene_read.values import SceneValues
from . import fields as grid_fields
from .captures import Capture, read_captures
from .fields import FieldUnknown
from .request import RunRequest, UnknownRequest
from .unknowns import Unknown, choose, usual_requests


@dataclass(frozen=True)
class FitPlan:
    """A fit that can start. `request` has every default filled in, so it reproduces the run;
    `scene` is the native scene with the start values."""

    request: RunRequest
    scene: Any
    captures: list[Capture]
    unknowns: list[Unknown]
    fields: list[FieldUnknown]
    warnings: list[str]
    model: str
    millimetres: float | None  # in one Blender unit, None where the scene has no units


def prepare(
    values: SceneValues, request: RunRequest, packed: Mapping[str, bytes] | None = None
) -> FitPlan:
    """Checks everything, reads the photos, builds the native scene; writes nothing.

    Raises BadInput with all problems at once, and NativeUnavailable.
    """
    problems = list(values.problems)
    warnings = list(values.warnings)
    requests = request.unknowns or tuple(usual_requests(values, problems))
    single, many = grid_fields.split(requests)
    unknowns = choose(values, single, request.settings, problems, warnings)
    fields = grid_fields.choose(values, many, unknowns, request.settings, problems)
    warnings += grid_fields.remarks(fields, unknowns)
    captures = read_captures(
        values, request.captures, request.settings.height, problems, warnings, packed or {}
    )
    if problems:
        raise BadInput(problems)
    values.physical_refraction = request.settings.physical_refraction
    scene = build_scene(grid_fields.with_fields(values, fields))
    starts = {(item.owner, item.parameter.name): item.start for item in unknowns}
    return FitPlan(
        request=replace(
            request,
            unknowns=(*(_filled(item) for item in unknowns), *(item.request for item in fields)),
        ),
        scene=scene.with_values(starts),
        captures=captures,
        unknowns=unknowns,
        fields=fields,
        warnings=warnings,
        model=model_name(unknowns, fields),
        millimetres=values.millimetres,
    )


def build_scene(values: SceneValues) -> Any:  # noqa: ANN401 - a native Scene has no Python type
    """Builds the native scene; what the native side refuses becomes a Problem."""
    if values.problems:
        raise BadInput(values.problems)
    try:
        scene = build(values)
    except ValueError as error:
        raise BadInput(Problem("Scene", str(error), "correct the scene")) from error
    for name, count in scene.dropped_triangles.items():
        values.warn(f"Mesh '{name}': {count} degenerate triangles are left out")
    return scene


def model_name(unknowns: list[Unknown], fields: Sequence[FieldUnknown] = ()) -> str:
    """Which model the ticked parameters need, and why."""
    if fields:
        return "volume: a ticked parameter is a grid"
    effects = {item.parameter.effect for item in unknowns}
    if "visibility" in effects:
        return "visibility: a ticked parameter moves silhouettes"
    if "volume" in effects:
        return "volume: a ticked parameter belongs to a medium"
    return "surface: no ticked parameter belongs to a medium or moves silhouettes"


def _filled(unknown: Unknown) -> UnknownRequest:
    return UnknownRequest(
        unknown.owner,
        unknown.parameter.name,
        unknown.start,
        unknown.minimum,
        unknown.maximum,
        unknown.learning_rate,
    )
