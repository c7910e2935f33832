# SPDX-License-Identifier: GPL-3.0-or-later
"""What photos show of a scene, and what a fit has found of how they were taken."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import native
from ..capture.prepared import Alignment, Capture, Gain
from .settings import FitSettings

if TYPE_CHECKING:
    from .._core import Evaluator, Scene


def evaluator(scene: Scene, settings: FitSettings) -> Evaluator:
    """Of pictures and derivatives at a scene's values, as a fit with these settings makes them."""
    return native.core().Evaluator(scene, depth=settings.depth, threads=settings.threads)


def as_found(capture: Capture, result: Mapping[str, Any] | None) -> Capture:
    """The capture with the gain and alignment that a fit has found, by its native result."""
    return replace(capture, gain=gain_of(capture, result), alignment=alignment_of(capture, result))


def as_reported(capture: Capture, report: Mapping[str, object] | None) -> Capture:
    """The same by result.json. Raises ValueError where a file holds no such numbers."""
    return replace(
        capture, gain=gain_of(capture, report), alignment=alignment_in_file(capture, report)
    )


def like(capture: Capture, other: Capture | None) -> Capture:
    """The capture with gain and alignment of another one of its photo, maybe of another size."""
    if other is None:
        return capture
    factor = capture.reference.shape[0] / other.reference.shape[0]
    across, down, roll = other.alignment
    return replace(capture, gain=other.gain, alignment=(across * factor, down * factor, roll))


def gain_of(capture: Capture, result: Mapping[str, object] | None = None) -> Gain:
    """The photo's gain: what a fit has found (`result`: its own or result.json), else the capture's
    own. Raises ValueError where a file holds something else than positive numbers."""
    rows = (result or {}).get("captures") or {}
    row = rows.get(capture.id) if isinstance(rows, Mapping) else None
    found = row.get("gain") if isinstance(row, Mapping) else None
    if found is None:
        return capture.gain
    numbers = np.atleast_1d(np.asarray(found, np.float64)).tolist()
    numbers = numbers * 3 if len(numbers) == 1 else numbers
    if len(numbers) != 3 or not all(math.isfinite(x) and x > 0 for x in numbers):
        raise ValueError(f"the gain of photo '{capture.id}' is {found!r}, not one or three above 0")
    return (numbers[0], numbers[1], numbers[2])


def alignment_of(capture: Capture, result: Mapping[str, Any] | None) -> Alignment:
    """What a fit has found, by its native result, for a picture of the reference's size. After
    stages it is of the last one's pictures, which may have another height."""
    shift = ((result or {}).get("captures", {}).get(capture.id) or {}).get("shift")
    if shift is None:
        return capture.alignment
    across, down, roll = (float(x) for x in shift)
    height = capture.reference.shape[0]
    stages = (result or {}).get("stages") or ({"height": height},)
    scale = height / min(int(stages[-1]["height"]), capture.photo_size[1])
    return (across * scale, down * scale, roll)


def alignment_in_file(capture: Capture, report: Mapping[str, object] | None) -> Alignment:
    """The same by result.json, where a shift is in pixels of the photo and degrees. Raises
    ValueError where it holds something else than three numbers."""
    rows = (report or {}).get("captures") or {}
    row = rows.get(capture.id) if isinstance(rows, Mapping) else None
    shift = row.get("shift") if isinstance(row, Mapping) else None
    if shift is None:
        return capture.alignment
    numbers = np.asarray(shift, object).ravel().tolist()
    good = len(numbers) == 3 and all(
        isinstance(x, (int, float)) and math.isfinite(x) for x in numbers
    )
    if not good:
        raise ValueError(
            f"the shift of photo '{capture.id}' is {shift!r}, not two pixels and an angle"
        )
    (height, width), (columns, rows_of_photo) = capture.reference.shape[:2], capture.photo_size
    across, down, roll = numbers
    return (across * width / columns, down * height / rows_of_photo, math.radians(roll))


def shown(picture: np.ndarray, capture: Capture) -> np.ndarray:
    """A picture that Cycles has rendered, or its standard deviations, times the photo's gain."""
    return picture * np.asarray(capture.gain, picture.dtype)
