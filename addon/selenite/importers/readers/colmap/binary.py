# SPDX-License-Identifier: GPL-3.0-or-later
"""The binary files of a COLMAP model, little-endian.

Source: COLMAP documentation, "Output Format", and src/colmap/scene/reconstruction_io_binary.cc.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ..files import MOST_BINARY, Place, is_file, size_of
from .camera_models import MODELS, colmap_camera
from .model import Frame, Image, Model, Rig, RigidTransform

#: Bytes of an image's name.
LONGEST_NAME = 4096
#: Of points3D: a point without its track.
_POINT = struct.Struct("<Q3d3BdQ")
MOST_POINTS = 20_000_000


class _Stream:
    """A file from its start to its end, never beyond."""

    def __init__(self, stream: BinaryIO, size: int, file: Path) -> None:
        self._stream, self._left = stream, size
        self.place = Place(file, "file")

    def take(self, form: struct.Struct) -> tuple:
        """What stands next. Raises ReconstructionError at the end of the file."""
        self._need(form.size)
        return form.unpack(self._stream.read(form.size))

    def number(self, form: str) -> int:
        """One of struct's whole numbers."""
        return self.take(_FORMS[form])[0]

    def pose(self) -> RigidTransform:
        """Seven doubles: quaternion and translation."""
        values = np.array(self.take(_FORMS["7d"]))
        return RigidTransform(values[:4], values[4:])

    def doubles(self, count: int) -> np.ndarray:
        """(count,)"""
        return np.array(self.take(struct.Struct(f"<{count}d")))

    def skip(self, size: int) -> None:
        """Raises ReconstructionError at the end of the file."""
        self._need(size)
        self._stream.seek(size, 1)

    def name(self) -> str:
        """Up to the next 0."""
        found = bytearray()
        while (letter := self.number("B")) != 0:
            found.append(letter)
            if len(found) > LONGEST_NAME:
                raise self.place.error(f"a name is longer than {LONGEST_NAME} bytes")
        try:
            return found.decode("utf-8")
        except UnicodeDecodeError as error:
            raise self.place.error("a name is no text in UTF-8") from error

    def count(self, form: str, least: int) -> int:
        """How many entries of at least that many bytes follow; no more than fit into the file."""
        found = self.number(form)
        if found * least > self._left:
            raise self.place.error(f"it ends before the last of its {found} entries")
        return found

    def end(self) -> None:
        """Raises ReconstructionError if bytes are left."""
        if self._left:
            raise self.place.error(f"{self._left} bytes follow its last entry")

    def _need(self, size: int) -> None:
        if size > self._left:
            raise self.place.error("it ends in the midst of an entry")
        self._left -= size


_FORMS = {form: struct.Struct(f"<{form}") for form in ("B", "i", "I", "Q", "7d")}


@contextmanager
def _opened(file: Path) -> Iterator[_Stream]:
    size = size_of(file, MOST_BINARY)
    try:
        with file.open("rb") as stream:
            found = _Stream(stream, size, file)
            yield found
            found.end()
    except (OSError, struct.error) as error:
        raise Place(file, "file").unreadable(error) from error


def read_binary_model(folder: Path, model: Model) -> None:
    """Fills the model with what the folder holds. Raises ReconstructionError."""
    parts: tuple[tuple[str, bool, Callable[[_Stream, Model], None]], ...] = (
        ("cameras", True, _cameras),
        ("rigs", False, _rigs),
        ("frames", False, _frames),
        ("images", True, _images),
        ("points3D", False, _points),
    )
    for name, needed, read in parts:
        file = folder / f"{name}.bin"
        if needed or is_file(file):
            with _opened(file) as stream:
                read(stream, model)


def _cameras(stream: _Stream, model: Model) -> None:
    for _ in range(stream.count("Q", 24)):
        number, kind = stream.number("I"), stream.number("i")
        size = stream.number("Q"), stream.number("Q")
        place = stream.place.at(f"camera {number}")
        if kind not in MODELS:
            # How many parameters it has is not known, so nothing behind it can be read.
            raise place.error(f"its model {kind} is not known", "export the model as text")
        values = stream.doubles(len(MODELS[kind][1]))
        model.add_camera(number, colmap_camera(kind, size, values, place), place)


def _rigs(stream: _Stream, model: Model) -> None:
    for _ in range(stream.count("Q", 8)):
        number, count = stream.number("I"), stream.count("I", 8)
        sensors: dict[tuple[int, int], RigidTransform | None] = {}
        for index in range(count):
            sensor = stream.number("i"), stream.number("I")
            if index == 0:
                sensors[sensor] = RigidTransform.identity()
            else:
                sensors[sensor] = stream.pose() if stream.number("B") else None
        model.add_rig(Rig(number, sensors), stream.place.at(f"rig {number}"))


def _frames(stream: _Stream, model: Model) -> None:
    for _ in range(stream.count("Q", 68)):
        number, rig, pose = stream.number("I"), stream.number("I"), stream.pose()
        data = []
        for _ in range(stream.count("I", 16)):
            data.append(((stream.number("i"), stream.number("I")), stream.number("Q")))
        model.add_frame(Frame(number, rig, pose, tuple(data)), stream.place.at(f"frame {number}"))


def _images(stream: _Stream, model: Model) -> None:
    for _ in range(stream.count("Q", 73)):
        number, pose, camera = stream.number("I"), stream.pose(), stream.number("I")
        name = stream.name()
        # The features: two coordinates and the number of a point for each.
        stream.skip(24 * stream.count("Q", 24))
        model.add_image(Image(number, pose, camera, name), stream.place.at(f"image {number}"))


def _points(stream: _Stream, model: Model) -> None:
    count = stream.count("Q", _POINT.size)
    if count > MOST_POINTS:
        raise stream.place.error(f"it has {count} points; at most {MOST_POINTS} are read")
    found = np.zeros((count, 3))
    for index in range(count):
        entry = stream.take(_POINT)
        found[index] = entry[1:4]
        stream.skip(8 * entry[-1])
    model.points = found
