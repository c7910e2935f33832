# SPDX-License-Identifier: GPL-3.0-or-later
"""From a calibration in pixels to Blender's lens, and to what a capture says of its photo."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..scene_read.lens import LensDistortion
from .reconstruction import Intrinsics, ReconstructedCamera

#: Of the imported cameras, in millimetres: that of a 35 mm film, the usual one.
SENSOR = 36.0
#: Of the focal lengths: what differs less is one number that a file rounds in two ways.
_SQUARE = 1e-9


@dataclass(frozen=True)
class BlenderLens:
    """Of a camera with sensor fit Horizontal and a sensor as wide as SENSOR: focal length in mm,
    shifts in widths of the picture. pixel_aspect: width / height of a pixel."""

    lens: float
    shift_x: float
    shift_y: float
    pixel_aspect: float


def blender_lens(found: Intrinsics) -> BlenderLens:
    """The pinhole alone: Blender has no distortion. capture.window is the inverse."""
    lens = found.lens
    aspect = lens.fy / lens.fx
    if abs(aspect - 1) < _SQUARE:
        aspect = 1.0
    width = float(found.width)
    return BlenderLens(
        lens=lens.fx * SENSOR / width,
        shift_x=(width / 2 - lens.cx) / width,
        shift_y=(lens.cy - found.height / 2) / (width * aspect),
        pixel_aspect=aspect,
    )


def distortion_of(found: Intrinsics) -> LensDistortion | None:
    """What a capture says of the lens; None where it does not distort."""
    return found.lens if found.distorted else None


def intrinsics_of(camera: ReconstructedCamera, size: tuple[int, int]) -> Intrinsics:
    """The camera's own; of one that has a field of view alone a centred pinhole for a photo of
    `size`. X3D's field of view is the smaller of the two angles."""
    if camera.intrinsics is not None:
        return camera.intrinsics
    width, height = size
    focal = min(width, height) / 2 / math.tan(camera.field_of_view / 2)
    return Intrinsics(width, height, LensDistortion(focal, focal, width / 2, height / 2))
