# SPDX-License-Identifier: GPL-3.0-or-later
"""What a fit has found, in the scene: so that Apply works after saving and loading."""

from __future__ import annotations

import bpy

from ...fit import trust
from ...fit.job import fitted_values
from ...report import table
from ...report.findings import Finding, findings, in_short
from ..rows import fields as field_rows
from ..state import RUN


def keep_result(scene: bpy.types.Scene) -> None:
    """Constants: value, start, what stood in the scene, and how sure the value is."""
    settings = scene.selenite
    settings.results.clear()
    settings.applied = False
    values = fitted_values(RUN.plan, RUN.result)
    found = {(item.owner, item.parameter): item for item in findings(RUN.plan, RUN.result)}
    for unknown in RUN.plan.unknowns:
        owner, name = RUN.owners[unknown.owner], unknown.parameter.name
        row = settings.results.add()
        row.owner, row.kind, row.parameter = owner.name, owner.kind, name
        row.datablock, row.library = owner.datablock, owner.library
        row.width = unknown.parameter.width
        row.is_vector = unknown.parameter.fit_lower < 0
        value = values[owner.name, name]
        row.start, row.value = three(unknown.start), three(value)
        row.original = three(owner.values[name])
        _keep_finding(row, found[owner.name, name])
    words = in_short(RUN.plan, RUN.result)
    settings.verdict, settings.verdict_icon = words.sentence, words.icon
    settings.is_wrong = words.is_wrong
    settings.table = "\n".join("\t".join(line.cells) for line in table.lines(RUN.plan, RUN.result))
    rest = trust.sentences(RUN.plan, RUN.result, intervals=False)
    settings.report = "\n".join([*rest, *RUN.result.get("notes", ())])


def keep_fields(scene: bpy.types.Scene) -> None:
    """Results of grids and images name the files of the result folder."""
    if not RUN.plan.fields or RUN.folder is None:
        return
    for field in RUN.plan.fields:
        row = scene.selenite.results.add()
        row.owner, row.kind = field.owner, field.kind.of
        owner = RUN.owners.get(field.owner) if row.kind != "object" else None
        if owner is not None:
            row.datablock, row.library = owner.datablock, owner.library
        field_rows.keep(row, field, RUN.result, RUN.folder)


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
