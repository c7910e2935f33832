# SPDX-License-Identifier: GPL-3.0-or-later
"""transforms.json of NeRF, instant-ngp and Nerfstudio.

Poses are camera to world with the axes of OpenGL (x right, y up, looking along -z); coefficients
are OpenCV's. Source: Nerfstudio documentation, "Data conventions"; instant-ngp, "Tips for training
NeRF models".
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import NoReturn

import numpy as np

from ..reconstruction import (
    FLIP,
    Intrinsics,
    ReconstructedCamera,
    Reconstruction,
    ReconstructionError,
)
from . import numbers
from .files import Place, inside, is_file, read_bytes, shortened
from .labels import Labels, LeftOut, usable_text
from .lenses import opencv_intrinsics
from .pictures import Pictures
from .ply import read_points

MOST_BYTES = 64 << 20
#: Numbers and texts of a file, and its lists and objects: ten thousand cameras have a fifth.
MOST_VALUES = 2_000_000
MOST_CONTAINERS = 500_000
FISHEYE = ("is_fisheye", "ftheta_p0", "latlong", "equirectangular")
#: Values of camera_model that are a pinhole with Brown's distortion.
MODELS = ("", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "PERSPECTIVE")
LENS = ("k1", "k2", "k3", "k4", "p1", "p2")


def read_nerf(file: Path, pictures: tuple[Path, ...] = ()) -> Reconstruction:
    """All frames. Raises ReconstructionError."""
    shared = _parsed(file)
    place = Place(file, "frames")
    frames = shared.get("frames")
    if not isinstance(frames, list) or not frames:
        raise place.error("it is missing or empty")
    found: list[ReconstructedCamera] = []
    labels, skipped, photos = Labels(), LeftOut(), Pictures(file.parent, pictures)
    for count, frame in enumerate(frames):
        where = Place(file, f"frame {count}")
        if not isinstance(frame, dict):
            raise where.error("it is no object with transform_matrix")
        photo, mask = _text(frame, "file_path", where), _text(frame, "mask_path", where)
        if not photo and not mask:
            raise where.error("it has no file_path", "write the path of its photo there")
        label = labels.add(photo or mask, where)
        where = where.at(f"frame {count} '{label}'")
        values = _Values(frame, shared, where)
        cause = values.other_model()
        pose = _pose(frame.get("transform_matrix"), where)
        if cause:
            skipped.add(label, cause)
            continue
        lens = values.intrinsics(photos, (photo, mask))
        found.append(ReconstructedCamera(label, pose, lens, photo=photo, mask=mask))
    if not found:
        raise place.error(f"none can be used ({skipped.causes()})", "undistort the photos")
    remarks = [*skipped.remarks()]
    if _is_moved(shared):
        remarks.append(
            "its cameras were moved after the reconstruction (applied_transform): a mesh from "
            "before does not fit them"
        )
    points = _points(shared, file)
    return Reconstruction(file.stem, tuple(found), points=points, remarks=tuple(remarks))


def _points(shared: dict[str, object], file: Path) -> np.ndarray:
    """(n, 3) that Nerfstudio writes in a file of their own, moved as the cameras are; none if it is
    not there. Raises ReconstructionError."""
    name = _text(shared, "ply_file_path", Place(file, "ply_file_path"))
    path = inside(file.parent, name) if name else None
    return read_points(path) if path is not None and is_file(path) else np.zeros((0, 3))


def _parsed(file: Path) -> dict[str, object]:
    data = read_bytes(file, MOST_BYTES)
    place = Place(file, "JSON")
    if data.count(b",") > MOST_VALUES or data.count(b"[") + data.count(b"{") > MOST_CONTAINERS:
        raise place.error(f"it has more than {MOST_VALUES} values", "export fewer cameras")

    def constant(text: str) -> NoReturn:
        raise place.error(f"{text} is no number")

    try:
        found = json.loads(data.decode("utf-8-sig"), parse_constant=constant)
    except RecursionError as error:
        raise place.error("its lists are nested too deep") from error
    except UnicodeDecodeError as error:
        raise place.error("it is no text in UTF-8") from error
    except ReconstructionError:
        raise
    except ValueError as error:
        raise place.error(f"it is no JSON ({shortened(str(error))})") from error
    if not isinstance(found, dict):
        raise place.error("it is no object with frames")
    return found


def _is_moved(shared: dict[str, object]) -> bool:
    """Whether Nerfstudio has turned or scaled the world of the program before it."""
    neutral = (None, np.eye(3, 4).tolist(), np.eye(4).tolist())
    applied, scale = shared.get("applied_transform"), shared.get("applied_scale")
    return applied not in neutral or scale not in (None, 1)


def _text(frame: dict[str, object], key: str, place: Place) -> str:
    found = frame.get(key, "")
    if found is None:
        return ""
    if not isinstance(found, str):
        raise place.error(f"{key} is no text")
    return usable_text(found, place)


def _pose(value: object, place: Place) -> np.ndarray:
    place = place.at(f"{place.element}, transform_matrix")
    if not isinstance(value, list) or len(value) not in (3, 4):
        raise place.error("it is no matrix of 4 x 4")
    rows = []
    for row in value:
        if not isinstance(row, list) or len(row) != 4:
            raise place.error("it is no matrix of 4 x 4")
        rows.append([_number(entry, place) for entry in row])
    matrix = np.array(rows)
    if len(matrix) == 4 and np.abs(matrix[3] - (0, 0, 0, 1)).max() > 1e-9:
        raise place.error("its last row is not 0 0 0 1")
    rotation = numbers.nearest_rotation(matrix[:3, :3], place)
    return numbers.pose(rotation @ FLIP, matrix[:3, 3])


def _number(value: object, place: Place) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise place.error(f"'{shortened(str(value)[:100])}' is no number")
    if not abs(value) <= numbers.LARGEST:
        raise place.error("a number is too large")
    return float(value)


class _Values:
    """What a frame says of its lens, or all frames share."""

    def __init__(self, frame: dict[str, object], shared: dict[str, object], place: Place) -> None:
        self._frame, self._shared, self._place = frame, shared, place

    def get(self, key: str) -> object:
        """Of the frame, else of all; None if neither has it."""
        found = self._frame.get(key)
        return self._shared.get(key) if found is None else found

    def number(self, key: str) -> float | None:
        """Raises ReconstructionError for what is none."""
        value = self.get(key)
        where = self._place.at(f"{self._place.element}, {key}")
        return None if value is None else _number(value, where)

    def other_model(self) -> str:
        """Why Brown's model does not cover it, or ""."""
        for key in FISHEYE:
            if self.get(key):
                return f"{key} is no pinhole with a lens"
        name = self.get("camera_model") or ""
        if not isinstance(name, str) or name.upper() not in MODELS:
            return f"its camera_model {shortened(str(name)[:100])} is no pinhole with a lens"
        return ""

    def intrinsics(self, pictures: Pictures, names: tuple[str, str]) -> Intrinsics:
        """Raises ReconstructionError."""
        width, height = self._side("w"), self._side("h")
        if width is None or height is None:
            width, height = pictures.size(names, self._place)
        values = {key: self.number(key) or 0.0 for key in LENS}
        across = self._focal("fl_x", "camera_angle_x", width)
        down = self._focal("fl_y", "camera_angle_y", height)
        if across is None:
            across = down
        if across is None:
            cause = "it has neither fl_x nor camera_angle_x"
            raise self._place.error(cause, "write the focal length into the file")
        values["fx"] = across
        values["fy"] = across if down is None else down
        for key in ("cx", "cy"):
            value = self.number(key)
            if value is not None:
                values[key] = value
        return opencv_intrinsics((width, height), values, self._place)

    def _side(self, key: str) -> int | None:
        value = self.number(key)
        if value is None:
            return None
        if value != math.floor(value):
            raise self._place.error(f"{key} = {value:g} is no whole number of pixels")
        return int(value)

    def _focal(self, key: str, angle_key: str, side: int) -> float | None:
        focal = self.number(key)
        if focal is not None:
            return focal
        angle = self.number(angle_key)
        if angle is None:
            return None
        if not 1e-4 < angle < math.pi - 1e-4:
            raise self._place.error(f"{angle_key} = {angle:g} is no angle of view in radians")
        return side / (2 * math.tan(angle / 2))
