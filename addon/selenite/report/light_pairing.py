# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos that other lights explain far better than their own: a wrong lamp paired with a photo.

After a fit, each photo that is not explained is compared with small renders under the other light
states of the run, and under each other lamp alone where it names one lamp. The scene has the fitted
values, and the start's: values found under a wrong lamp may make the right one look wrong too.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..capture.light_states import AS_IN_SCENE, LightState, described, is_as_in_scene, key_of
from ..capture.prepared import Capture
from ..fit import trust
from ..fit.capture_render import as_found, evaluator
from ..fit.job import scene_at
from ..fit.plan import FitPlan
from ..messages import message
from .finished_fit import FinishedFit

if TYPE_CHECKING:
    from .._core import Evaluator, FitResult

#: Pixels of a picture, samples of one, and by how much more the verdict has.
_PIXELS, _SPP, _AGAIN = 32 * 32, 16, 4
#: Pictures of all photos together under other lights, some 10 seconds on two cores, and seconds:
#: a medium takes longer.
_MOST_PICTURES, _MOST_SECONDS = 400, 20.0
#: A photo whose squared error, relative to its brightness, is less is explained well enough.
_LEAST = 0.05**2
#: What other lights leave of the squared error, and the standard errors by which that is sure.
_SHARE, _SIGMAS = 0.5, 3.0
#: Squared error from which on lights explain nothing: then the model is wrong, not the lamp.
_MOST = 0.5**2
#: Of a photo's mean: brightness below which errors count as absolute.
_DARK = 0.1
#: Blocks along each side by whose spread an error is known.
_BLOCKS = 6
#: Seeds that no fit and no photo of ours uses.
_SEED = 1 << 42


@dataclass(frozen=True)
class Mismatch:
    """A photo, the lights that explain it better than its own, and both errors, relative to its
    brightness. photo_of: another photo with these lights, "" for none."""

    capture: Capture
    lights: LightState
    photo_of: str
    own: float
    other: float

    def sentence(self) -> str:
        """For the log and the panel."""
        own, other = described(self.capture.lights), described(self.lights)
        if own == other:
            other = (
                message(
                    "light_pairing.lights-photo",
                    "the lights of photo '{photo_of}'",
                    photo_of=self.photo_of,
                )
                if self.photo_of
                else message("light_pairing.other-lights", "other lights")
            )
        return message(
            "light_pairing.photo-better-than-error",
            "Photo '{id}' is better explained by {other} than by {own}: an error of {less} of its "
            "brightness, not {more}; check the lights of this capture",
            id=self.capture.id,
            other=other,
            own=own,
            less=f"{self.other:.0%}",
            more=f"{self.own:.0%}",
        )


def with_warnings(
    plan: FitPlan,
    result: FinishedFit,
    progress: Callable[[str, float], None] = lambda _text, _fraction: None,
) -> FinishedFit:
    """The result with a note for each of `mismatches`."""
    notes = [item.sentence() for item in mismatches(plan, result.fit, progress)]
    return replace(result, notes=(*result.notes, *notes))


def mismatches(
    plan: FitPlan,
    fit: FitResult,
    progress: Callable[[str, float], None] = lambda _text, _fraction: None,
) -> list[Mismatch]:
    """Photos whose lights are probably not those of their captures. Renders nothing where captures
    say nothing of lights or each has the place of its lamp, which was measured with it, and
    after a fit that was stopped: who stops one does not wait. Photos
    beyond `_MOST_SECONDS` are left out. May be interrupted between two pictures."""
    captures = plan.captures
    if trust.cancelled(fit):
        return []
    if all(is_as_in_scene(item.lights) or item.lights["places"] for item in captures):
        return []
    end = time.monotonic() + _MOST_SECONDS
    settings = plan.request.settings
    scenes = [evaluator(scene, settings) for scene in (scene_at(plan, fit), plan.scene)]
    views = []
    for index, capture in enumerate(captures):
        progress(f"lights of {capture.id}", 0.2 * index / len(captures))
        view = _View.of(plan, scenes, capture, fit)
        own = view.error(capture.lights, 1)
        if time.monotonic() > end:
            return []
        if own.mean > _LEAST:
            views.append((own, view))
    views.sort(key=lambda item: -item[0].mean)
    found, pictures = [], 0
    for index, (own, view) in enumerate(views):
        progress(f"other lights of {view.capture.id}", 0.2 + 0.8 * index / len(views))
        others = list(_others(view.capture, captures, plan.scene.light_objects))
        if pictures + len(others) > _MOST_PICTURES or time.monotonic() > end:
            break
        pictures += len(others)
        errors = [(view.error(lights, 1), lights, name) for lights, name in others]
        if not errors:
            continue
        best, lights, name = min(errors, key=lambda item: item[0].mean)
        if not explains(best.mean, own.mean):
            continue
        # With fresh seeds: the least of many errors is less than it should be.
        before = view.error(view.capture.lights, 2, _AGAIN * _SPP)
        after = view.error(lights, 2, _AGAIN * _SPP)
        if after.surely_below(before):
            found.append(Mismatch(view.capture, lights, name, before.root, after.root))
    order = [item.id for item in captures]
    return sorted(found, key=lambda item: order.index(item.capture.id))


