# SPDX-License-Identifier: GPL-3.0-or-later
"""The albedo and density grids of a material's medium as unknowns."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ... import grid_files
from ...parameters import Values
from ...paths import file_stems
from ...problems import BadInput, Problem
from ...scene_read.values import GridValues, Owner, SceneValues
from ..field_kinds import FieldKind, field_kind
from ..request import UnknownRequest
from ..settings import FitSettings
from ..unknowns import Unknown
from .base import FieldUnknown, is_share, material_of, rate_of, share_bounds, whole_number

if TYPE_CHECKING:
    from ..._core import Scene

#: Largest density by default, in largest densities of the start.
DENSITY_RANGE = 10.0
#: Voxels along the longest side of the object, where the request names no grid.
USUAL_SIZE = 16
MOST_BY_NUMBER = 512


@dataclass(frozen=True, eq=False)
class GridUnknown(FieldUnknown):
    """`start` lies over the box of the objects that have the material, or where the scene's own
    grid lies."""

    start: GridValues

    @property
    def values(self) -> np.ndarray:
        """(nz, ny, nx, channels)."""
        return self.start.values

    def starting_at(self, values: np.ndarray) -> GridUnknown:
        """This grid with another start."""
        return replace(self, start=replace(self.start, values=values))

    def in_scene(self, scene: SceneValues) -> SceneValues:
        """The scene with the start in it."""
        return with_grids(scene, {self.owner: {self.kind.use: self.start}})

    def placed(self, scene: Scene, values: np.ndarray) -> Scene:
        """The native scene, which has the grid, with other values in it."""
        return scene.with_grid(self.owner, self.kind.use, values)

    def stored(self, colour: Values) -> np.ndarray:
        """As it is: grids are linear."""
        return np.asarray(colour, np.float32)

    @property
    def files(self) -> list[str]:
        """NumPy's and Mitsuba's format."""
        stem = f"{self.stem}_{self.kind.use}"
        return [f"{stem}.npy", f"{stem}.vol"]

    def write(self, folder: Path, values: np.ndarray, coverage: np.ndarray | None) -> None:
        """Both files; of a grid nothing is known of its coverage. Raises OSError."""
        npy, vol = self.files
        grid_files.write_npy(folder / npy, values)
        grid_files.write_vol(folder / vol, values, *self.box())

    def about(self, values: np.ndarray, coverage: np.ndarray | None) -> dict[str, object]:
        """Voxels along x, y and z, and the files."""
        return {"voxels": [int(n) for n in values.shape[2::-1]], "files": self.files}

    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest corner in the world of the box over which the grid lies."""
        corners = np.array([[x, y, z, 1.0] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
        world = (np.linalg.inv(self.start.to_unit) @ corners.T)[:3]
        return world.min(axis=1), world.max(axis=1)


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
    """Material -> use -> grid, of the grids among `fields`, from arrays by the fields' names."""
    grids: dict[str, dict[str, GridValues]] = {}
    for item in fields:
        if isinstance(item, GridUnknown):
            found = replace(item.start, values=arrays[item.name])
            grids.setdefault(item.owner, {})[item.kind.use] = found
    return grids


def grid_unknown(
    scene: SceneValues,
    request: UnknownRequest,
    others: Sequence[Unknown],
    settings: FitSettings,
    title: str,
) -> GridUnknown:
    """The grid that a request asks for, with its start. Raises BadInput."""
    kind = field_kind(request.parameter)
    owner = material_of(scene, request, title)
    fitted = {item.parameter.name for item in others if item.owner == owner.name}
    if request.unseen:
        cause, cure = "what photos see of a grid is not known", "leave --unseen out"
        raise BadInput(Problem(title, cause, cure))
    if not any(owner.values.get("extinction", ())) and "extinction" not in fitted:
        cause = "the material has no medium"
        cure = "link a Principled Volume to the Volume of its output"
        raise BadInput(Problem(title, cause, cure))
    start = _start(scene, owner, request, title)
    largest = float(start.values.max())
    scale = 1.0 if kind.use == "albedo" or not largest > 0 else largest
    low, high = _bounds(request, kind, scale, title)
    rate = rate_of(request, settings, title)
    clamped = replace(start, values=np.clip(start.values, np.float32(low), np.float32(high)))
    filled = replace(request, owner=owner.name, minimum=low, maximum=high, learning_rate=rate)
    stem = file_stems(scene.owners)[owner.name]
    return GridUnknown(owner.name, kind, low, high, rate, scale, filled, stem, clamped)


def _bounds(
    request: UnknownRequest, kind: FieldKind, scale: float, title: str
) -> tuple[float, float]:
    if kind.use == "albedo":
        return share_bounds(request, title)
    low = 0.0 if request.minimum is None else request.minimum
    high = DENSITY_RANGE * scale if request.maximum is None else request.maximum
    if not 0 <= low < high <= float(np.finfo(np.float32).max):
        cause = f"its bounds [{low:g}, {high:g}] are not an interval of finite numbers from 0 up"
        raise BadInput(Problem(title, cause, "give bounds such as 0 and 10"))
    return low, high


def _start(scene: SceneValues, owner: Owner, request: UnknownRequest, title: str) -> GridValues:
    """From a file, from the scene, or one value in as many voxels as asked for."""
    kind = field_kind(request.parameter)
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
    number = whole_number(request.grid, USUAL_SIZE)
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


def _is_value(fill: Values, kind: FieldKind) -> bool:
    """Whether one voxel may hold it."""
    if kind.use == "albedo":
        return is_share(fill)
    return len(fill) == 1 and math.isfinite(fill[0]) and fill[0] >= 0


def _from_file(path: str, kind: FieldKind, title: str) -> np.ndarray:
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
