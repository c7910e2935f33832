# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers out of text, and what poses have to be made of. All in double precision."""

from __future__ import annotations

import math
import re
import warnings

import numpy as np

from .files import Place, shortened

#: Beyond any coordinate; products of several are finite.
LARGEST = 1e30
#: By how much the axes of a rotation may miss unit length and right angles: a few printed digits.
ROTATION_ERROR = 1e-3
#: Of one file: a mesh of three million triangles.
MOST_NUMBERS = 30_000_000
#: Pixels along one side of a photo.
MOST_PIXELS = 1 << 20
_WHOLE = re.compile(r"[+-]?[0-9]{1,18}")


def finite(values: np.ndarray, place: Place) -> np.ndarray:
    """The same. Raises ReconstructionError for NaN, infinity and what is beyond LARGEST."""
    # NaN is passed on by both, and no other array is made of what may be large.
    if values.size and not (values.min() >= -LARGEST and values.max() <= LARGEST):
        bad = values[~(np.abs(values) <= LARGEST)].flat[0]
        raise place.error(f"{bad} is no usable number")
    return values


def numbers(text: str | None, place: Place, count: int | None = None) -> np.ndarray:
    """Numbers between white space, finite; `count` of them where that is given.
    Raises ReconstructionError."""
    if text is None or not text.strip():
        found = np.zeros(0)
    elif len(text) > MOST_NUMBERS and sum(map(text.count, " \t\r\n")) > MOST_NUMBERS:
        raise place.error(f"it has more than {MOST_NUMBERS} numbers", "reduce the mesh")
    else:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                found = np.fromstring(text, dtype=np.float64, sep=" ")
        except (ValueError, DeprecationWarning) as error:
            raise place.error(f"'{shortened(text)}' are no numbers") from error
    if count is not None and len(found) != count:
        raise place.error(f"it has {len(found)} numbers instead of {count}")
    return finite(found, place)


def number(text: str | None, place: Place) -> float:
    """One finite number. Raises ReconstructionError."""
    return float(numbers(text, place, 1)[0])


def positive(text: str | None, place: Place) -> float:
    """A number above 0. Raises ReconstructionError."""
    value = number(text, place)
    if not value > 0:
        raise place.error(f"{value:g} is not above 0")
    return value


def whole(text: str | None, place: Place) -> int:
    """A whole number. Raises ReconstructionError."""
    if text is None or not _WHOLE.fullmatch(text.strip()):
        raise place.error(f"'{shortened(text or '')}' is no whole number")
    return int(text)


def pixels(value: int, place: Place) -> int:
    """The same, if it can be the width or height of a photo. Raises ReconstructionError."""
    if not 1 <= value <= MOST_PIXELS:
        raise place.error(f"a photo of {value} pixels a side; 1 to {MOST_PIXELS} can be")
    return value


def indices(values: np.ndarray, place: Place) -> np.ndarray:
    """Whole numbers of 32 bits. Raises ReconstructionError."""
    if values.size and not ((np.abs(values) < 2**31).all() and (values == np.floor(values)).all()):
        raise place.error("not all of them are whole numbers of 32 bits")
    return values.astype(np.int64)


def nearest_rotation(matrix: np.ndarray, place: Place) -> np.ndarray:
    """3 x 3: the rotation that a printed one means. Raises ReconstructionError for what is none."""
    finite(matrix, place)
    if not np.abs(matrix.T @ matrix - np.eye(3)).max() <= ROTATION_ERROR:
        raise place.error("its axes are not of unit length at right angles")
    if np.linalg.det(matrix) < 0:
        raise place.error("it is a mirror image, not a rotation")
    left, _, right = np.linalg.svd(matrix)
    return left @ right


def rotation(text: str | None, place: Place) -> np.ndarray:
    """3 x 3 that is printed row by row. Raises ReconstructionError for what is none."""
    return nearest_rotation(numbers(text, place, 9).reshape(3, 3), place)


def quaternion_rotation(wxyz: np.ndarray, place: Place) -> np.ndarray:
    """3 x 3 of a quaternion w, x, y, z of any length but 0. Raises ReconstructionError."""
    length = math.sqrt(float(np.dot(finite(wxyz, place), wxyz)))
    if not length > 1e-8:
        raise place.error("its quaternion is 0")
    w, x, y, z = wxyz / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def pose(rotation: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """4 x 4, camera to world."""
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = rotation, centre
    return found


def pose_of_world_to_camera(rotation: np.ndarray, translation: np.ndarray) -> np.ndarray:
    """4 x 4, camera to world, of x_camera = rotation x + translation."""
    return pose(rotation.T, -rotation.T @ translation)