def explains(other: float, own: float) -> bool:
    """Whether the squared error under other lights, relative to the brightness, is so much smaller
    than that under a photo's own that these are probably wrong."""
    return other < min(_SHARE * own, _MOST)


@dataclass(frozen=True)
class _Error:
    """Squared error of a picture by blocks, relative to brightness, and the weight of each."""

    blocks: np.ndarray
    weight: np.ndarray

    @property
    def mean(self) -> float:
        return float((self.blocks * self.weight).sum() / self.weight.sum())

    @property
    def root(self) -> float:
        return math.sqrt(max(self.mean, 0.0))

    def surely_below(self, other: _Error) -> bool:
        """Whether it is below a share of the other, by more than the spread of blocks allows."""
        share = self.weight / self.weight.sum()
        difference = _SHARE * other.blocks - self.blocks
        mean = float((difference * share).sum())
        deviation = math.sqrt(float((share**2 * (difference - mean) ** 2).sum()))
        return other.mean > _LEAST and mean > _SIGMAS * deviation


@dataclass(frozen=True)
class _View:
    """A photo made small, and the scenes of which one is to explain it."""

    capture: Capture
    scenes: Sequence[Evaluator]
    free_gain: bool  # the fit would have found another one under other lights
    seed: int

    @staticmethod
    def of(plan: FitPlan, scenes: Sequence[Evaluator], capture: Capture, fit: FitResult) -> _View:
        height, width = capture.reference.shape[:2]
        scale = min(1.0, math.sqrt(_PIXELS / (width * height)))
        size = max(1, round(width * scale)), max(1, round(height * scale))
        small = as_found(capture, fit).small(size)
        free = capture.free_gain != "none"
        return _View(small, scenes, free, plan.request.settings.seed)

    def error(self, lights: LightState, number: int, spp: int = _SPP) -> _Error:
        """Under some lights, in the scene that explains the photo better. Errors of another
        `number` have other seeds."""
        errors = [self._error(scene, lights, number, spp) for scene in self.scenes]
        return min(errors, key=lambda error: error.mean)

    def _error(self, scene: Evaluator, lights: LightState, number: int, spp: int) -> _Error:
        """The two halves of a render have independent noise, so the product of their errors has
        none on average."""
        view = replace(self.capture, lights=lights).view()
        film = scene.picture(view, spp, seed=_SEED + 8 * self.seed + number)
        halves = [half.astype(np.float64) for half in (film.half_a, film.half_b)]
        if self.free_gain:
            halves = self._scaled(halves)
        picture, weight = self.capture.reference, self.capture.weight
        a, b = (picture - half for half in halves)
        share = weight / weight.sum()
        photo, render = picture.mean(axis=2), (halves[0] + halves[1]).mean(axis=2) / 2
        mean = float((photo * share).sum())
        # Of both pictures: where light falls in one of them alone, the error is 2 and no more, so
        # that a few dark pixels do not decide.
        bright = (photo**2 + render**2) / 2 + (_DARK * mean) ** 2
        square = (a * b).mean(axis=2) / np.maximum(bright, np.finfo(np.float32).tiny)
        weights = _blocks(weight)
        sums = _blocks(square * weight)
        return _Error(sums / np.maximum(weights, 1e-12), weights)

    def _scaled(self, halves: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Each with the gain that fits best, which the other half gives: so noise favours none."""
        weight = self.capture.weight[..., None]
        found = []
        for half, other in (halves, halves[::-1]):
            square = float((weight * other * half).sum())
            gain = (
                float((weight * other * self.capture.reference).sum()) / square
                if square > 0
                else 1.0
            )
            found.append(half * gain)
        return found


def _blocks(picture: np.ndarray) -> np.ndarray:
    """Sums over blocks, (n,)."""
    rows, columns = (
        np.unique(np.linspace(0, size, _BLOCKS, endpoint=False).astype(int))
        for size in picture.shape
    )
    return np.add.reduceat(np.add.reduceat(picture, rows, axis=0), columns, axis=1).ravel()


def _others(
    capture: Capture, captures: Sequence[Capture], lamps: Sequence[str]
) -> Iterator[tuple[LightState, str]]:
    """(light state, a photo that has it or "") of those that it could be confused with."""
    known = {key_of(capture.lights)}
    for item in captures:
        if key_of(item.lights) not in known:
            known.add(key_of(item.lights))
            yield item.lights, item.id
    own = capture.lights
    if own["lamps"] is None or len(own["lamps"]) != 1:
        return
    for lamp in dict.fromkeys(lamps):
        alone: LightState = {**AS_IN_SCENE, "lamps": [lamp], "world": own["world"]}
        if key_of(alone) not in known:
            known.add(key_of(alone))
            yield alone, ""
