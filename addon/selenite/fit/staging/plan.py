# SPDX-License-Identifier: GPL-3.0-or-later
"""Stages against what is fitted: their names, settings, and where a field follows one colour."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from ... import native, parameters
from ...capture.prepared import Capture
from ...messages import control, phrase, thing
from ...parameters import Values
from ...problems import BadInput, Problem
from ...scene_read.values import SceneValues
from ..field_kinds import IN_PLACE_OF, kind_of
from ..fields import FieldUnknown
from ..settings import FitSettings, with_overrides
from ..unknowns import Unknown, find_parameter
from .request import StageRequest

if TYPE_CHECKING:
    from ... import _core


@dataclass(frozen=True)
class Stage:
    """A stage that can start: its settings, its photos at its height, the native scene in which
    `fields` lie: all fields of the run but those that wait for one colour to be fitted first."""

    request: StageRequest
    settings: FitSettings
    captures: list[Capture]
    scene: _core.Scene
    fields: tuple[FieldUnknown, ...]
    source: SceneValues = field(default_factory=SceneValues)  # what the scene was built of

    def native(self) -> _core.Stage:
        """What the native Fit takes."""
        return native.core().Stage(
            self.request.name, list(self.request.parameters), [item.name for item in self.fields],
            self.scene, [item.native() for item in self.captures], self.settings.native(),
        )  # fmt: skip


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
                cause = f"'{name}' is not fitted"
                cure = phrase(
                    "take it out, or {fit} {name}", fit=control("fit", "add --fit"), name=name
                )
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
            problems.append(Problem(thing("Parameter", name), cause, cure))
    return found


def fitted_with_fields(
    unknowns: Sequence[Unknown], stages: Sequence[StageRequest]
) -> list[Unknown]:
    """The unknowns without the colours whose stages all come before those of their field."""
    return [item for item in unknowns if not _comes_before_field(item, stages)]


def starting_at_colour(
    fields: Sequence[FieldUnknown], unknowns: Sequence[Unknown], problems: list[Problem]
) -> list[FieldUnknown]:
    """Fields that follow a fitted colour start where it starts; another start is a problem."""
    colours = _colours({item.name: item.start for item in unknowns}, unknowns)
    for item in fields:
        file = bool(item.request.grid) and not item.request.grid.isdecimal()
        if item.name in colours and (file or item.request.start is not None):
            cause = f"it starts at the {item.kind.single} that is fitted before it"
            problems.append(Problem(thing("Parameter", item.name), cause, "give no other start"))
    return [
        item.starting_at(item.filled(colours[item.name])) if item.name in colours else item
        for item in fields
    ]


def active_fields(
    stage: str,
    stages: Sequence[StageRequest],
    unknowns: Sequence[Unknown],
    fields: Sequence[FieldUnknown],
) -> list[FieldUnknown]:
    """The fields that are in the scene of a stage: one that follows a colour is there only from its
    own first stage on."""
    names = [item.name for item in stages]
    so_far = stages[: names.index(stage) + 1]
    waiting = _colours({item.name: item.start for item in unknowns}, unknowns)
    return [
        field
        for field in fields
        if field.name not in waiting or any(field.name in item.parameters for item in so_far)
    ]


def constants(
    values: Mapping[str, Values], unknowns: Sequence[Unknown], fields: Sequence[FieldUnknown]
) -> dict[tuple[str, str], Values]:
    """(owner, parameter) -> value, without colours in whose place one of `fields` stands."""
    names = {field.name for field in fields}
    return {
        (item.owner, item.parameter.name): values[item.name]
        for item in unknowns
        if _field_of(item) not in names
    }


def _colours(values: Mapping[str, Values], unknowns: Sequence[Unknown]) -> dict[str, Values]:
    """The values of fitted colours by the name of the field that would take their place."""
    return {
        _field_of(item): values[item.name]
        for item in unknowns
        if item.parameter.name in IN_PLACE_OF
    }


def _field_of(unknown: Unknown) -> str:
    """The name of the field that can take the place of an unknown; "" if none can."""
    field = IN_PLACE_OF.get(unknown.parameter.name, "")
    return parameters.join_name(unknown.owner, field) if field else ""


def _comes_before_field(unknown: Unknown, stages: Sequence[StageRequest]) -> bool:
    field = _field_of(unknown)
    own = [index for index, stage in enumerate(stages) if unknown.name in stage.parameters]
    later = [index for index, stage in enumerate(stages) if field in stage.parameters]
    return bool(own and later) and max(own) < min(later)


def _own_name(scene: SceneValues, text: str, title: str, problems: list[Problem]) -> str:
    """A name as the unknowns have it: a world may be called by its datablock's name."""
    try:
        owner_name, name = parameters.split_name(text)
    except ValueError as error:
        problems.append(Problem(title, str(error), "write OWNER:PARAMETER"))
        return text
    if kind_of(name) is not None:  # `fields` knows it
        return text
    found = find_parameter(scene, owner_name, name, problems, fields=True)
    return text if found is None else parameters.join_name(found[0].name, name)
