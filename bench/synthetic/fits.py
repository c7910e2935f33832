# SPDX-License-Identifier: GPL-3.0-or-later
"""A case as a native scene and as a native fit."""

from __future__ import annotations

from typing import Any

import numpy as np

from selenite import native, parameters

from . import scenes
from .cases import Case


def scene_of(case: Case) -> Any:  # noqa: ANN401
    """Native scene at the start of the fit."""
    values = {n: list(v) if len(v) > 1 else v[0] for n, v in case.start.items()} | case.fixed
    return scenes.make(case.mesh, case.lighting, values, case.cameras)


def bounds_of(case: Case) -> dict[str, tuple[float, float]]:
    """Parameter -> box constraint of every component: those of the product."""
    table = parameters.table()
    rows = {name: table["material", name] for name in case.start}
    return {name: (row.fit_lower, row.fit_upper) for name, row in rows.items()}


def job_of(case: Case, scene: Any, pictures: np.ndarray, settings: dict[str, Any]) -> Any:  # noqa: ANN401
    """A native Fit, not started. pictures: (cameras, h, w, 3); settings: of the native fit."""
    unknowns = [
        {
            "owner": scenes.OWNER,
            "parameter": name,
            "start": list(case.start[name]),
            "minimum": low,
            "maximum": high,
        }
        for name, (low, high) in bounds_of(case).items()
    ]
    captures = [
        {"camera": camera, "reference": picture}
        for camera, picture in zip(scene.cameras, pictures, strict=True)
    ]
    return native.core().Fit(scene, captures, unknowns, settings)


def answer_of(values: dict[str, Any]) -> dict[str, Any]:
    """What a native result calls `Body:name`, by parameter name."""
    return {name.partition(":")[2]: value for name, value in values.items()}
