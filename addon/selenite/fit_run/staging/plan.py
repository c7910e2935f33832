# SPDX-License-Identifier: GPL-3.0-or-later
"""Stages against what is fitted: their names, settings, and where a grid follows an albedo."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ... import parameters
from ...parameters import Values
from ...problems import BadInput, Problem
from ...scene_read.values import SceneValues
from ..captures import Capture
from ..fields import FieldUnknown
from ..settings import FitSettings, with_overrides
from ..unknowns import Unknown, find_parameter
from .request import StageRequest

_GRID = "albedo_grid"  # that can follow the one albedo of its material


@dataclass(frozen=True)
class Stage:
    """A stage that can start: its settings, its photos at its height, the native scene in which
    `fields` lie: all grids of the run but those that wait for an albedo to be fitted first."""

    request: StageRequest
    settings: FitSettings
    captures: list[Capture]
    scene: Any
    fields: tuple[FieldUnknown, ...]


def named(
    scene: SceneValues, stages: Sequence[StageRequest], problems: list[Problem]
) -> list[StageRequest]:
    """Stages with the owners' own names and each stage's name once; faults go to `problems`."""
    found: list[StageRequest] = []
    for number, stage in enumerate(stages, start=1):
        title = stage.title(number)
        if stage.name in {item.name for item in found}:
            problems.append(Problem(title, "another stage has its name", "give it one of its own"))
        names = [_own_name(scene, text, title, problems) for text in stage.parameters]
        found.append(replace(stage, parameters=tuple(dict.fromkeys(names))))
    return found


def settings_of(
    stages: Sequence[StageRequest],
    names: Sequence[str],
    base: FitSettings,
    problems: list[Problem],
) -> list[FitSettings]:
    """The settings of each stage; `names` are those of all unknowns. Every stage has a seed of its
    own, beyond those that a user can give, so that no stage sees another one's noise again."""
    found = []
    for number, stage in enumerate(stages, start=1):
        title = stage.title(number)
        for name in stage.parameters:
            if name not in names:
                cause, cure = f"'{name}' is not fitted", f"take it out, or add --fit {name}"
                problems.append(Problem(title, cause, cure))
        own = base
        try:
            own = with_overrides(base, stage.overrides())
        except BadInput as error:
            problems += [
                Problem(f"{title}, {item.object.lower()}", item.cause, item.cure)
                for item in error.problems
            ]
        found.append(replace(own, seed=base.seed + ((number - 1) << 32)))
    for name in names if stages else ():
        if not any(name in stage.parameters for stage in stages):
            cause, cure = "it is in no stage", "name it in a stage, or do not fit it"
            problems.append(Problem(f"Parameter '{name}'", cause, cure))
    return found


def beside_grids(unknowns: Sequence[Unknown], stages: Sequence[StageRequest]) -> list[Unknown]:
    """The unknowns without the albedos whose stages all come before those of their grid."""
    return [item for item in unknowns if not _comes_before_grid(item, stages)]


def starting_at_albedo(
    fields: Sequence[FieldUnknown], unknowns: Sequence[Unknown], problems: list[Problem]
) -> list[FieldUnknown]:
    """Grids that follow a fitted albedo start where it starts; another start is a problem."""
    albedos = _albedos({item.name: item.start for item in unknowns}, unknowns)
    for item in fields:
        file = bool(item.request.grid) and not item.request.grid.isdecimal()
        if item.name in albedos and (file or item.request.start is not None):
            cause, cure = "it starts at the albedo that is fitted before it", "give no other start"
            problems.append(Problem(f"Parameter '{item.name}'", cause, cure))
    return [
        replace(item, start=replace(item.start, values=filled(item, albedos[item.name])))
        if item.name in albedos
        else item
        for item in fields
    ]


def filled(field: FieldUnknown, albedo: Values) -> np.ndarray:
    """The field's grid with one colour (1 or 3 numbers) in all voxels, inside its bounds."""
    shape = field.start.values.shape
    colour = np.asarray(albedo if shape[3] == len(albedo) else [np.mean(albedo)], np.float32)
    bounded = np.clip(colour, np.float32(field.minimum), np.float32(field.maximum))
    return np.broadcast_to(bounded, shape).copy()


def active_fields(
    stage: str,
    stages: Sequence[StageRequest],
    unknowns: Sequence[Unknown],
    fields: Sequence[FieldUnknown],
) -> list[FieldUnknown]:
    """The grids that are in the scene of a stage: a grid that follows an albedo is there only from
    its own first stage on."""
    names = [item.name for item in stages]
    so_far = stages[: names.index(stage) + 1]
    waiting = _albedos({item.name: item.start for item in unknowns}, unknowns)
    return [
        field
        for field in fields
        if field.name not in waiting or any(field.name in item.parameters for item in so_far)
    ]


def at_albedos(
    values: Mapping[str, Values], unknowns: Sequence[Unknown], fields: Sequence[FieldUnknown]
) -> dict[str, np.ndarray]:
    """By name the grids among `fields` that follow a fitted albedo, filled with its value."""
    albedos = _albedos(values, unknowns)
    return {item.name: filled(item, albedos[item.name]) for item in fields if item.name in albedos}


def placed(scene: Any, field: FieldUnknown, values: np.ndarray) -> Any:  # noqa: ANN401
    """The native scene with other values in a field's grid."""
    return scene.with_grid(field.owner, field.kind.use, values)


def constants(
    values: Mapping[str, Values], unknowns: Sequence[Unknown], fields: Sequence[FieldUnknown]
) -> dict[tuple[str, str], Values]:
    """(owner, parameter) -> value, without albedos in whose place one of `fields` stands."""
    grids = {field.name for field in fields}
    return {
        (item.owner, item.parameter.name): values[item.name]
        for item in unknowns
        if not (item.parameter.name == "albedo" and _grid_of(item) in grids)
    }


def _albedos(values: Mapping[str, Values], unknowns: Sequence[Unknown]) -> dict[str, Values]:
    """The values of fitted albedos by the name of the grid that would take their place."""
    return {
        _grid_of(item): values[item.name] for item in unknowns if item.parameter.name == "albedo"
    }


def _grid_of(unknown: Unknown) -> str:
    return parameters.join_name(unknown.owner, _GRID)


def _comes_before_grid(unknown: Unknown, stages: Sequence[StageRequest]) -> bool:
    grid = _grid_of(unknown)
    own = [index for index, stage in enumerate(stages) if unknown.name in stage.parameters]
    later = [index for index, stage in enumerate(stages) if grid in stage.parameters]
    return unknown.parameter.name == "albedo" and bool(own and later) and max(own) < min(later)


def _own_name(scene: SceneValues, text: str, title: str, problems: list[Problem]) -> str:
    """A name as the unknowns have it: a world may be called by its datablock's name."""
    try:
        owner_name, name = parameters.split_name(text)
    except ValueError as error:
        problems.append(Problem(title, str(error), "write OWNER:PARAMETER"))
        return text
    if name.endswith("_grid"):  # `fields` knows it
        return text
    found = find_parameter(scene, owner_name, name, problems)
    return text if found is None else parameters.join_name(found[0].name, name)
