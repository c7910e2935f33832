# SPDX-License-Identifier: GPL-3.0-or-later
"""Grids in files: NumPy's .npy and Mitsuba's .vol.

In memory a grid is (nz, ny, nx, channels) float32 with 1 or 3 channels, x along the last but one
axis. A .npy holds that array, or (nz, ny, nx) for numbers. A .vol begins with "VOL", version 3,
then in little endian the encoding (1: float32), nx, ny, nz, the channels and the corners of a box,
and goes on with the numbers, x fastest and channels together.
Source of the latter: the description of the format in Mitsuba's manual, plugin gridvolume.
"""

from __future__ import annotations

import io
import os
import struct
import tokenize
from pathlib import Path
from typing import Literal

import numpy as np

from .atomic_files import write_bytes
from .messages import thing
from .paths import why_not_file
from .problems import BadInput, Problem

#: As the native module has it.
MOST_PER_AXIS = 4096
MOST_NUMBERS = 1 << 28
_HEADER = struct.Struct("<3sB5i6f")
#: What reading a damaged or hostile file raises: the header of a .npy is text in Python's syntax.
_DAMAGED = (
    OSError, EOFError, ValueError, TypeError, KeyError, SyntaxError, OverflowError, RecursionError,
    MemoryError, struct.error, tokenize.TokenError,
)  # fmt: skip
_NPY_HEADERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}
_CURE = "give a whole .npy or .vol file of float numbers with 1 or 3 channels"


def read(path: str) -> np.ndarray:
    """The grid of a file, (nz, ny, nx, channels) float32. Sizes are checked before memory is asked
    for. Raises BadInput."""
    title = thing("Grid", path)
    readers = {".npy": _read_npy, ".vol": _read_vol}
    reader = readers.get(Path(path).suffix.lower())
    if reader is None:
        cause = f"its ending '{Path(path).suffix}' is not known"
        raise BadInput(Problem(title, cause, "give a .npy or .vol file"))
    if why := why_not_file(path):
        raise BadInput(Problem(title, f"cannot be read ({why})", _CURE))
    try:
        return reader(Path(path))
    except _DAMAGED as error:
        raise BadInput(Problem(title, f"cannot be read ({error})", _CURE)) from error


def write_npy(path: Path, values: np.ndarray) -> None:
    """(nz, ny, nx, channels) float32. Raises OSError."""
    # By way of memory: numpy does not say that a disk took no more of a file.
    stream = io.BytesIO()
    np.save(stream, np.ascontiguousarray(values, np.float32), allow_pickle=False)
    write_bytes(path, stream.getvalue())


def write_vol(path: Path, values: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
    """Mitsuba's format; `low`, `high` (3,): corners of the grid's box in world units, for programs
    that read them. Raises OSError."""
    nz, ny, nx, channels = values.shape
    header = _HEADER.pack(b"VOL", 3, 1, nx, ny, nz, channels, *low, *high)
    write_bytes(path, header + np.ascontiguousarray(values, "<f4").tobytes())


def _read_npy(path: Path) -> np.ndarray:
    # np.load takes archives and pickles for grids; here it is an array or nothing. It is mapped,
    # not read: a header that lies about the size costs no memory.
    with path.open("rb") as file:
        version = np.lib.format.read_magic(file)
        if version not in _NPY_HEADERS:
            raise ValueError(f"its version of .npy is {version}, which is not known")
        shape, is_fortran, dtype = _NPY_HEADERS[version](file)
        first = file.seek(0, os.SEEK_CUR)
    if dtype.kind != "f":
        raise ValueError(f"its numbers are of type {dtype}, not float")
    if len(shape) not in (3, 4):
        raise ValueError(f"its shape is {shape}, not (nz, ny, nx) or (nz, ny, nx, channels)")
    whole = (*shape, 1) if len(shape) == 3 else shape
    _check_size(whole)
    order: Literal["F", "C"] = "F" if is_fortran else "C"
    mapped = np.memmap(path, dtype=dtype, mode="r", offset=first, shape=shape, order=order)
    return np.array(mapped, np.float32, order="C").reshape(whole)


def _read_vol(path: Path) -> np.ndarray:
    with path.open("rb") as file:
        head = file.read(_HEADER.size)
        if len(head) < _HEADER.size:
            raise ValueError("it is shorter than a header")
        word, version, encoding, nx, ny, nz, channels, *_ = _HEADER.unpack(head)
        if word != b"VOL" or version != 3:
            raise ValueError("it does not begin with VOL, version 3")
        if encoding != 1:
            raise ValueError(f"its encoding is {encoding}; only 1 (float32) is read")
        shape = (nz, ny, nx, channels)
        _check_size(shape)
        count = nx * ny * nz * channels
        found = (os.fstat(file.fileno()).st_size - _HEADER.size) / 4
        if found != count:
            raise ValueError(f"it holds {found:g} numbers, its header announces {count}")
        return np.fromfile(file, "<f4", count).astype(np.float32, copy=False).reshape(shape)


def _check_size(shape: tuple[int, ...]) -> None:
    if shape[3] not in (1, 3):
        raise ValueError(f"it has {shape[3]} channels, not 1 or 3")
    count = 1
    for size in shape:
        count *= int(size)
    if not all(1 <= size <= MOST_PER_AXIS for size in shape[:3]) or count > MOST_NUMBERS:
        raise ValueError(
            f"its size is {' x '.join(map(str, shape))}; at most {MOST_PER_AXIS} along an axis and "
            f"{MOST_NUMBERS} numbers are read"
        )
