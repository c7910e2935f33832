# SPDX-License-Identifier: GPL-3.0-or-later
"""What a fit compares with a photo: its camera, under its lights, times its gain."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .captures import Capture
from .light_states import is_as_in_scene

Gain = tuple[float, float, float]


def under_its_lights(scene: Any, capture: Capture) -> Any:  # noqa: ANN401 - a native Scene
    """The native scene as the photo saw it; geometry is shared."""
    return under_lights(scene, capture.lights)


def under_lights(scene: Any, lights: Mapping[str, Any]) -> Any:  # noqa: ANN401 - a native Scene
    """The native scene in a light state."""
    return scene if is_as_in_scene(lights) else scene.with_lights(lights)


def gain_of(capture: Capture, result: Mapping[str, Any] | None = None) -> Gain:
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


def gains_of(captures: Sequence[Capture], result: Mapping[str, Any] | None) -> dict[str, Gain]:
    """`gain_of` each photo, by its id."""
    return {item.id: gain_of(item, result) for item in captures}


def shown(film_image: np.ndarray, gain: Gain) -> np.ndarray:
    """A rendered picture as the photo shows it."""
    if gain == (1.0, 1.0, 1.0):
        return film_image
    return np.asarray(film_image, np.float32) * np.asarray(gain, np.float32)
