# SPDX-License-Identifier: GPL-3.0-or-later
"""Unknowns with a value at every voxel: the albedo and density grids of a material's medium."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
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


@dataclass(frozen=True)
class GridKind:
    """A grid that a medium may have: its name among the parameters, its use (the key of
    `MaterialValues.grids`), channels where it starts as a constant, and one sentence of help."""

    parameter: str
    use: str
    channels: int
    help: str


KINDS = {
    kind.parameter: kind
    for kind in (
        GridKind("albedo_grid", "albedo", 3, "Albedo at each voxel of a grid over the object"),
        GridKind("density_grid", "density", 1, "Number at each voxel that multiplies extinction"),
    )
}
#: Largest density by default, in largest densities of the start.
DENSITY_RANGE = 10.0
#: Voxels along the longest side of the object, where the request names no grid.
USUAL_SIZE = 16
MOST_BY_NUMBER = 512


@dataclass(frozen=True, eq=False)
class FieldUnknown:
    """A grid of the fit; `start` lies over the box of the objects that have the material, or where
    the scene's own grid lies. The bounds hold for each number. `scale`: the usual value, in which
    the learning rate counts."""

    owner: str
    kind: GridKind
    start: GridValues
    minimum: float
    maximum: float
    learning_rate: float
    scale: float
    request: UnknownRequest

    @property
    def name(self) -> str:
        """As in `Body:albedo_grid`."""
        return parameters.join_name(self.owner, self.kind.parameter)

    def native(self) -> dict[str, Any]:
        """What the native Fit takes; the start is the scene's."""
        return {
            "owner": self.owner,
            "parameter": self.kind.parameter,
            "minimum": self.minimum,
            "maximum": self.maximum,
            "learning_rate": self.learning_rate * self.scale,
        }

    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest corner in the world of the box over which the grid lies."""
        corners = np.array([[x, y, z, 1.0] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
        world = (np.linalg.inv(self.start.to_unit) @ corners.T)[:3]
        return world.min(axis=1), world.max(axis=1)


def split(requests: Sequence[UnknownRequest]) -> tuple[list[UnknownRequest], list[UnknownRequest]]:
    """(those with one value, fields)."""
    fields = [item for item in requests if item.parameter in KINDS]
    return [item for item in requests if item.parameter not in KINDS], fields


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
        title = f"Parameter '{parameters.join_name(request.owner, request.parameter)}'"
        try:
            field = _field(scene, request, others, settings, title)
        except BadInput as error:
            problems += error.problems
            continue
        if field.name in {item.name for item in found}:
            problems.append(Problem(title, "given twice", "give it once"))
        found.append(field)
    return found


def remarks(fields: Sequence[FieldUnknown], others: Sequence[Unknown]) -> list[str]:
    """What a user should know of the fields that can be fitted nevertheless."""
    extinctions = {item.owner for item in others if item.parameter.name == "extinction"}
    return [
        f"Parameter '{item.name}': only its product with {item.owner}:extinction, which is fitted "
        "too, is seen; fit one of them to know each"
        for item in fields
        if item.kind.use == "density" and item.owner in extinctions
    ]


def with_fields(values: SceneValues, fields: Sequence[FieldUnknown]) -> SceneValues:
    """The scene with the grids at which the fields start."""
    starts: dict[str, dict[str, GridValues]] = {}
    for item in fields:
        starts.setdefault(item.owner, {})[item.kind.use] = item.start
    return with_grids(values, starts)


def with_grids(values: SceneValues, grids: Mapping[str, Mapping[str, GridValues]]) -> SceneValues:
    """The scene with other grids: material -> use -> grid."""
    materials = [
        replace(item, grids=item.grids | dict(grids.get(item.name, {})))
        for item in values.materials
    ]
    return replace(values, materials=materials)


def fitted_grids(
    fields: Sequence[FieldUnknown], arrays: Mapping[str, np.ndarray]
) -> dict[str, dict[str, GridValues]]:
    """Material -> use -> grid, from arrays (nz, ny, nx, channels) by the fields' names."""
    grids: dict[str, dict[str, GridValues]] = {}
    for item in fields:
        grids.setdefault(item.owner, {})[item.kind.use] = replace(
            item.start, values=arrays[item.name]
        )
    return grids


