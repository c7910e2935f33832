# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenVDB files through the module that comes with Blender; nothing is installed for it.

A voxel lies where Cycles 4.5 renders it: that of index i fills i to i + 1 of the index space,
half a voxel further than OpenVDB itself has it (blender_tests/test_volume_objects.py).
Blender calls it `openvdb` from 4.4 on and `pyopenvdb` before, as does Debian's python3-openvdb.
"""

from __future__ import annotations

import errno
import importlib
import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Protocol

import bpy
import numpy as np

from ..atomic_files import partial_name, take_place
from ..grid_files import MOST_NUMBERS, MOST_PER_AXIS

_NAMES = ("openvdb", "pyopenvdb")
#: Voxels of background around what is read: outside nothing is, and linear interpolation ends there
#: as in Cycles.
PADDING = 1


class HostTransform(Protocol):
    """From voxels to the file's world."""

    def indexToWorld(self, place: tuple[float, ...]) -> Sequence[float]: ...  # noqa: N802, D102


class HostGrid(Protocol):
    """A grid of the host's module, as far as it is used."""

    name: str
    gridClass: str  # noqa: N815
    transform: HostTransform

    @property
    def valueTypeName(self) -> str: ...  # noqa: N802, D102
    def activeVoxelCount(self) -> int: ...  # noqa: N802, D102
    def evalActiveVoxelBoundingBox(self) -> Sequence[Sequence[int]]: ...  # noqa: N802, D102
    def copyFromArray(self, values: np.ndarray, ijk: Sequence[int]) -> None: ...  # noqa: N802, D102
    def copyToArray(self, values: np.ndarray, ijk: Sequence[int]) -> None: ...  # noqa: N802, D102


class VdbError(Exception):
    """Why a file or grid cannot be used: cause and cure."""

    def __init__(self, cause: str, cure: str) -> None:
        super().__init__(cause)
        self.cause, self.cure = cause, cure


@dataclass(frozen=True, eq=False)
class VdbGrid:
    """A dense grid: values (nz, ny, nx, 1 or 3) float32, and the map (4, 4) from the unit cube over
    which they lie to the file's world, which is the space of the Volume object."""

    name: str
    values: np.ndarray
    from_unit: np.ndarray


def module() -> ModuleType | None:
    """The host's OpenVDB module, None where it has none."""
    # Blender as a Python module does not put its own packages on the path.
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    own = Path(bpy.utils.resource_path("LOCAL")) / "python" / "lib" / version / "site-packages"
    sys.path.append(str(own))
    try:
        for name in _NAMES:
            try:
                return importlib.import_module(name)
            except ImportError:
                continue
    finally:
        sys.path.remove(str(own))
    return None


def read(path: str, wanted: dict[str, int]) -> dict[str, VdbGrid]:
    """The grids of a file by name; `wanted`: name -> channels. One that is missing is left out.
    Raises VdbError."""
    vdb = _module()
    try:
        with _in_utf8(path) as name:
            grids, _ = vdb.readAll(name)
    except Exception as error:  # the module raises types of its own
        cure = "give a whole OpenVDB file"
        raise VdbError(f"its file '{path}' cannot be read ({error})", cure) from error
    return {grid.name: _dense(grid, wanted[grid.name]) for grid in grids if grid.name in wanted}


def write(path: str, grids: Sequence[VdbGrid], source: str = "") -> None:
    """Writes `grids` to `path`, and with them those of the file `source` that have other names.
    Raises VdbError."""
    vdb = _module()
    try:
        others, metadata = [], {}
        if source:
            with _in_utf8(source) as name:
                others, metadata = vdb.readAll(name)
        names = {grid.name for grid in grids}
        kept = [grid for grid in others if grid.name not in names]
        made = [*kept, *(_made(vdb, grid) for grid in grids)]
        _write_whole(vdb, Path(path), made, metadata)
    except Exception as error:
        raise VdbError(f"'{path}' cannot be written ({error})", "give another folder") from error


