# SPDX-License-Identifier: GPL-3.0-or-later
"""What is compared: settings, starts away from the truth, and the error of what is found."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...fit.settings import PRESETS, FitSettings
from ...fit.unknowns import Unknown
from ...parameters import Values

#: How far starts lie from the truth: a share of the range, or a factor where ratios count.
AWAY, FACTOR = 0.3, 2.0
#: A start keeps this share of the way to its bound.
_ROOM = 0.9
#: Settings that are changed one at a time, beside the presets.
_BASE = {"height": 128}
_CHANGES: tuple[dict[str, int], ...] = (
    {},
    {"height": 64},
    {"iterations": 10},
    {"iterations": 20},
    {"spp": 2},
    {"spp": 16},
    {"depth": 4},
    {"depth": 8},
)


@dataclass(frozen=True)
class Choice:
    """Settings under a name; `preset` is "" for those that are not one."""

    name: str
    preset: str
    settings: FitSettings


def preset_settings(base: FitSettings) -> dict[str, FitSettings]:
    """Preset -> `base` with what that preset sets of a fit."""
    names = ("iterations", "spp", "height")
    return {
        name: replace(base, **{key: getattr(preset, key) for key in names}, tolerance=0.0)
        for name, preset in PRESETS.items()
    }


def choices(base: FitSettings, tallest: int) -> list[Choice]:
    """Presets and variations, none higher than `tallest` pixels, each once. What no preset sets
    (loss, optimiser, seed, depth, threads) is that of `base`."""
    found = [
        Choice(name, name, replace(own, height=min(own.height, tallest)))
        for name, own in preset_settings(base).items()
    ]
    balanced = next(item.settings for item in found if item.preset == "balanced")
    for change in _CHANGES:
        own = replace(balanced, **(_BASE | change))
        own = replace(own, height=min(own.height, tallest))
        if own not in [item.settings for item in found]:
            found.append(Choice(_name(own), "", own))
    return found


def displaced(unknown: Unknown) -> Values:
    """A start away from the truth (`unknown.start`), to the side of the bound that is farther."""
    return tuple(_moved(value, unknown) for value in unknown.start)


def error_of(unknown: Unknown, found: Values) -> float:
    """Root mean square over the components: differences, or logarithms of ratios."""
    pairs = zip(found, unknown.start, strict=True)
    if unknown.by_ratio:
        parts = [math.log(value / true) for value, true in pairs]
    else:
        parts = [value - true for value, true in pairs]
    return float(np.sqrt(np.mean(np.square(parts))))


def total(unknowns: Sequence[Unknown], errors: Mapping[str, float]) -> float:
    """Root mean square over the unknowns, every one as much as any other."""
    return float(np.sqrt(np.mean([errors[item.name] ** 2 for item in unknowns])))


def front(points: Sequence[tuple[float, float]]) -> list[bool]:
    """Which (seconds, error) no other point beats in both."""
    return [
        not any(
            other[0] <= point[0] and other[1] <= point[1] and other != point for other in points
        )
        for point in points
    ]


def _moved(value: float, unknown: Unknown) -> float:
    low, high = unknown.minimum, unknown.maximum
    if unknown.by_ratio:
        low, high, value = math.log(low), math.log(high), math.log(value)
        step = math.log(FACTOR)
    else:
        step = AWAY * (high - low)
    if high - value >= value - low:
        moved = value + min(step, _ROOM * (high - value))
    else:
        moved = value - min(step, _ROOM * (value - low))
    return math.exp(moved) if unknown.by_ratio else moved


def _name(settings: FitSettings) -> str:
    words = f"{settings.height} px, {settings.spp} spp, {settings.iterations} iterations"
    return words + (f", depth {settings.depth}" if settings.depth else "")
