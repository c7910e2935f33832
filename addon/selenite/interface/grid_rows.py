# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows and results of the panel that are grids: where they start, and how they reach the scene."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from .. import grid_files
from ..fit_run.fields import DENSITY_RANGE, KINDS, USUAL_SIZE, FieldUnknown
from ..fit_run.results import field_files, field_text
from ..problems import BadInput, Problem
from ..scene_read.scene import read_scene
from ..scene_read.values import GridValues, Owner, SceneValues
from ..write_back import grids as grid_objects


def is_grid(row: bpy.types.PropertyGroup) -> bool:
    """Whether a row or a result is a grid."""
    return row.parameter in KINDS


def has_grids(owner: Owner) -> bool:
    """Whether grids of an owner can be fitted: it has a medium."""
    return owner.kind == "material" and any(owner.values.get("extinction", ()))


def own_grid(values: SceneValues, owner: Owner, parameter: str) -> GridValues | None:
    """The grid that the scene has, None where it has a constant."""
    material = next((item for item in values.materials if item.name == owner.name), None)
    return material.grids.get(KINDS[parameter].use) if material is not None else None


def describe(row: bpy.types.PropertyGroup, own: GridValues | None) -> None:
    """Fills what the list says of a grid."""
    kind = KINDS[row.parameter]
    row.width, row.unit, row.help = kind.channels, "1", f"{kind.help}. It is fitted with Adam"
    row.value = "no grid" if own is None else " x ".join(map(str, own.values.shape[2::-1]))


def reset(row: bpy.types.PropertyGroup, own: GridValues | None) -> None:
    """A new grid, or that of the scene if it has one, with the usual bounds."""
    row.grid_from = "new" if own is None else "scene"
    row.voxels = USUAL_SIZE
    largest = float(own.values.max()) if own is not None else 0.0
    albedo = KINDS[row.parameter].use == "albedo"
    row.minimum = 0.0
    row.maximum = 1.0 if albedo else DENSITY_RANGE * (largest or 1.0)
    row.start = (0.8, 0.8, 0.8) if albedo else (1.0, 1.0, 1.0)


def requested(row: bpy.types.PropertyGroup, own: GridValues | None, title: str) -> str:
    """The `grid` of the row's request. Raises BadInput."""
    if row.grid_from == "file":
        if not row.grid_path:
            cure = "choose a .npy or .vol file, or another start"
            raise BadInput(Problem(title, "it starts from a file, and none is chosen", cure))
        return bpy.path.abspath(row.grid_path)
    if row.grid_from == "scene":
        if own is None:
            cure = "choose New Grid or File"
            raise BadInput(
                Problem(title, "it starts from the scene's grid, and there is none", cure)
            )
        return ""
    return str(row.voxels)


def keep(
    row: bpy.types.PropertyGroup, field: FieldUnknown, result: dict[str, Any], folder: Path
) -> None:
    """Fills one result from the files of the result folder, so that it survives saving."""
    row.parameter, row.width = field.kind.parameter, field.kind.channels
    row.grid_file = str(folder / field_files(field)[0])
    row.grid_to_unit = json.dumps(field.start.to_unit.tolist())
    row.text = field_text(field, result["fields_best"][field.name])


def fitted(scene: bpy.types.Scene) -> dict[str, dict[str, GridValues]]:
    """The grids of the scene's results, material -> use -> grid. Raises BadInput."""
    found: dict[str, dict[str, GridValues]] = {}
    for row in scene.selenite.results:
        if is_grid(row):
            use = KINDS[row.parameter].use
            grid = GridValues(
                f"{row.owner} {use}",
                grid_files.read(row.grid_file),
                np.array(json.loads(row.grid_to_unit), np.float64),
            )
            found.setdefault(row.owner, {})[use] = grid
    return found


def apply(scene: bpy.types.Scene) -> list[str]:
    """Shows the fitted grids by Volume objects; returns what was done. All or none: raises
    BadInput."""
    lines: list[str] = []
    done: list[str] = []
    rows = {row.owner: row for row in scene.selenite.results if is_grid(row)}
    grids = fitted(scene)
    values = read_scene(scene)
    try:
        for name, uses in grids.items():
            if name not in values.owners:
                cause, cure = "the scene has no such material", "undo its removal or renaming"
                raise BadInput(Problem(f"Material '{name}'", cause, cure))
            folder = Path(rows[name].grid_file).parent
            lines.append(grid_objects.show(scene, values, name, uses, folder))
            done.append(name)
    except BadInput:
        for name in done:
            grid_objects.restore(scene, name)
        raise
    return lines


def restore(scene: bpy.types.Scene) -> None:
    """The media as they were before `apply`."""
    for name in dict.fromkeys(row.owner for row in scene.selenite.results if is_grid(row)):
        grid_objects.restore(scene, name)