def _field(
    scene: SceneValues,
    request: UnknownRequest,
    others: Sequence[Unknown],
    settings: FitSettings,
    title: str,
) -> FieldUnknown:
    kind = KINDS[request.parameter]
    owner = scene.owners.get(request.owner)
    if owner is None or owner.kind != "material":
        names = listed(item.name for item in scene.owners.values() if item.kind == "material")
        cause = f"no material of the scene is called '{request.owner}'"
        raise BadInput(Problem(title, cause, f"use one of {names}"))
    fitted = {item.parameter.name for item in others if item.owner == owner.name}
    if kind.use == "albedo" and "albedo" in fitted:
        cause = "it takes the place of the one albedo, which is fitted too"
        raise BadInput(Problem(title, cause, "fit one of them"))
    if not any(owner.values.get("extinction", ())) and "extinction" not in fitted:
        cause = "the material has no medium"
        cure = "link a Principled Volume to the Volume of its output"
        raise BadInput(Problem(title, cause, cure))
    start = _start(scene, owner, request, title)
    largest = float(start.values.max())
    scale = 1.0 if kind.use == "albedo" or not largest > 0 else largest
    low = 0.0 if request.minimum is None else request.minimum
    usual = 1.0 if kind.use == "albedo" else DENSITY_RANGE * scale
    high = usual if request.maximum is None else request.maximum
    most = 1.0 if kind.use == "albedo" else float(np.finfo(np.float32).max)
    if not 0 <= low < high <= most:
        albedo = kind.use == "albedo"
        within = "inside [0, 1]" if albedo else "of finite numbers from 0 up"
        cause = f"its bounds [{low:g}, {high:g}] are not an interval {within}"
        cure = "give bounds inside [0, 1]" if albedo else "give bounds such as 0 and 10"
        raise BadInput(Problem(title, cause, cure))
    rate = settings.learning_rate if request.learning_rate is None else request.learning_rate
    if not (math.isfinite(rate) and 0 < rate <= 1):
        cure = "give a number above 0 and at most 1"
        raise BadInput(Problem(title, f"its learning rate is {rate}", cure))
    clamped = replace(start, values=np.clip(start.values, np.float32(low), np.float32(high)))
    filled = replace(request, owner=owner.name, minimum=low, maximum=high, learning_rate=rate)
    return FieldUnknown(owner.name, kind, clamped, low, high, rate, scale, filled)


def _start(scene: SceneValues, owner: Owner, request: UnknownRequest, title: str) -> GridValues:
    """From a file, from the scene, or one value in as many voxels as asked for."""
    kind = KINDS[request.parameter]
    material = next(item for item in scene.materials if item.name == owner.name)
    own = material.grids.get(kind.use)
    fill = request.start
    if fill is not None and not _is_value(fill, kind):
        cause = f"its start is {', '.join(f'{x:g}' for x in fill)}"
        cure = "1 or 3 numbers in [0, 1]" if kind.use == "albedo" else "one number from 0 up"
        raise BadInput(Problem(title, cause, f"give {cure}"))
    if request.grid and not request.grid.isdecimal():
        if fill is not None:
            cure = "give --start or a file with --grid"
            raise BadInput(Problem(title, "it has two starts", cure))
        values = _from_file(request.grid, kind, title)
        to_unit = _over_objects(scene, owner, title)[0] if own is None else own.to_unit
        return GridValues(Path(request.grid).name, values, to_unit)
    if own is not None and not request.grid:
        if fill is None:
            return own
        colour = np.asarray(fill if own.values.shape[3] == 3 else fill[:1], np.float32)
        return replace(own, values=np.broadcast_to(colour, own.values.shape).copy())
    number = int(request.grid or USUAL_SIZE)
    if not 1 <= number <= MOST_BY_NUMBER:
        cause = f"its grid has {number} voxels along the longest side"
        raise BadInput(Problem(title, cause, f"give 1 to {MOST_BY_NUMBER}, or a file"))
    to_unit, extent = _over_objects(scene, owner, title)
    if kind.use == "density" and own is not None:  # beyond its box nothing is
        to_unit = own.to_unit
        extent = np.linalg.norm(np.linalg.inv(to_unit)[:3, :3], axis=0)
    nx, ny, nz = (max(1, round(number * side / extent.max())) for side in extent)
    constant = owner.values.get("albedo", (0.8,)) if kind.use == "albedo" else (1.0,)
    if kind.use == "density" and own is not None:
        constant = (float(own.values.mean()),)
    values = np.empty((nz, ny, nx, kind.channels), np.float32)
    values[:] = np.asarray(fill or constant, np.float32)
    return GridValues(f"{owner.name} {kind.use}", values, to_unit)


def _is_value(fill: Sequence[float], kind: GridKind) -> bool:
    """Whether one voxel may hold it."""
    if kind.use == "albedo":
        return len(fill) in (1, 3) and all(math.isfinite(x) and 0 <= x <= 1 for x in fill)
    return len(fill) == 1 and math.isfinite(fill[0]) and fill[0] >= 0


def _from_file(path: str, kind: GridKind, title: str) -> np.ndarray:
    values = grid_files.read(path)
    low, high = float(values.min()), float(values.max())
    if kind.use == "albedo" and not (low >= 0 and high <= 1):  # also for NaN
        cause = f"grid '{path}' holds numbers outside [0, 1] or not finite"
        raise BadInput(Problem(title, cause, "give shares of the light that is scattered"))
    if not (low >= 0 and math.isfinite(high)):
        cause = f"grid '{path}' holds {low if low < 0 else high:g}"
        raise BadInput(Problem(title, cause, "give finite numbers from 0 up"))
    if kind.use == "density" and values.shape[3] != 1:
        cause = f"grid '{path}' holds colours"
        raise BadInput(Problem(title, cause, "give one number a voxel"))
    return values


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
