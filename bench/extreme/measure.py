# SPDX-License-Identifier: GPL-3.0-or-later
"""Means of pictures with their noise, and carried derivatives against differences of pictures.

The differences are one-sided, from the place itself inwards, and the pictures have equal seeds:
(-3 I(0) + 4 I(d) - I(2d)) / 2d has an error of d^2. Pixels have random numbers of their own, so a
variance is estimated pixel by pixel over seeds and summed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from synthetic.scenes import OWNER

from selenite import native

#: Distances of a difference, in units of the row's own: shorter and shorter.
DISTANCES = (1.0, 0.5, 0.25)
_WEIGHTS = {0: -1.5, 1: 2.0, 2: -0.5}
#: A gap of so many standard errors fails: 1 false alarm in 16 000.
SIGMAS = 4.0
#: A noise above this share of the difference says nothing about the derivative.
RESOLVED = 0.25
#: Below this share no more seeds are taken.
WELL_RESOLVED = 0.1
#: Over one distance such a share of the picture's mean counts as no change.
NOTHING = 1e-4
#: Of sums in 32 bits: share of a mean picture, and of a derivative.
ROUNDING, SLOPE_ROUNDING = 1e-6, 2e-4
#: Differences that grow by more than this at every halving have no limit.
GROWTH = 1.1


@dataclass(frozen=True)
class Settings:
    """Square pictures of `size` pixels, `spp` samples a pixel, up to `seeds` seeds."""

    size: int = 8
    spp: int = 256
    seeds: int = 16
    #: Seeds that every row has.
    first: int = 4


@dataclass(frozen=True)
class Mean:
    """Mean radiance of a picture and its standard error; `whole`: nothing dropped, all finite."""

    value: float
    error: float
    whole: bool
    truncated: int


def render(
    scene: Any, settings: Settings, seed: int, names: tuple[tuple[str, str], ...] = ()
) -> Any:  # noqa: ANN401
    size = settings.size
    return native.core().render(
        scene, scene.cameras[0], size, size, settings.spp, seed=seed, threads=1,
        parameters=list(names),
    )  # fmt: skip


def grey(picture: Any) -> np.ndarray:  # noqa: ANN401
    """Mean of the channels, (h, w) float64."""
    return np.asarray(picture, np.float64).mean(axis=-1)


def mean_of(scene: Any, settings: Settings, seed: int = 1) -> Mean:  # noqa: ANN401
    """Channels see the same numbers, so their errors are averaged, not added in squares."""
    film = render(scene, settings, seed)
    error = np.sqrt((grey(film.standard_error) ** 2).sum()) / settings.size**2
    finite = np.isfinite(film.image).all() and np.isfinite(film.standard_error).all()
    return Mean(
        float(grey(film.image).mean()), float(error), finite and not film.dropped, film.truncated
    )


@dataclass(frozen=True)
class Slope:
    """d(mean of the picture)/d(parameter): carried, and by differences of shorter distances.

    `errors`: of the gap between the two, which is less than that of either, the seeds being
    equal. `noise`: of the carried derivative alone.
    """

    carried: float
    noise: float
    differences: tuple[float, ...]
    errors: tuple[float, ...]
    step: float
    level: float
    seeds: int
    whole: bool

    @property
    def used(self) -> int:
        """Of `DISTANCES`: the shortest at which noise leaves something to compare, else the
        quietest."""
        clear = [
            i for i in range(len(DISTANCES))
            if self.errors[i] <= RESOLVED * abs(self.differences[i])
        ]  # fmt: skip
        return max(clear, default=int(np.argmin(self.errors)))

    @property
    def difference(self) -> float:
        """At the distance `used`, as are `error`, `z` and `ratio`."""
        return self.differences[self.used]

    @property
    def error(self) -> float:
        """Of the gap, with the rounding of sums in 32 bits."""
        rounding = ROUNDING * self.level / (self.step * DISTANCES[self.used])
        rounding += SLOPE_ROUNDING * abs(self.carried)
        return float(np.hypot(self.errors[self.used], max(rounding, 1e-300)))

    @property
    def z(self) -> float:
        return (self.carried - self.difference) / self.error

    @property
    def ratio(self) -> float:
        """NaN where both are nothing."""
        if self.difference:
            return self.carried / self.difference
        return float("inf") if self.carried else float("nan")

    @property
    def verdict(self) -> str:
        """agrees, zero (both are), no limit (differences grow at every halving), noisy or dead."""
        sizes = np.abs(self.differences)
        nothing = NOTHING * self.level / self.step
        if max(abs(self.carried), abs(self.difference)) + 2 * self.error < nothing:
            return "zero"
        if abs(self.z) > SIGMAS:
            growing = (sizes[1:] > GROWTH * sizes[:-1]).all() and abs(self.carried) > sizes[-1]
            return "no limit" if growing else "dead"
        return "agrees" if self.error <= RESOLVED * abs(self.difference) else "noisy"


def _changed(scene: Any, name: str, value: np.ndarray) -> Any:  # noqa: ANN401
    return scene.with_values({(OWNER, name): tuple(value.tolist())})


def slope_of(scene: Any, name: str, at: float, step: float, settings: Settings) -> Slope:  # noqa: ANN401
    """Of all components of a colour together. `step`: the longest distance, negative for downwards.

    Seeds are doubled until the gap's noise is a tenth of the difference, or `settings.seeds`.
    """
    width = len(scene.get(OWNER, name))
    here = _changed(scene, name, np.full(width, at))
    offsets = sorted({d * k for d in DISTANCES for k in (1, 2)})
    others = {o: _changed(scene, name, np.full(width, at + o * step)) for o in offsets}
    carried, gaps, differences, levels, whole = [], [], [], [], True
    seeds = settings.first
    while True:
        for seed in range(100 + len(carried), 100 + seeds):
            film = render(here, settings, seed, ((OWNER, name),))
            jacobian = np.asarray(film.jacobian, np.float64)
            whole &= film.dropped == 0 and bool(np.isfinite(jacobian).all())
            pictures = {0.0: grey(film.image)}
            pictures |= {o: grey(render(s, settings, seed).image) for o, s in others.items()}
            slope = grey(jacobian.sum(axis=0))
            found = np.stack([
                sum(w * pictures[k * d] for k, w in _WEIGHTS.items()) / (d * step)
                for d in DISTANCES
            ])  # fmt: skip
            carried.append(slope)
            gaps.append(slope - found)
            differences.append(found)
            levels.append(pictures[0.0])
        result = _summary(carried, gaps, differences, levels, abs(step), whole)
        resolved = result.errors[-1] < WELL_RESOLVED * abs(result.differences[-1])
        if resolved or seeds >= settings.seeds or result.verdict == "zero":
            return result
        seeds = min(2 * seeds, settings.seeds)


def _error(stack: np.ndarray) -> np.ndarray:
    """Standard error of the mean over seeds and pixels; seeds first, pixels last."""
    variance = stack.var(axis=0, ddof=1).sum(axis=(-2, -1)) / len(stack)
    return np.sqrt(variance) / (stack.shape[-1] * stack.shape[-2])


def _summary(
    carried: list, gaps: list, differences: list, levels: list, step: float, whole: bool
) -> Slope:
    slopes, between, found = np.stack(carried), np.stack(gaps), np.stack(differences)
    return Slope(
        carried=float(slopes.mean()),
        noise=float(_error(slopes)),
        differences=tuple(found.mean(axis=(0, 2, 3)).tolist()),
        errors=tuple(_error(between).tolist()),
        step=step,
        level=float(np.mean(levels)),
        seeds=len(carried),
        whole=whole,
    )
