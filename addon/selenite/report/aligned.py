# SPDX-License-Identifier: GPL-3.0-or-later
"""Shifts of photos that are not to be believed: at the limit, or far beyond those of the others.

Where shading or silhouettes are wrong, a shift takes up what it can of that.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..capture.prepared import Capture
from ..fit.capture_render import alignment_of
from ..problems import listed

#: Pixels of the compared pictures: the native limit either way, and how near to it counts as there.
_LIMIT, _NEAR = 4.0, 0.05
#: Photos from which one is compared with the others; pixels, and deviations by their median, beyond
#: which it lies apart.
_FEWEST, _LEAST, _APART = 4, 1.0, 5.0
#: Standard deviation of a normal distribution over the median of its distances.
_OF_MEDIAN = 1.4826


def doubtful(captures: Sequence[Capture], result: Mapping[str, Any]) -> dict[str, str]:
    """Id of a photo -> why its shift is not believed: "limit" or "apart"."""
    moved = {item.id: _moves(item, alignment_of(item, result)) for item in captures if item.align}
    found = {name: "limit" for name, move in moved.items() if max(map(abs, move)) > _LIMIT - _NEAR}
    if len(moved) < _FEWEST:
        return found
    places = np.array([move[:2] for move in moved.values()])
    away = np.hypot(*(places - np.median(places, axis=0)).T)
    usual = _OF_MEDIAN * float(np.median(away))
    for name, distance in zip(moved, away, strict=True):
        if distance > max(_LEAST, _APART * usual):
            found.setdefault(name, "apart")
    return found


def sentences(doubts: Mapping[str, str]) -> list[str]:
    """No, one or two."""
    at_limit = [name for name, why in doubts.items() if why == "limit"]
    apart = [name for name, why in doubts.items() if why == "apart"]
    found = []
    cure = "do not rely on it: correct camera, light or model, or do not align the photo"
    if at_limit:
        found.append(
            f"Align ended at its limit of {_LIMIT:g} pixels for {listed(at_limit)}: such a shift "
            f"takes up what something else is wrong by; {cure}"
        )
    if apart:
        found.append(
            f"Align moves {listed(apart)} farther than the other photos: such a shift takes up "
            f"what something else is wrong by; {cure}"
        )
    return found


def _moves(capture: Capture, alignment: tuple[float, float, float]) -> tuple[float, float, float]:
    """Pixels of its picture: across, down, and by the roll at the farthest corner."""
    rows, columns = capture.weight.shape
    across, down, roll = alignment
    return across, down, roll * math.hypot(rows, columns) / 2
