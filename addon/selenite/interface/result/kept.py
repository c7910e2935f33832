# SPDX-License-Identifier: GPL-3.0-or-later
"""What a fit has found, in the scene: so that Apply works after saving and loading."""

from __future__ import annotations

import bpy

from ...fit import trust
from ...fit.job import fitted_values
from ...messages import packed
from ...report import table
from ...report.findings import Finding, findings, in_short
from ..rows import fields as field_rows
from ..running.outcome import Outcome


def keep_result(scene: bpy.types.Scene, outcome: Outcome) -> None:
    """Constants: value, start, what stood in the scene, and how sure the value is."""
    settings = scene.selenite
    settings.results.clear()
    settings.applied = False
    plan, result = outcome.plan, outcome.result
    values = fitted_values(plan, result.fit)
    found = {(item.owner, item.parameter): item for item in findings(plan, result.fit)}
    for unknown in plan.unknowns:
        owner, name = outcome.owners[unknown.owner], unknown.parameter.name
        row = settings.results.add()
        row.owner, row.kind, row.parameter = owner.name, owner.kind, name
        row.datablock, row.library = owner.datablock, owner.library
        row.width = unknown.parameter.width
        row.is_vector = unknown.parameter.fit_lower < 0
        value = values[owner.name, name]
        row.start, row.value = three(unknown.start), three(value)
        row.original = three(owner.values[name])
        _keep_finding(row, found[owner.name, name])
    words = in_short(plan, result.fit)
    settings.verdict, settings.verdict_icon = packed([words.sentence]), words.icon
    settings.is_wrong = words.is_wrong
    settings.table = "\n".join("\t".join(line.cells) for line in table.lines(plan, result))
    rest = trust.sentences(plan, result.fit, intervals=False)
    settings.report = packed([*rest, *result.notes])


def keep_fields(scene: bpy.types.Scene, outcome: Outcome) -> None:
    """Results of grids and images name the files of the result folder."""
    if outcome.folder is None:
        return
    for field in outcome.plan.fields:
        row = scene.selenite.results.add()
        row.owner, row.kind = field.owner, field.kind.of
        owner = outcome.owners.get(field.owner) if row.kind != "object" else None
        if owner is not None:
            row.datablock, row.library = owner.datablock, owner.library
        field_rows.keep(row, field, outcome.result, outcome.folder)


def three(values: tuple[float, ...]) -> tuple[float, float, float]:
    """A number thrice, or a colour."""
    first, second, third = (values * 3)[:3]
    return first, second, third


def _keep_finding(row: bpy.types.PropertyGroup, found: Finding) -> None:
    row.sureness, row.unit = found.sureness, found.unit
    row.has_interval = bool(found.low)
    if found.low:
        row.low, row.high = three(found.low), three(found.high)
        row.bar_low, row.bar_high = found.bar
