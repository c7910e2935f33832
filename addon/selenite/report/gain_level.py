# SPDX-License-Identifier: GPL-3.0-or-later
"""Intervals of gains beside an image, a grid or a world's image, which can compensate for them.

The native interval of a gain is one at the fitted fields. If a field were brighter by a factor,
gains would follow; the shading that the photos then do not explain, and the prior of the gains, say
how large that factor may be. Source: docs/method/confidence.md, "Gains beside fields".
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import native
from ..capture.prepared import Capture
from ..capture.views import blurred
from ..fit.capture_render import as_found, evaluator
from ..fit.fields import FieldUnknown, ImageUnknown
from ..fit.job import scene_at
from ..fit.plan import FitPlan

if TYPE_CHECKING:
    from .._core import Scene

#: The field's other brightness, as a factor; samples and rows of the pictures that compare the two.
_FACTOR, _SPP, _ROWS = 0.9, 16, 64
#: Standard deviation of the logarithm of a gain before any photo, as the native fit has it.
_PRIOR = 0.7
#: Independent residuals of a photo where a model error remains: blocks, as those of a gain's own
#: error. And the least model error, of brightness.
_BLOCKS, _LEAST_ERROR = 100, 0.02
_QUANTILE = 1.645


@dataclass(frozen=True)
class Change:
    """Of a photo where a field becomes brighter, by its logarithm: how its gain follows, and the
    mean square of the relative change that the gain leaves."""

    gain: float
    left: float


def widened(
    plan: FitPlan,
    result: dict[str, Any],
    progress: Callable[[str, float], None] = lambda _text, _fraction: None,
) -> dict[str, Any]:
    """The result with wider intervals of gains, where fields are fitted and gains are free."""
    free = [item for item in plan.captures if item.free_gain != "none"]
    rows = result.get("captures") or {}
    if not plan.fields or not any("gain_interval_90" in rows.get(item.id, {}) for item in free):
        return result
    wider = {item.id: 0.0 for item in plan.captures}
    base = scene_at(plan, result)
    fields = [item for item in plan.fields if not isinstance(item, ImageUnknown) or item.is_light]
    for index, field in enumerate(fields):
        progress(f"gains beside {field.name}", index / len(fields))
        values = result["fields_best"][field.name]
        dimmed = field.placed(base, _dimmed(field, values))
        changes = {item.id: change(plan, result, item, base, dimmed) for item in plan.captures}
        level = level_error(
            [(changes[item.id], _unexplained(rows.get(item.id, {}))) for item in plan.captures],
            [item.free_gain != "none" for item in plan.captures],
        )
        for item in free:
            wider[item.id] = max(wider[item.id], abs(changes[item.id].gain) * level)
    found = {
        name: _with_wider(row, wider.get(name, 0.0)) if "gain_interval_90" in row else row
        for name, row in rows.items()
    }
    return result | {"captures": found}


def level_error(changes: Sequence[tuple[Change, float]], free: Sequence[bool]) -> float:
    """Standard deviation of the logarithm of a field's brightness. changes: of each photo, with the
    share of it that is not explained; free: whether its gain is."""
    information = 0.0
    for (one, error), own in zip(changes, free, strict=True):
        information += _BLOCKS * one.left / max(error, _LEAST_ERROR) ** 2
        information += (one.gain / _PRIOR) ** 2 if own else 0.0
    return 1 / math.sqrt(information) if information > 0 else _PRIOR


def change(
    plan: FitPlan, result: dict[str, Any], capture: Capture, base: Scene, dimmed: Scene
) -> Change:
    """Renders the photo with both values of the field, by two sets of random numbers: products of
    pictures have no bias by their noise."""
    small = _small(as_found(capture, result))
    view, settings = small.view(), plan.request.settings
    pictures, slopes = [], []
    for seed in (settings.seed + 1, settings.seed + 2):
        pair = [
            evaluator(one, settings).picture(view, _SPP, seed=seed).image.astype(float)
            for one in (base, dimmed)
        ]
        pictures.append(pair[0])
        slopes.append((pair[0] - pair[1]) / -math.log(_FACTOR))
    weight = small.weight.astype(float)
    level = blurred(pictures[0] + pictures[1]) / 2
    share = weight[..., None] / np.square(level + 0.1 * level.mean() + 1e-12)
    return change_of(pictures, slopes, share, free=capture.free_gain != "none")


def change_of(
    pictures: Sequence[np.ndarray], slopes: Sequence[np.ndarray], share: np.ndarray, *, free: bool
) -> Change:
    """Of two independent pairs of a picture and its slope; `share`: weights of their products."""

    def product(one: np.ndarray, other: np.ndarray) -> float:
        return float((share * one * other).sum())

    strength = product(pictures[0], pictures[1])
    if strength <= 0:
        return Change(0.0, 0.0)
    common = (product(pictures[0], slopes[1]) + product(pictures[1], slopes[0])) / 2
    gain = -common / strength
    left = product(slopes[0], slopes[1]) - (common**2 / strength if free else 0.0)
    return Change(gain if free else 0.0, max(left, 0.0) / strength)


def _dimmed(field: FieldUnknown, values: np.ndarray) -> np.ndarray:
    """The same, less bright by _FACTOR in linear light."""
    if isinstance(field, ImageUnknown) and field.texture.encoded:
        image = native.image()
        return image.srgb_encode(np.float32(_FACTOR) * image.srgb_decode(values))  # type: ignore[no-any-return]
    return np.ascontiguousarray(np.float32(_FACTOR) * values)


def _small(capture: Capture) -> Capture:
    """The photo with fewer rows."""
    rows, columns = capture.weight.shape
    if rows <= _ROWS:
        return capture
    return capture.small((max(1, round(columns * _ROWS / rows)), _ROWS))


def _unexplained(row: Mapping[str, Any]) -> float:
    return float(row.get("unexplained") or 0.0)


def _with_wider(row: Mapping[str, Any], error: float) -> dict[str, Any]:
    """error: one more standard deviation of the logarithm."""
    intervals = []
    for gain, (_low, high) in zip(row["gain"], row["gain_interval_90"], strict=True):
        own = math.log(max(high, gain) / gain)
        wide = math.exp(math.hypot(own, _QUANTILE * error))
        intervals.append((gain / wide, gain * wide))
    return {**row, "gain_interval_90": intervals}
