# SPDX-License-Identifier: GPL-3.0-or-later
"""A Color Ramp as a sum over its stops: the share of each at every place, so that a fit can change
their colours."""

from __future__ import annotations

import bpy
import numpy as np

#: Stops of a longer ramp are no parameters: each of them costs a lookup at every hit.
MOST_STOPS = 8
_ALIKE = 1e-4
#: Of Blender's cardinal spline.
_TENSION = 0.71


def shares(ramp: bpy.types.ColorRamp, places: np.ndarray) -> np.ndarray | None:
    """(places, stops): what each stop's colour is multiplied by. None where the ramp is no such sum
    (HSV and HSL, colours that a spline cuts off) or has more than `MOST_STOPS`."""
    stops = ramp.elements
    if ramp.color_mode != "RGB" or len(stops) > MOST_STOPS:
        return None
    places = places.astype(np.float32).astype(np.float64)  # as Blender compares them
    # A stop at either end, of the colour next to it.
    ends = np.array([0.0, *(item.position for item in stops), 1.0])
    last = len(stops) - 1
    owners = np.array([0, *range(last + 1), last])
    left = np.clip(np.searchsorted(ends, places, side="right") - 1, 0, last + 1)
    length = ends[left + 1] - ends[left]
    t = np.where(length > 0, (places - ends[left]) / np.where(length > 0, length, 1), 0.0)
    found = np.zeros((len(places), last + 1))
    rows = np.arange(len(places))
    for step, weight in zip(range(-1, 3), _weights(ramp.interpolation, t), strict=True):
        at = owners[np.clip(left + step, 0, last + 2)]
        np.add.at(found, (rows, at), weight)
    colors = np.array([item.color[:3] for item in stops])
    true = np.array([ramp.evaluate(float(x))[:3] for x in places])
    size = max(1.0, float(np.abs(colors).max()))
    return found if float(np.abs(found @ colors - true).max()) <= _ALIKE * size else None


def _weights(interpolation: str, t: np.ndarray) -> tuple[np.ndarray, ...]:
    """Of the stop before the left one, of both, and of the one after, `t` of the way."""
    none = np.zeros_like(t)
    if interpolation == "CONSTANT":
        return none, none + 1, none, none
    if interpolation == "B_SPLINE":
        before, after = (1 - t) ** 3 / 6, t**3 / 6
        left, right = t**3 / 2 - t**2 + 2 / 3, (1 - t) ** 3 / 2 - (1 - t) ** 2 + 2 / 3
        return before, left, right, after
    if interpolation == "CARDINAL":
        # The slope at a stop goes by both of its neighbours.
        before, after = -_TENSION * t * (1 - t) ** 2, -_TENSION * (1 - t) * t**2
        ease = t**2 * (3 - 2 * t)
        return before, 1 - ease - after, ease - before, after
    if interpolation == "EASE":
        t = t**2 * (3 - 2 * t)
    return none, 1 - t, t, none
