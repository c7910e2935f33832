# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel's settings as a run request: the same value that the command line makes."""

from __future__ import annotations

from dataclasses import fields, replace

import bpy

from .. import mean_free_path, parameters, write_back
from ..capture.scene_captures import captures_of, misplaced_backgrounds
from ..fit.request import RunRequest, UnknownRequest
from ..fit.settings import FitSettings
from ..parameters import Values
from ..problems import BadInput, Problem
from ..scene_read.options import options_of
from ..scene_read.values import Owner, SceneValues
from . import stages
from .chosen import chosen
from .furniture.preferences import preferences
from .rows import fields as field_rows
from .rows.labels import label_of, tip_of, unit_text
from .rows.owners import active_owner, owns, refresh_owners

#: Of the panel, in its order; the rate is each row's.
FIT_SETTINGS = tuple(field.name for field in fields(FitSettings) if field.name != "learning_rate")
#: What the user sets in a row, and refreshing keeps.
_KEPT = ("enabled", "use_start", "start", "minimum", "maximum", "learning_rate")


def run_request(scene: bpy.types.Scene, values: SceneValues) -> RunRequest:
    """What the ticked rows, or an own list of stages, ask for.

    Raises BadInput: rows whose owner is gone, nothing ticked; with what is wrong in the scene.
    """
    settings = scene.selenite
    problems: list[Problem] = []
    unknowns = []
    own = stages.own_stages(scene, problems)
    staged = {name for stage in own for name in stage.parameters}
    for row in settings.rows:
        if not (stages.row_name(row) in staged if own else row.enabled):
            continue
        owner = owner_of(row, values)
        if owner is None:
            title = f"Parameter '{row.owner}:{row.parameter}'"
            cure = "refresh the list of parameters"
            problems.append(Problem(title, "its owner is not in the scene", cure))
            continue
        of_field: dict[str, object] = {}
        if field_rows.is_field(row):
            title = f"Parameter '{parameters.join_name(owner.name, row.parameter)}'"
            try:
                of_field = field_rows.requested(row, values, owner, title)
            except BadInput as error:
                problems += error.problems
        asked = UnknownRequest(
            owner.name,
            row.parameter,
            tuple(row.start[: row.width]) if row.use_start else None,
            row.minimum,
            row.maximum,
            row.learning_rate,
        )
        unknowns.append(replace(asked, **of_field))
    if not unknowns and not problems and not values.problems:
        cure = "refresh the list of parameters and tick one"
        problems.append(Problem("Fit", "no parameter is ticked", cure))
    names = [parameters.join_name(item.owner, item.parameter) for item in unknowns]
    captures = tuple(captures_of(scene))
    problems += misplaced_backgrounds(scene)
    request = RunRequest(
        scene=bpy.data.filepath,
        unknowns=tuple(unknowns),
        captures=captures,
        settings=fit_settings(scene),
        stages=own or stages.named_stages(scene, names, captures, problems),
        reading=options_of(scene),
    )
    if problems or (not unknowns and values.problems):
        raise BadInput([*values.problems, *problems])
    return request


def fit_settings(scene: bpy.types.Scene) -> FitSettings:
    """The settings of the panel."""
    settings = scene.selenite
    found = {name: getattr(settings, name) for name in FIT_SETTINGS}
    found["threads"] = found["threads"] or preferences().threads
    return FitSettings(**found)


def owner_of(row: bpy.types.PropertyGroup, values: SceneValues) -> Owner | None:
    """The owner of a row as it was read; the pointers survive renaming."""
    if row.kind == "object":
        name = row.object.name if row.object is not None else ""
        return next((item for item in values.object_owners() if item.name == name), None)
    if row.kind == "world":
        return next((item for item in values.owners.values() if item.kind == "world"), None)
    block = row.material if row.kind == "material" else row.light
    if block is None:
        return None
    library = block.library.filepath if block.library is not None else ""
    for item in values.owners.values():
        if (item.kind, item.datablock, item.library) == (row.kind, block.name, library):
            return item
    return None


