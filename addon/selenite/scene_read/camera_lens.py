# SPDX-License-Identifier: GPL-3.0-or-later
"""The lens of an imported camera, which it keeps as a custom property: a photo may come later."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any

import bpy
import numpy as np

from .lens import CameraLens, LensDistortion

#: Of the camera's data: size and lens by the names of LensDistortion.
_KEY = "selenite_lens"
_SIZE = ("width", "height")
_NAMES = tuple(item.name for item in fields(LensDistortion))


def keep_lens(data: bpy.types.Camera, found: CameraLens) -> None:
    """Writes it into the camera's data."""
    data[_KEY] = {**dict(zip(_SIZE, found.size, strict=True)), **asdict(found.lens)}


def lens_of(data: bpy.types.ID) -> CameraLens | None:
    """What the camera keeps; None for one that was not imported, and for numbers that are no lens,
    which only another program can have left there."""
    kept: Any = data.get(_KEY)
    if kept is None or not hasattr(kept, "to_dict"):
        return None
    values: Mapping[str, Any] = kept.to_dict()
    names = (*_SIZE, *_NAMES)
    if not all(isinstance(values.get(name, 0.0), (int, float)) for name in names):
        return None
    numbers = {name: float(values.get(name, 0.0)) for name in names}
    width, height = (round(numbers[name]) for name in _SIZE)
    sides = (width, height, numbers["fx"], numbers["fy"])
    if not (min(sides) > 0 and np.isfinite(list(numbers.values())).all()):
        return None
    return CameraLens((width, height), LensDistortion(**{name: numbers[name] for name in _NAMES}))
