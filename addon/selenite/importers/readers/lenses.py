# SPDX-License-Identifier: GPL-3.0-or-later
"""Intrinsics from parameters by name, and what of a calibration they leave out.

OpenCV has the tangential coefficients in another order: it moves x by 2 p1 x y + p2 (r² + 2 x²);
Metashape, and `LensDistortion`, by p1 (r² + 2 x²) + 2 p2 x y. Source: OpenCV, calib3d, "Detailed
Description"; Metashape User Manual, "Camera models".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields

from ...scene_read.capture_request import LensDistortion
from ..reconstruction import Intrinsics
from . import numbers
from .files import Place

#: Pixels of focal length and of the place of the principal point.
LEAST_FOCAL, LARGEST = 1e-3, 1e9
#: Pixels: what is left out below that is not worth a remark.
LEAST_REMARK = 0.01


def intrinsics(size: tuple[int, int], values: Mapping[str, float], place: Place) -> Intrinsics:
    """Of fx, fy (fx), cx, cy (the middle), k1 to k3, p1 and p2; other values do not count. Raises
    ReconstructionError for what is no camera."""
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


def left_out(values: Mapping[str, float], used: Intrinsics) -> list[str]:
    """A remark on each of b2 (skew, in pixels), k4, p3 and p4 that is not in `used`, with what it
    moves at the corner that is farthest from the principal point."""
    lens = used.lens
    x = max(lens.cx, used.width - lens.cx) / lens.fx
    y = max(lens.cy, used.height - lens.cy) / lens.fy
    r2 = x * x + y * y
    tangential = 3 * r2 * max(abs(lens.p1), abs(lens.p2)) * lens.fy
    moved = {
        "b2": y,
        "k4": r2**4 * r2**0.5 * lens.fy,
        "p3": tangential * r2,
        "p4": tangential * r2 * r2,
    }
    found = []
    for name, by_one in moved.items():
        pixels = abs(values.get(name, 0.0)) * by_one
        if pixels >= LEAST_REMARK:
            found.append(
                f"{name} = {values[name]:g} is left out: {pixels:.2g} pixels at the corner"
            )
    return found
