# SPDX-License-Identifier: GPL-3.0-or-later
"""A case as a native scene and as a native fit."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np

from selenite import native, parameters

from . import scenes
from .cases import GRID_START, IMAGE_START, Case

if TYPE_CHECKING:
    from selenite._core import Fit, FitResult

#: Samples a pixel of the derivatives that say how much of a texel the photos show.
_TEXEL_SPP = 64


def scene_of(case: Case) -> Any:  # noqa: ANN401
    """Native scene at the start of the fit."""
    values = {n: list(v) if len(v) > 1 else v[0] for n, v in case.start.items()} | case.fixed
    grid = None if case.albedo_grid is None else np.full_like(case.albedo_grid, GRID_START)
    image = None if case.image is None else np.full_like(case.image, IMAGE_START)
    return scenes.make(case.mesh, case.lighting, values, case.cameras, grid, image)


def at_target(case: Case, scene: Any) -> Any:  # noqa: ANN401
    """The scene with the true values."""
    true = scene.with_values({(scenes.OWNER, name): v for name, v in case.target.items()})
    if case.albedo_grid is not None:
        true = true.with_grid(scenes.OWNER, "albedo", case.albedo_grid)
    if case.image is not None:
        true = true.with_image(scenes.OWNER, case.image)
    return true


def texel_weights(case: Case, scene: Any, size: int, threads: int = 1) -> np.ndarray | None:  # noqa: ANN401
    """How much the photos show of every number of the image, (h, w, 3), 0 where none sees it: the
    derivative of their mean, at the target, with few samples. None for a case without an image.

    scene: native, at any values. size: pixels of the square photos.
    """
    if case.image is None:
        return None
    true = at_target(case, scene)
    weights = np.zeros(case.image.shape)
    evaluator = native.core().Evaluator(true, threads=threads)
    for seed, camera in enumerate(true.cameras):
        photo = native.core().Photo(camera, size=(size, size))
        weights += evaluator.gradient(
            photo, scenes.OWNER, "base_color_texture", _TEXEL_SPP, seed=seed
        )[1]
    return np.abs(weights)


def bounds_of(case: Case) -> dict[str, tuple[float, float]]:
    """Parameter -> box constraint of every component: those of the product."""
    table = parameters.table()
    rows = {name: table["material", name] for name in case.start}
    return {name: (row.fit_lower, row.fit_upper) for name, row in rows.items()}


def job_of(case: Case, scene: Any, pictures: np.ndarray, settings: dict[str, Any]) -> Any:  # noqa: ANN401
    """A native Fit, not started. pictures: (cameras, h, w, 3); settings: of the native fit."""
    core = native.core()
    unknowns = [
        core.Unknown(scenes.OWNER, name, low, high, list(case.start[name]))
        for name, (low, high) in bounds_of(case).items()
    ]
    # Grids and images start as the scene has them.
    if case.albedo_grid is not None:
        unknowns.append(core.Unknown(scenes.OWNER, "albedo_grid", 0.0, 1.0))
    if case.image is not None:
        unknowns.append(core.Unknown(scenes.OWNER, "base_color_texture", 0.0, 1.0))
    captures = [
        core.Photo(camera, picture) for camera, picture in zip(scene.cameras, pictures, strict=True)
    ]
    return core.Fit(scene, captures, unknowns, settings)


def ended(job: Fit, name: str) -> tuple[FitResult, float]:
    """Result and CPU seconds of a native Fit. Raises RuntimeError with its name and what stopped
    it."""
    begin = time.process_time()
    job.start()
    job.join()
    cpu = time.process_time() - begin
    result = job.result()
    if result.problems:
        raise RuntimeError(f"{name}: {'; '.join(item.cause for item in result.problems)}")
    return result, cpu


def answer_of(values: dict[str, Any]) -> dict[str, Any]:
    """What a native result calls `Body:name`, by parameter name."""
    return {name.partition(":")[2]: value for name, value in values.items()}
