# SPDX-License-Identifier: GPL-3.0-or-later
"""How far two halves of the photos agree on an image that was fitted to all of them.

A texel that one half of the photos sees brighter than its renders, that half would brighten. Both
halves are asked by the same derivatives: of the photos and of their renders, by each texel.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import native
from ..capture.prepared import Capture
from ..fit.capture_render import as_found, evaluator
from ..fit.fields import EnvironmentUnknown, FieldUnknown, ImageUnknown
from ..fit.fields.seen import seen
from ..fit.job import scene_at
from ..fit.plan import FitPlan

if TYPE_CHECKING:
    from .._core import Scene

#: Samples of the derivatives; photos and renders are asked by the same paths, so that most noise
#: cancels. And the least light of a texel.
_SPP, _LEAST = 8, 1e-6


@dataclass(frozen=True)
class Halves:
    """mean, texels: relative differences of what the halves would have, of the whole image and
    texel by texel (the root of their mean square). both: share of the seen texels that both see.
    difference: (h, w) float32 of each texel, NaN where one half alone sees it."""

    mean: float
    texels: float
    both: float
    difference: np.ndarray

    def as_json(self) -> dict[str, float | None]:
        """For result.json; None where the halves see no texel in common."""
        known = self.both > 0
        return {
            "mean": self.mean if known else None,
            "texels": self.texels if known else None,
            "seen_by_both": self.both,
        }

    def write(self, path: Path) -> None:
        """The absolute difference of each texel as OpenEXR; -1 where halves cannot be compared."""
        known = np.isfinite(self.difference)
        shown = np.where(known, np.abs(self.difference), np.float32(-1))
        picture = np.repeat(shown[..., None], 3, axis=2)
        native.image().write_exr(str(path), np.ascontiguousarray(picture, np.float32))

    def sentence(self, name: str) -> str:
        """For the report."""
        if not self.both:
            return f"{name}: no texel is seen by both halves of the photos"
        return (
            f"{name}: two halves of the photos differ by {self.mean:.0%} on its mean and by "
            f"{self.texels:.0%} texel by texel; {self.both:.0%} of what is seen is seen by both"
        )


def of_images(
    plan: FitPlan,
    result: dict[str, Any],
    progress: Callable[[str, float], None] = lambda _text, _fraction: None,
) -> dict[str, Halves]:
    """By the image's name; none of a single photo. Photos take turns, as lists run round a body."""
    images = [
        item
        for item in plan.fields
        if isinstance(item, EnvironmentUnknown)
        or (isinstance(item, ImageUnknown) and item.is_light)
    ]
    if not images or len(plan.captures) < 2:  # noqa: PLR2004 - two halves
        return {}
    scene, found = scene_at(plan, result), {}
    for item in images:
        sums = []
        for half in range(2):
            progress(f"halves of the photos of {item.name}", half / 2)
            sums.append(_asked(plan, result, item, scene, plan.captures[half::2]))
        found[item.name] = halves(*sums)
    return found


def halves(one: tuple[np.ndarray, np.ndarray], other: tuple[np.ndarray, np.ndarray]) -> Halves:
    """Of each half (h, w): what its photos and what its renders show of each texel."""
    known = [seen(of_renders) & (of_photos > 0) for of_photos, of_renders in (one, other)]
    both, any_of = known[0] & known[1], known[0] | known[1]
    difference = np.full(both.shape, np.nan, np.float32)
    if not both.any():
        return Halves(math.nan, math.nan, 0.0, difference)
    ratios = [
        np.log(np.maximum(of_photos[both], _LEAST) / np.maximum(of_renders[both], _LEAST))
        for of_photos, of_renders in (one, other)
    ]
    difference[both] = ratios[0] - ratios[1]
    weight = np.minimum(one[1][both], other[1][both])
    means = [
        float((of_photos[both]).sum() / (of_renders[both]).sum())
        for of_photos, of_renders in (one, other)
    ]
    square = float((weight * np.square(difference[both])).sum() / weight.sum())
    return Halves(
        abs(math.log(means[0] / means[1])),
        math.sqrt(square),
        float(both.sum() / max(any_of.sum(), 1)),
        difference,
    )


def _asked(
    plan: FitPlan,
    result: dict[str, Any],
    item: FieldUnknown,
    scene: Scene,
    captures: Sequence[Capture],
) -> tuple[np.ndarray, np.ndarray]:
    """(h, w) twice: sums over the photos of what photo and render show of each texel."""
    total = [np.zeros(item.values.shape[:2]) for _ in range(2)]
    settings = plan.request.settings
    asked = evaluator(scene, settings)
    for capture in captures:
        found = as_found(capture, result)
        render = asked.picture(found.view(), _SPP, seed=settings.seed + 1).image
        for sums, picture in zip(total, (capture.reference, render), strict=True):
            light = np.maximum(picture.mean(axis=2), 0) * capture.weight
            weight = np.ascontiguousarray(light, np.float32)
            if not weight.any():
                continue
            photo = replace(found, weight=weight).native()
            _, texels = asked.gradient(
                photo, item.owner, item.kind.parameter, _SPP, seed=settings.seed
            )
            sums += float(weight.sum()) * np.abs(texels).mean(axis=2)
    return total[0], total[1]
