# SPDX-License-Identifier: GPL-3.0-or-later
"""bundle.out of Bundler, and the list of photos beside it.

A point is R X + t in the camera, which looks along -z with y up; its photo has the principal point
in the middle. Source: Bundler User's Manual, 3 "Output format and scene representation".
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from ..reconstruction import FLIP, ReconstructedCamera, Reconstruction
from . import numbers
from .files import Place, is_file, read_text
from .labels import Labels, LeftOut
from .lenses import intrinsics
from .lines import word_lines
from .pictures import Pictures

HEADER = b"# Bundle file"
MOST_CAMERAS, MOST_POINTS = 200_000, 20_000_000
NOT_ALIGNED = "it has no pose: its focal length is 0"
#: What may follow the name of a photo: 0 and its focal length in pixels.
_FOCAL = re.compile(r"\s+0\s+[0-9.eE+-]+\s*$")


class _Lines:
    """Numbers of one line after another."""

    def __init__(self, lines: Iterator[tuple[list[str], Place]], file: Path) -> None:
        self._lines, self._file = lines, file
        self.place = Place(file, "file")

    def next(self, count: int) -> np.ndarray:
        """(count,) of the next line. Raises ReconstructionError."""
        return numbers.numbers(" ".join(self.words()), self.place, count)

    def words(self) -> list[str]:
        """The words of the next line. Raises ReconstructionError."""
        words, self.place = next(self._lines, (None, Place(self._file, "file")))
        if words is None:
            raise self.place.error("it ends too early")
        return words


def read_bundler(file: Path, folders: Iterable[Path] = ()) -> Reconstruction:
    """All cameras that have a pose, and the points. Raises ReconstructionError."""
    lines = _Lines(word_lines(file), file)
    counts = numbers.indices(lines.next(2), lines.place)
    cameras, points = int(counts[0]), int(counts[1])
    if not 0 < cameras <= MOST_CAMERAS or not 0 <= points <= MOST_POINTS:
        raise lines.place.error(f"{cameras} cameras and {points} points cannot be read")
    names = _names(file, cameras)
    if not names:
        raise Place(file, "photos").error(
            "no list says which they are, and so not how large",
            "put list.txt beside it, with the path of a photo on each line",
        )
    pictures = Pictures(file.parent, folders)
    labels, skipped = Labels(), LeftOut()
    found = []
    for count, label in enumerate(names):
        place = Place(file, f"camera {count} '{label}'")
        camera = _camera(lines, label, pictures, place)
        if camera is None:
            skipped.add(label, NOT_ALIGNED)
        else:
            labels.add(label, place)
            found.append(camera)
    if not found:
        raise Place(file, "cameras").error(f"none can be used ({NOT_ALIGNED})")
    remarks = tuple(skipped.remarks())
    return Reconstruction(file.stem, tuple(found), points=_points(lines, points), remarks=remarks)


def _camera(
    lines: _Lines, label: str, pictures: Pictures, place: Place
) -> ReconstructedCamera | None:
    """None for one that has no pose: all is 0."""
    focal, k1, k2 = (float(value) for value in lines.next(3))
    rotation = np.stack([lines.next(3) for _ in range(3)])
    translation = lines.next(3)
    if focal == 0:
        return None
    rotation = numbers.nearest_rotation(rotation, place)
    size = pictures.size([label], place)
    lens = intrinsics(size, {"fx": focal, "k1": k1, "k2": k2}, place)
    pose = numbers.pose(rotation.T @ FLIP, -rotation.T @ translation)
    return ReconstructedCamera(label, pose, lens, photo=label)


def _points(lines: _Lines, count: int) -> np.ndarray:
    """(count, 3); colours and where they are seen are skipped."""
    found = []
    for _ in range(count):
        found.append(lines.next(3))
        lines.words()
        lines.words()
    return np.array(found).reshape(-1, 3)


def _names(file: Path, cameras: int) -> list[str]:
    """Of photos, as a list beside the file gives them; empty where there is none."""
    for name in (f"{file.name}.list.txt", f"{file.stem}.list.txt", "list.txt"):
        path = file.with_name(name)
        if is_file(path):
            lines = [line.strip() for line in read_text(path).splitlines() if line.strip()]
            if len(lines) != cameras:
                raise Place(path, "list").error(f"it has {len(lines)} photos for {cameras} cameras")
            return [_FOCAL.sub("", line).strip() for line in lines]
    return []
