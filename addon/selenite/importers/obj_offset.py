# SPDX-License-Identifier: GPL-3.0-or-later
"""An OBJ whose vertices lie far from the origin, as a copy that single precision can hold."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

#: Coordinates below this are kept to 6e-5 by single precision, and the copy is not made.
_NEAR = 1000.0


@contextmanager
def near_origin(file: Path) -> Iterator[tuple[Path, np.ndarray]]:
    """(file, offset): the file itself and zeros, or a copy without its first vertex's place, in
    whole units; vertex of `file` = that of the copy + offset, in double precision. Materials and
    pictures stay where they are: the copy's folder has links to what lies beside `file`."""
    offset = _offset_of(file) if file.suffix.lower() == ".obj" else np.zeros(3)
    if not offset.any():
        yield file, offset
        return
    with tempfile.TemporaryDirectory(prefix="selenite-") as folder:
        for item in file.parent.iterdir():
            if item != file:
                (Path(folder) / item.name).symlink_to(item.resolve())
        copy = Path(folder) / file.name
        with file.open("rb") as source, copy.open("wb") as target:
            for line in source:
                target.write(_moved(line, offset) if line.startswith(b"v ") else line)
        yield copy, offset


def _offset_of(file: Path) -> np.ndarray:
    """Of the first vertex, zeros where it is near or cannot be read."""
    with file.open("rb") as lines:
        first = next((line for line in lines if line.startswith(b"v ")), b"")
    try:
        place = np.array([float(part) for part in first.split()[1:4]])
    except ValueError:
        return np.zeros(3)
    far = place.shape == (3,) and np.isfinite(place).all() and np.abs(place).max() > _NEAR
    return np.round(place) if far else np.zeros(3)


def _moved(line: bytes, offset: np.ndarray) -> bytes:
    parts = line.split()
    try:
        place = [float(part) - shift for part, shift in zip(parts[1:4], offset, strict=True)]
    except ValueError:  # Blender's importer says what it makes of it
        return line
    numbers = " ".join(repr(float(value)) for value in place)
    return b" ".join([b"v", numbers.encode(), *parts[4:]]) + b"\n"
