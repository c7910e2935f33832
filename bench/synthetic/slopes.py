# SPDX-License-Identifier: GPL-3.0-or-later
"""Derivatives of the render by one parameter in several ways, and how much noise each has.

Everything is by the coordinate that the optimiser steps in (x, log x or log(x - 1)) and for all
components of a colour together, so that estimators of one parameter compare. Pixels have random
numbers of their own: a variance is summed over pixels and estimated pixel by pixel over seeds,
which is far more exact than the spread of one sum over seeds.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from selenite import native, parameters

from .scenes import OWNER

#: h, the unit of the distances, by scale. Gradients by IOR are central 3h/2.
STEPS = {"log": 0.3, "roughness": 0.3, "log_excess": 0.7 / 3, "linear": 0.06, "reflectance": 0.06}


@dataclass(frozen=True)
class Pair:
    """Two pictures with equal seeds at u - below * step and u + above * step."""

    name: str
    below: float
    above: float

    @property
    def offsets(self) -> tuple[float, ...]:
        """Where a picture other than the base is needed."""
        return tuple(o for o in (-self.below, self.above) if o)


PAIRS = (
    Pair("one-sided h", 0, 1),
    Pair("central 3h/2", 1.5, 1.5),
    Pair("central h", 1, 1),
    Pair("central h/2", 0.5, 0.5),
    Pair("central h/4", 0.25, 0.25),
)
DETACHED = "detached"


class Scale:
    """u = log(x - shift), or x (of an albedo too: its differences are short)."""

    def __init__(self, name: str) -> None:
        kind = parameters.table()["material", name].scale
        self.step = STEPS[kind]
        self.shift = {"log": 0.0, "roughness": 0.0, "log_excess": 1.0}.get(kind)

    def moved(self, value: Any, by: float) -> Any:  # noqa: ANN401
        """The value (or list of components) after `by` in u."""
        x = np.asarray(value, float)
        moved = x + by if self.shift is None else (x - self.shift) * math.exp(by) + self.shift
        return moved.tolist()

    def slope(self, value: Any) -> np.ndarray:  # noqa: ANN401
        """dx/du of each component."""
        x = np.atleast_1d(np.asarray(value, float))
        return np.ones_like(x) if self.shift is None else x - self.shift


@dataclass
class Shot:
    """One render: what estimators need of it, and its CPU seconds."""

    mean: np.ndarray
    half_a: np.ndarray
    variance: np.ndarray
    cpu: float
    film: Any


class Camera:
    """Renders the first camera of a scene with one thread and counts CPU seconds."""

    def __init__(self, scene: Any, size: int, spp: int) -> None:  # noqa: ANN401
        self._scene, self._size, self._spp = scene, size, spp

    def shoot(
        self, values: dict[str, Any], seed: int, slots: tuple[str, ...] = (), spp: int = 0
    ) -> Shot:
        """The scene with the given values of the body; `slots`: parameters to differentiate."""
        at = {(OWNER, n): tuple(np.atleast_1d(v).tolist()) for n, v in values.items()}
        scene = self._scene.with_values(at)
        wanted = [(OWNER, name) for name in slots]
        begin = time.process_time()
        film = native.core().render(
            scene, scene.cameras[0], self._size, self._size, spp or self._spp,
            seed=seed, threads=1, parameters=wanted,
        )  # fmt: skip
        cpu = time.process_time() - begin
        if film.dropped:
            raise RuntimeError(f"{film.dropped} samples dropped: {film.first_dropped}")
        pictures = (film.image, film.half_a, film.standard_error)
        mean, half_a, error = (np.asarray(p, np.float64) for p in pictures)
        return Shot(mean, half_a, error**2, cpu, film)


@dataclass
class Spread:
    """A sum over pixels, seed by seed: its mean, its variance, and how exact that is."""

    mean: float
    variance: float
    #: Relative standard error of the standard deviation; large where few pixels make the noise.
    doubt: float

    @staticmethod
    def of(parts: list[np.ndarray]) -> Spread:
        """`parts`: one array per seed, its entries independent."""
        stack = np.stack([np.ravel(part) for part in parts])
        deviation = stack - stack.mean(axis=0)
        squares = deviation**2
        total = squares.sum() / (len(parts) - 1)
        if not total > 0:
            return Spread(float(stack.sum(axis=1).mean()), 0.0, 0.0)
        doubt = 0.5 * math.sqrt((squares**2).sum()) / squares.sum()
        return Spread(float(stack.sum(axis=1).mean()), float(total), doubt)


class Gathered:
    """What one estimator of one parameter gave, seed after seed."""

    def __init__(self) -> None:
        self.slopes: list[np.ndarray] = []
        self.gradients: list[np.ndarray] = []

    def add(self, slope: np.ndarray, covariance: np.ndarray, base: Shot, photo: np.ndarray) -> None:
        """`slope`: (h, w, 3); `covariance`: unbiased, of it with the picture, both means."""
        self.slopes.append(slope)
        # The dual-buffer loss, mean (I - photo)^2 without the bias of noise.
        pixels = 2 * ((base.mean - photo) * slope - covariance)
        self.gradients.append(pixels.sum(axis=2) / slope.size)

    def mean_picture(self) -> Spread:
        """Of d(mean of the picture)/du."""
        return Spread.of([slope.sum(axis=2) / slope.size for slope in self.slopes])

    def gradient(self) -> Spread:
        """Of d(loss)/du."""
        return Spread.of(self.gradients)

    def power(self) -> float:
        """Variance of the derivative picture, summed over pixels and channels."""
        return float(np.stack(self.slopes).var(axis=0, ddof=1).sum())


def half_covariance(base: Shot, slope: np.ndarray, slope_a: np.ndarray) -> np.ndarray:
    """Covariance of two means over an even number of samples, from their independent halves: as
    `render_derivatives` does it, because samples of two renders are not multiplied one by one."""
    return (base.half_a - base.mean) * (slope_a - slope)


def detached_of(base: Shot, name: str, slope: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Derivative picture and its covariance with the picture, from a render with slots."""
    rows = [i for i, (_, other, _) in enumerate(base.film.unknowns) if other == name]
    scale = slope[:, None, None, None]
    jacobian = np.asarray(base.film.jacobian, np.float64)[rows]
    covariance = np.asarray(base.film.covariance, np.float64)[rows]
    return (jacobian * scale).sum(axis=0), (covariance * scale).sum(axis=0)
