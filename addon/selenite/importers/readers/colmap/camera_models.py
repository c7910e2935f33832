# SPDX-License-Identifier: GPL-3.0-or-later
"""COLMAP's camera models and which of them Brown's covers.

Source: COLMAP documentation, "Camera Models", and src/colmap/sensor/models.h (ids, parameters).
Pixels: the upper left corner of the photo is (0, 0), as in `Intrinsics`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...reconstruction import Intrinsics
from .. import numbers
from ..files import Place
from ..lenses import opencv_intrinsics

#: Name and parameters by id; those of f stand for both directions.
_NAMES: dict[int, tuple[str, str]] = {
    0: ("SIMPLE_PINHOLE", "f cx cy"),
    1: ("PINHOLE", "fx fy cx cy"),
    2: ("SIMPLE_RADIAL", "f cx cy k1"),
    3: ("RADIAL", "f cx cy k1 k2"),
    4: ("OPENCV", "fx fy cx cy k1 k2 p1 p2"),
    5: ("OPENCV_FISHEYE", "fx fy cx cy k1 k2 k3 k4"),
    6: ("FULL_OPENCV", "fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6"),
    7: ("FOV", "fx fy cx cy omega"),
    8: ("SIMPLE_RADIAL_FISHEYE", "f cx cy k1"),
    9: ("RADIAL_FISHEYE", "f cx cy k1 k2"),
    10: ("THIN_PRISM_FISHEYE", "fx fy cx cy k1 k2 p1 p2 k3 k4 sx1 sy1"),
    11: ("RAD_TAN_THIN_PRISM_FISHEYE", "fx fy cx cy k1 k2 k3 k4 k5 k6 p1 p2 s0 s1 s2 s3"),
    12: ("SIMPLE_DIVISION", "f cx cy k"),
    13: ("DIVISION", "fx fy cx cy k"),
    14: ("SIMPLE_FISHEYE", "f cx cy"),
    15: ("FISHEYE", "fx fy cx cy"),
    16: ("EUCM", "fx fy cx cy alpha beta"),
    17: ("EQUIRECTANGULAR", "w h"),
}
MODELS = {number: (name, tuple(words.split())) for number, (name, words) in _NAMES.items()}
BY_NAME = {name: number for number, (name, _) in MODELS.items()}
COVERED = frozenset((
    "SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "FULL_OPENCV",
))  # fmt: skip


@dataclass(frozen=True)
class ColmapCamera:
    """Intrinsics, or why Brown's model has none for it."""

    intrinsics: Intrinsics | None
    cause: str = ""


def colmap_camera(
    model: int, size: tuple[int, int], values: np.ndarray, place: Place
) -> ColmapCamera:
    """Of a model's id, the photo's size and its parameters. Raises ReconstructionError."""
    name, words = MODELS[model]
    if len(values) != len(words):
        raise place.error(f"{name} has {len(words)} parameters, not {len(values)}")
    numbers.finite(values, place)
    if name not in COVERED:
        return ColmapCamera(None, f"its model {name} is not Brown's")
    by_name = dict(zip(words, (float(value) for value in values), strict=True))
    if any(by_name.get(word, 0.0) for word in ("k4", "k5", "k6")):
        return ColmapCamera(None, f"its model {name} with k4 to k6 is not Brown's")
    if "f" in by_name:
        by_name["fx"] = by_name["f"]
    return ColmapCamera(opencv_intrinsics(size, by_name, place))
