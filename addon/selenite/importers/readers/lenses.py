# SPDX-License-Identifier: GPL-3.0-or-later
"""Intrinsics from parameters by name.

OpenCV has the tangential coefficients in another order: it moves x by 2 p1 x y + p2 (r² + 2 x²);
Metashape, and `LensDistortion`, by p1 (r² + 2 x²) + 2 p2 x y. Source: OpenCV, calib3d, "Detailed
Description"; Metashape User Manual, "Camera models".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields

from ...scene_read.lens import LensDistortion
from ..reconstruction import Intrinsics
from . import numbers
from .files import Place

#: Pixels of focal length and of the place of the principal point.
LEAST_FOCAL, LARGEST = 1e-3, 1e9


def intrinsics(size: tuple[int, int], values: Mapping[str, float], place: Place) -> Intrinsics:
    """Of fx, fy (fx), cx, cy (the middle), k1 to k4, p1 to p4 and b2; other values do not count.
    Raises ReconstructionError for what is no camera."""
    width, height = (numbers.pixels(side, place) for side in size)
    usual = {"fy": values["fx"], "cx": width / 2, "cy": height / 2}
    own = {item.name: values[item.name] for item in fields(LensDistortion) if item.name in values}
    lens = LensDistortion(**(usual | own))
    _check(lens, place)
    return Intrinsics(width, height, lens)


def opencv_intrinsics(
    size: tuple[int, int], values: Mapping[str, float], place: Place
) -> Intrinsics:
    """The same of p1 and p2 in OpenCV's order."""
    turned = {"p1": values.get("p2", 0.0), "p2": values.get("p1", 0.0)}
    return intrinsics(size, {**values, **turned}, place)


def _check(lens: LensDistortion, place: Place) -> None:
    """Raises ReconstructionError for a focal length or principal point that no camera has."""
    for name, value in (("fx", lens.fx), ("fy", lens.fy)):
        if not LEAST_FOCAL <= value <= LARGEST:
            raise place.error(
                f"{name} is {value:g} pixels; it can be between {LEAST_FOCAL:g} and {LARGEST:g}"
            )
    for name, value in (("cx", lens.cx), ("cy", lens.cy)):
        if not abs(value) <= LARGEST:
            raise place.error(f"{name} is {value:g} pixels; it can be up to {LARGEST:g}")
