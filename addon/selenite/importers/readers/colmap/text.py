# SPDX-License-Identifier: GPL-3.0-or-later
"""The text files of a COLMAP model: cameras.txt, images.txt, points3D.txt, rigs.txt, frames.txt.

Source: COLMAP documentation, "Output Format".
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .. import numbers
from ..files import Place, is_file, shortened
from ..lines import word_lines
from .camera_models import BY_NAME, colmap_camera
from .model import CAMERA_SENSOR, Frame, Image, Model, Rig, RigidTransform


def _values(words: list[str], place: Place, count: int | None = None) -> np.ndarray:
    return numbers.numbers(" ".join(words), place, count)


def _least(words: list[str], count: int, place: Place) -> None:
    if len(words) < count:
        raise place.error(f"it has {len(words)} words; {count} at least are needed")


def read_text_model(folder: Path, model: Model) -> None:
    """Fills the model with what the folder holds. Raises ReconstructionError."""
    for words, place in word_lines(folder / "cameras.txt"):
        _least(words, 5, place)
        number = BY_NAME.get(words[1])
        if number is None:
            model.add_unknown(numbers.whole(words[0], place), shortened(words[1]), place)
            continue
        size = numbers.whole(words[2], place), numbers.whole(words[3], place)
        camera = colmap_camera(number, size, _values(words[4:], place), place)
        model.add_camera(numbers.whole(words[0], place), camera, place)
    if is_file(folder / "rigs.txt"):
        for words, place in word_lines(folder / "rigs.txt"):
            _rig(words, place, model)
    if is_file(folder / "frames.txt"):
        for words, place in word_lines(folder / "frames.txt"):
            _frame(words, place, model)
    for words, place in word_lines(folder / "images.txt", triples_follow=True):
        _least(words, 10, place)
        number = numbers.whole(words[0], place)
        pose = RigidTransform(_values(words[1:5], place, 4), _values(words[5:8], place, 3))
        name = " ".join(words[9:])
        model.add_image(Image(number, pose, numbers.whole(words[8], place), name), place)
    if is_file(folder / "points3D.txt"):
        found = []
        for words, place in word_lines(folder / "points3D.txt"):
            _least(words, 4, place)
            found.append(_values(words[1:4], place, 3))
        model.points = np.array(found).reshape(-1, 3)


class _Words:
    """Words of a line, one after another."""

    def __init__(self, words: list[str], place: Place) -> None:
        self._words, self._place, self._at = words, place, 0

    def take(self, count: int) -> list[str]:
        found = self._words[self._at : self._at + count]
        if len(found) < count:
            raise self._place.error("it ends too early")
        self._at += count
        return found

    def whole(self) -> int:
        return numbers.whole(self.take(1)[0], self._place)

    def sensor(self) -> tuple[int, int]:
        kind, number = self.take(2)
        kinds = {"CAMERA": CAMERA_SENSOR, "IMU": 1}
        if kind not in kinds:
            raise self._place.error(f"'{shortened(kind)}' is no sensor; CAMERA and IMU are")
        return kinds[kind], numbers.whole(number, self._place)

    def pose(self) -> RigidTransform:
        values = _values(self.take(7), self._place, 7)
        return RigidTransform(values[:4], values[4:])


def _rig(words: list[str], place: Place, model: Model) -> None:
    line = _Words(words, place)
    number, count = line.whole(), line.whole()
    sensors: dict[tuple[int, int], RigidTransform | None] = {}
    for index in range(min(count, len(words))):
        sensor = line.sensor()
        if index == 0:
            sensors[sensor] = RigidTransform.identity()
        else:
            sensors[sensor] = line.pose() if line.whole() else None
    model.add_rig(Rig(number, sensors), place)


def _frame(words: list[str], place: Place, model: Model) -> None:
    line = _Words(words, place)
    number, rig, pose, count = line.whole(), line.whole(), line.pose(), line.whole()
    data = [(line.sensor(), line.whole()) for _ in range(min(count, len(words)))]
    model.add_frame(Frame(number, rig, pose, tuple(data)), place)
