# SPDX-License-Identifier: GPL-3.0-or-later
"""Unknowns with a value at every voxel: the albedo grid of a material's medium."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from .. import grid_files, parameters
from ..problems import BadInput, Problem, listed
from ..scene_read.values import GridValues, Owner, SceneValues
from .request import UnknownRequest
from .settings import FitSettings
from .unknowns import Unknown

ALBEDO_GRID = "albedo_grid"
#: Voxels along the longest side of the object, where the request names no grid.
USUAL_SIZE = 16
_MOST_BY_NUMBER = 512


@dataclass(frozen=True, eq=False)
class FieldUnknown:
    """A grid of the fit; `start` lies over the box of the objects that have the material, or where
    the scene's own grid lies. The bounds hold for each number."""

    owner: str
    start: GridValues
    minimum: float
    maximum: float
    learning_rate: float
    request: UnknownRequest

    @property
    def name(self) -> str:
        """As in `Body:albedo_grid`."""
        return parameters.join_name(self.owner, ALBEDO_GRID)

    def native(self) -> dict[str, Any]:
        """What the native Fit takes; the start is the scene's."""
        return {
            "owner": self.owner,
            "parameter": ALBEDO_GRID,
            "minimum": self.minimum,
            "maximum": self.maximum,
            "learning_rate": self.learning_rate,
        }

    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest corner in the world of the box over which the grid lies."""
        corners = np.array([[x, y, z, 1.0] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
        world = (np.linalg.inv(self.start.to_unit) @ corners.T)[:3]
        return world.min(axis=1), world.max(axis=1)


def split(requests: Sequence[UnknownRequest]) -> tuple[list[UnknownRequest], list[UnknownRequest]]:
    """(those with one value, fields)."""
    fields = [item for item in requests if item.parameter == ALBEDO_GRID]
    return [item for item in requests if item.parameter != ALBEDO_GRID], fields


def choose(
    scene: SceneValues,
    requests: Sequence[UnknownRequest],
    others: Sequence[Unknown],
    settings: FitSettings,
    problems: list[Problem],
) -> list[FieldUnknown]:
    """Requests -> fields with their start; what is wrong goes to `problems`."""
    found: list[FieldUnknown] = []
    for request in requests:
        title = f"Parameter '{parameters.join_name(request.owner, ALBEDO_GRID)}'"
        try:
            field = _field(scene, request, others, settings, title)
        except BadInput as error:
            problems += error.problems
            continue
        if field.owner in {item.owner for item in found}:
            problems.append(Problem(title, "given twice", "give it once"))
        found.append(field)
    return found


def with_fields(values: SceneValues, fields: Sequence[FieldUnknown]) -> SceneValues:
    """The scene with the grids at which the fields start."""
    starts = {item.owner: item.start for item in fields}
    materials = [
        replace(item, grids=item.grids | {"albedo": starts[item.name]})
        if item.name in starts
        else item
        for item in values.materials
    ]
    return replace(values, materials=materials)


def _field(
    scene: SceneValues,
    request: UnknownRequest,
    others: Sequence[Unknown],
    settings: FitSettings,
    title: str,
) -> FieldUnknown:
    owner = scene.owners.get(request.owner)
    if owner is None or owner.kind != "material":
        names = listed(item.name for item in scene.owners.values() if item.kind == "material")
        cause = f"no material of the scene is called '{request.owner}'"
        raise BadInput(Problem(title, cause, f"use one of {names}"))
    fitted = {item.parameter.name for item in others if item.owner == owner.name}
    if "albedo" in fitted:
        cause = "it takes the place of the one albedo, which is fitted too"
        raise BadInput(Problem(title, cause, "fit one of them"))
    if not any(owner.values.get("extinction", ())) and "extinction" not in fitted:
        cause = "the material has no medium"
        cure = "link a Principled Volume to the Volume of its output"
        raise BadInput(Problem(title, cause, cure))
    low = 0.0 if request.minimum is None else request.minimum
    high = 1.0 if request.maximum is None else request.maximum
    if not 0 <= low < high <= 1:
        cause = f"its bounds [{low:g}, {high:g}] are not an interval inside [0, 1]"
        raise BadInput(Problem(title, cause, "give bounds inside [0, 1]"))
    rate = settings.learning_rate if request.learning_rate is None else request.learning_rate
    if not (math.isfinite(rate) and 0 < rate <= 1):
        cure = "give a number above 0 and at most 1"
        raise BadInput(Problem(title, f"its learning rate is {rate}", cure))
    start = _start(scene, owner, request, title)
    clamped = replace(start, values=np.clip(start.values, np.float32(low), np.float32(high)))
    filled = replace(request, owner=owner.name, minimum=low, maximum=high, learning_rate=rate)
    return FieldUnknown(owner.name, clamped, low, high, rate, filled)


def _start(scene: SceneValues, owner: Owner, request: UnknownRequest, title: str) -> GridValues:
    """From a file, from the scene, or one colour in as many voxels as asked for."""
    material = next(item for item in scene.materials if item.name == owner.name)
    own = material.grids.get("albedo")
    fill = request.start
    if fill is not None and not (
        len(fill) in (1, 3) and all(math.isfinite(x) and 0 <= x <= 1 for x in fill)
    ):
        cause = f"its start is {', '.join(f'{x:g}' for x in fill)}"
        raise BadInput(Problem(title, cause, "give 1 or 3 numbers in [0, 1]"))
    if request.grid and not request.grid.isdecimal():
        if fill is not None:
            cure = "give --start or a file with --grid"
            raise BadInput(Problem(title, "it has two starts", cure))
        values = grid_files.read(request.grid)
        low, high = float(values.min()), float(values.max())
        if not (low >= 0 and high <= 1):  # also for NaN
            cause = f"grid '{request.grid}' holds numbers outside [0, 1] or not finite"
            raise BadInput(Problem(title, cause, "give shares of the light that is scattered"))
        to_unit = _over_objects(scene, owner, title)[0] if own is None else own.to_unit
        return GridValues(Path(request.grid).name, values, to_unit)
    if own is not None and not request.grid:
        if fill is None:
            return own
        colour = np.asarray(fill if own.values.shape[3] == 3 else fill[:1], np.float32)
        return replace(own, values=np.broadcast_to(colour, own.values.shape).copy())
    number = int(request.grid or USUAL_SIZE)
    if not 1 <= number <= _MOST_BY_NUMBER:
        cause = f"its grid has {number} voxels along the longest side"
        raise BadInput(Problem(title, cause, f"give 1 to {_MOST_BY_NUMBER}, or a file"))
    to_unit, extent = _over_objects(scene, owner, title)
    nx, ny, nz = (max(1, round(number * side / extent.max())) for side in extent)
    colour = np.asarray(fill or owner.values.get("albedo", (0.8,)), np.float32)
    values = np.empty((nz, ny, nx, 3), np.float32)
    values[:] = colour
    return GridValues(f"{owner.name} albedo", values, to_unit)


def _over_objects(scene: SceneValues, owner: Owner, title: str) -> tuple[np.ndarray, np.ndarray]:
    """World to unit cube, and the sides, of the box around all objects with the material."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for item in scene.objects:
        if owner.name in item.materials:
            points = scene.meshes[item.mesh].positions.astype(np.float64)
            points = points @ item.matrix[:3, :3].T + item.matrix[:3, 3]
            low, high = np.minimum(low, points.min(axis=0)), np.maximum(high, points.max(axis=0))
    extent = high - low
    if not (np.isfinite(extent).all() and (extent > 0).all()):
        cure = "give the material to an object that encloses a space"
        raise BadInput(Problem(title, "its objects enclose no box", cure))
    to_unit = np.eye(4)
    to_unit[:3, :3] = np.diag(1 / extent)
    to_unit[:3, 3] = -low / extent
    return to_unit, extent