def _write_whole(vdb: ModuleType, path: Path, grids: list[HostGrid], metadata: object) -> None:
    """Beside `path`, which it takes the place of once it can be read again: the module does not say
    that a disk took no more of it. Raises whatever the module raises, and OSError."""
    partial = partial_name(path)
    try:
        with _in_utf8(str(partial)) as name:
            vdb.write(name, grids, metadata)
            read, _ = vdb.readAll(name)
        counts = [{grid.name: grid.activeVoxelCount() for grid in some} for some in (grids, read)]
        if counts[0] != counts[1]:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))  # noqa: TRY301
        take_place(partial, path)
    finally:
        partial.unlink(missing_ok=True)


@contextmanager
def _in_utf8(path: str) -> Iterator[str]:
    """`path` for the module, which takes UTF-8 alone: another file's through a link to it."""
    if path == path.encode(errors="ignore").decode():
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="selenite-") as folder:
        link = Path(folder) / "grids.vdb"
        link.symlink_to(path)  # which need not exist yet
        yield str(link)


def _module() -> ModuleType:
    vdb = module()
    if vdb is None:
        cause = "this Blender has no OpenVDB module for Python"
        raise VdbError(cause, "use Blender 4.4 or newer, or install python3-openvdb")
    return vdb


def _made(vdb: ModuleType, grid: VdbGrid) -> HostGrid:
    made: HostGrid = vdb.Vec3SGrid() if grid.values.shape[3] == 3 else vdb.FloatGrid()
    made.name = grid.name
    values, start = grid.values, (0, 0, 0)
    if grid.values.shape[3] == 3:
        # Near its edges, too, the grid has to give its edge's colour.
        values, start = np.pad(values, ((1, 1), (1, 1), (1, 1), (0, 0)), mode="edge"), (-1, -1, -1)
        values = values.transpose(2, 1, 0, 3)
    else:
        values = values[..., 0].transpose(2, 1, 0)
        made.gridClass = vdb.GridClass.FOG_VOLUME
    made.copyFromArray(np.ascontiguousarray(values), ijk=start)
    to_unit = np.eye(4)
    to_unit[:3, :3] = np.diag(1 / np.array(grid.values.shape[2::-1]))
    made.transform = vdb.createLinearTransform((grid.from_unit @ to_unit).T.tolist())
    return made


def _dense(grid: HostGrid, channels: int) -> VdbGrid:
    label = f"grid '{grid.name}'"
    kinds = {1: ("float", "double"), 3: ("vec3s", "vec3d")}[channels]
    if grid.valueTypeName not in kinds:
        what = "one number" if channels == 1 else "a colour"
        cause = f"its {label} holds {grid.valueTypeName}, not {what} a voxel"
        raise VdbError(cause, "name another grid in the Principled Volume")
    if not grid.activeVoxelCount():
        raise VdbError(f"its {label} is empty", "give a file with something in it")
    low, high = (np.array(corner) for corner in grid.evalActiveVoxelBoundingBox())
    sizes = high - low + 1 + 2 * PADDING
    if max(sizes) > MOST_PER_AXIS or np.prod(sizes.astype(float)) * channels > MOST_NUMBERS:
        cause = f"its {label} spans {' x '.join(map(str, sizes))} voxels"
        raise VdbError(cause, f"give one of at most {MOST_NUMBERS // channels} voxels")
    start = low - PADDING
    shape = tuple(sizes) if channels == 1 else (*sizes, 3)
    kind = np.float64 if kinds[1] == grid.valueTypeName else np.float32
    values = np.empty(shape, kind)
    grid.copyToArray(values, ijk=tuple(int(i) for i in start))
    dense = values.reshape(*sizes, channels).transpose(2, 1, 0, 3)
    origin = np.array(grid.transform.indexToWorld((0, 0, 0)))
    columns = [np.array(grid.transform.indexToWorld(tuple(e))) - origin for e in np.eye(3).tolist()]
    to_world = np.eye(4)
    to_world[:3, :3], to_world[:3, 3] = np.stack(columns, axis=1), origin
    if not np.allclose(
        np.array(grid.transform.indexToWorld((1, 1, 1))), to_world[:3, :3].sum(axis=1) + origin
    ):
        raise VdbError(f"its {label} has a transform that is not affine", "resample it")
    from_unit = np.eye(4)
    from_unit[:3, :3], from_unit[:3, 3] = np.diag(sizes), start
    return VdbGrid(grid.name, np.ascontiguousarray(dense, np.float32), to_world @ from_unit)