def refresh_rows(scene: bpy.types.Scene, values: SceneValues) -> None:
    """One row per parameter of the scene; ticks, starts and bounds of known rows stay."""
    rows = scene.selenite.rows
    kept = {}
    for row in rows:
        owner = owner_of(row, values)
        if owner is not None:
            found = {name: getattr(row, name) for name in (*_KEPT, *field_rows.PROPERTIES)}
            # The vector itself goes with the row.
            kept[owner.name, row.parameter] = found | {"start": tuple(row.start)}
    rows.clear()
    listed = [*values.owners.values()]
    listed += [item for item in values.object_owners() if field_rows.offered(values, item)]
    known = {(owner.kind, owner.name): owner for owner in listed}
    for owner in listed:
        for parameter in owner.listed():
            row = _fill(rows.add(), owner, parameter.name)
            row.usual = parameter.name in owner.usual
            row.unit, row.help, row.width = parameter.unit, parameter.help, parameter.width
            row.reason = owner.fixed.get(parameter.name, "")
            row.is_vector = parameter.fit_lower < 0
            show_current(row, owner.values.get(parameter.name), values.millimetres)
        for name in field_rows.offered(values, owner):
            field_rows.describe(_fill(rows.add(), owner, name), values, owner)
    for row in rows:
        reset_row(row, known[row.kind, row.owner], values)
        for name, value in kept.get((row.owner, row.parameter), {}).items():
            setattr(row, name, value)
        if row.reason:
            row.enabled = False
        row.label = row.name = label_of(row)
        row.tip = tip_of(row)
    refresh_owners(scene, listed)
    _choose_row(scene.selenite)


def show_current(
    row: bpy.types.PropertyGroup, current: Values | None, millimetres: float | None
) -> None:
    """What stands in the scene, None where it could not be read."""
    row.value = values_text(current) if current is not None else ""
    row.value += unit_text(row.unit) if row.value else ""
    is_colour = current is not None and row.width == 3 and max(current) <= 1
    row.is_colour = is_colour and not row.is_vector
    if row.is_colour:
        row.current = current
    if current is not None and row.parameter == "extinction":
        path = mean_free_path.of(current, millimetres)
        row.note = f"Mean free path {path.text()}"


def _choose_row(settings: bpy.types.PropertyGroup) -> None:
    """The active row is one that is listed."""
    owner, row = active_owner(settings), chosen(settings.rows, settings.active_row)
    if owner is None or (row is not None and owns(owner, row)):
        return
    owned = (at for at, row in enumerate(settings.rows) if owns(owner, row))
    settings.active_row = next(owned, 0)


def _fill(row: bpy.types.PropertyGroup, owner: Owner, parameter: str) -> bpy.types.PropertyGroup:
    row.kind, row.owner, row.parameter = owner.kind, owner.name, parameter
    if owner.kind == "material":
        row.material = write_back.datablock(bpy.data.materials, owner)
    elif owner.kind == "light":
        row.light = write_back.datablock(bpy.data.lights, owner)
    elif owner.kind == "object":
        row.object = write_back.datablock(bpy.data.objects, owner)
    return row


def reset_row(row: bpy.types.PropertyGroup, owner: Owner | None, values: SceneValues) -> None:
    """Bounds, start and rate as in the parameter table and in the scene. No owner: it is gone."""
    row.use_start = False
    row.learning_rate = FitSettings().learning_rate
    if field_rows.is_field(row):
        field_rows.reset(row, values, owner)
        return
    current = owner.values.get(row.parameter) if owner is not None else None
    parameter = owner.find(row.parameter) if owner is not None else None
    if parameter is None:
        return
    row.minimum, row.maximum = parameter.fit_lower, parameter.fit_upper
    if current is not None:
        row.start = (current * 3)[:3] if len(current) == 1 else current
        if parameter.effect == "emission":
            row.maximum = min(max(row.maximum, 10 * max(current)), parameter.upper)


def values_text(values: Values) -> str:
    """Numbers for a row of the panel."""
    digits = 3 if len(values) == 1 else 2  # three channels must fit the sidebar
    return " ".join(f"{value:.{digits}f}" for value in values)
