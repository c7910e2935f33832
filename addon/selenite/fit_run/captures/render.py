# SPDX-License-Identifier: GPL-3.0-or-later
"""What a fit compares with a photo: its camera as aligned, under its lights, times its gain."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ... import native
from .light_states import is_as_in_scene
from .prepared import Capture

Gain = tuple[float, float, float]
#: Of a camera, in pixels of its picture to the right and down, and in radians about its axis.
Alignment = tuple[float, float, float]
UNALIGNED: Alignment = (0.0, 0.0, 0.0)


def under_its_lights(scene: Any, capture: Capture) -> Any:  # noqa: ANN401 - a native Scene
    """The native scene as the photo saw it; geometry is shared."""
    return under_lights(scene, capture.lights)


def under_lights(scene: Any, lights: Mapping[str, Any]) -> Any:  # noqa: ANN401 - a native Scene
    """The native scene in a light state."""
    return scene if is_as_in_scene(lights) else scene.with_lights(lights)


def as_found(capture: Capture, result: Mapping[str, Any] | None) -> Capture:
    """The capture with what a fit has found of it (`result`: its own or result.json), so that
    `shown` shows its photo as the fit does. Raises ValueError as `gain_of`."""
    return replace(capture, gain=gain_of(capture, result))


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


def alignment_of(capture: Capture, result: Mapping[str, Any] | None) -> Alignment:
    """What a fit has found, by its native result, for a picture of the reference's size. After
    stages it is of the last one's pictures, which may have another height."""
    shift = ((result or {}).get("captures", {}).get(capture.id) or {}).get("shift")
    if shift is None:
        return UNALIGNED
    across, down, roll = (float(x) for x in shift)
    height = capture.reference.shape[0]
    stages = (result or {}).get("stages") or ({"height": height},)
    scale = height / min(int(stages[-1]["height"]), capture.photo_size[1])
    return (across * scale, down * scale, roll)


def alignment_in_file(capture: Capture, report: Mapping[str, Any] | None) -> Alignment:
    """The same by result.json, where a shift is in pixels of the photo and degrees. Raises
    ValueError where it holds something else than three numbers."""
    rows = (report or {}).get("captures") or {}
    row = rows.get(capture.id) if isinstance(rows, Mapping) else None
    shift = row.get("shift") if isinstance(row, Mapping) else None
    if shift is None:
        return UNALIGNED
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


def render_capture(
    scene: Any,  # noqa: ANN401 - a native Scene
    capture: Capture,
    spp: int,
    *,
    seed: int = 0,
    depth: int = 0,
    threads: int = 0,
    alignment: Alignment = UNALIGNED,
    progress: Any = None,  # noqa: ANN401 - a native ProgressToken
) -> np.ndarray:
    """What the photo would show of a scene, (h, w, 3) float32, in the reference's pixels."""
    height, width = capture.reference.shape[:2]
    film = native.core().render(
        under_its_lights(scene, capture),
        capture.camera,
        width,
        height,
        spp,
        seed=seed,
        depth=depth,
        threads=threads,
        frame=capture.frame,
        alignment=alignment,
        progress=progress,
    )
    return shown(film.image, capture)


def gains_of(captures: Sequence[Capture], result: Mapping[str, Any] | None) -> dict[str, Gain]:
    """`gain_of` each photo, by its id."""
    return {item.id: gain_of(item, result) for item in captures}


def alignments_of(
    captures: Sequence[Capture], result: Mapping[str, Any] | None
) -> dict[str, Alignment]:
    """`alignment_of` each photo that has one, by its id."""
    found = {item.id: alignment_of(item, result) for item in captures}
    return {name: one for name, one in found.items() if one != UNALIGNED}


def shown(picture: np.ndarray, capture: Capture) -> np.ndarray:
    """A rendered picture as the photo shows it, in numbers of its kind: with `shown_noise` and
    `rendered` all that is known of how."""
    if capture.gain == (1.0, 1.0, 1.0):
        return picture
    return picture * np.asarray(capture.gain, picture.dtype)


def shown_noise(deviation: np.ndarray, capture: Capture) -> np.ndarray:
    """Standard deviations of a rendered picture, as the photo shows it."""
    return shown(deviation, capture)


def rendered(picture: np.ndarray, capture: Capture) -> np.ndarray:
    """(h, w, 3) float32: the render that the photo would show as `picture`."""
    return np.ascontiguousarray(picture / np.asarray(capture.gain), np.float32)
