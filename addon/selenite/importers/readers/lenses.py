# SPDX-License-Identifier: GPL-3.0-or-later
"""Intrinsics from parameters of OpenCV's kind, whose tangential coefficients are in another order.

OpenCV moves x by 2 p1 x y + p2 (r² + 2 x²); Metashape, and `Intrinsics`, by p1 (r² + 2 x²) +
2 p2 x y. Source: OpenCV, calib3d, "Detailed Description"; Metashape User Manual, "Camera models".
"""

from __future__ import annotations

from collections.abc import Mapping

from ..reconstruction import Intrinsics
from . import numbers
from .files import Place

#: Pixels of focal length and of the place of the principal point.
LEAST_FOCAL, LARGEST = 1e-3, 1e9


def opencv_intrinsics(
    size: tuple[int, int], values: Mapping[str, float], place: Place
) -> Intrinsics:
    """Of fx, fy (fx), cx, cy (the middle), k1 to k3, p1 and p2 in OpenCV's order. Raises
    ReconstructionError for what is no camera."""
    width, height = (numbers.pixels(side, place) for side in size)
    across = values["fx"]
    found = Intrinsics(
        width, height,
        fx=across, fy=values.get("fy", across),
        cx=values.get("cx", width / 2), cy=values.get("cy", height / 2),
        k1=values.get("k1", 0.0), k2=values.get("k2", 0.0), k3=values.get("k3", 0.0),
        p1=values.get("p2", 0.0), p2=values.get("p1", 0.0),
    )  # fmt: skip
    check(found, place)
    return found


def check(lens: Intrinsics, place: Place) -> None:
    """Raises ReconstructionError for a focal length or principal point that no camera has."""
    for name, value in (("fx", lens.fx), ("fy", lens.fy)):
        if not LEAST_FOCAL <= value <= LARGEST:
            raise place.error(
                f"{name} is {value:g} pixels; it can be between {LEAST_FOCAL:g} and {LARGEST:g}"
            )
    for name, value in (("cx", lens.cx), ("cy", lens.cy)):
        if not abs(value) <= LARGEST:
            raise place.error(f"{name} is {value:g} pixels; it can be up to {LARGEST:g}")
