# SPDX-License-Identifier: GPL-3.0-or-later
"""What goes wrong in a fit, in plain words: pure functions of its history and newest pictures.

Each function returns no or a few sentences: what was seen, with its number, and what to do. They
are about the newest state, so a sentence goes away when its cause does. Every threshold is one of
the constants below.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ... import native
from ...capture.views import View, blurred, eroded
from ...messages import control, joined, message
from .. import trust
from .turntable import light_turns
from .unlit import light_in_the_dark

if TYPE_CHECKING:
    from ..._core import FitResult, History


#: Nothing is said about pictures and losses before so many iterations: a start may be anything.
FIRST_ITERATION = 8
_AT_BOUND_FOR = 5  # rows
_DRIFT_FOR, _ARRIVES_IN = 8, 8  # rows behind, iterations ahead
_DRIFT_NEAR = 0.15  # of the range: a fit that has just begun crosses the middle of it at full speed
_FLAT = 0.9  # of the first loss is still there
_SIGMAS = 3.0
_GAIN = 0.1  # from 1
_GAIN_EXPLAINS = 0.7  # of the squared difference
_SHIFT_PIXELS, _SHIFT_EXPLAINS = 0.5, 0.3
_RIM_PIXELS = 3
_RIM_HOLDS, _RIM_TIMES = 0.6, 4.0  # of the squared difference; mean over that inside
_FEWEST_PIXELS = 20
_FEW_PHOTOS = 3  # that are told one by one
#: Rows; of the history at least; net way over whole way; step over the range; newer half of the
#: rows over older half, below which the steps are converging.
_JITTER_ROWS, _JITTER_FROM, _JITTER_NET, _JITTER, _CONVERGING = 10, 20, 0.25, 0.02, 0.7
#: Of the iterations, the newest; of the loss before them, which it fell by at least; of the first
#: loss, below which there is nothing to gain.
_NEWEST, _FALLS_BY, _NOTHING_LEFT = 0.25, 0.1, 1e-4
_NOISE_OF_PHOTO = 0.02  # standard error as a difference in brightness, over the photo's


@dataclass(frozen=True)
class Limits:
    """Name and bounds of an unknown, for each component. `logarithmic`: what counts is the ratio
    of two values, not their difference. `range_ends`: see `Unknown`."""

    name: str
    minimum: float
    maximum: float
    logarithmic: bool = False
    range_ends: frozenset[str] = frozenset()


def diagnose(
    history: History,
    limits: Sequence[Limits],
    views: Sequence[View],
    *,
    from_start: bool = True,
    sure: bool = False,
    running: bool = False,
    transmits: bool = False,
    explained: bool = False,
    opaque: bool = False,
    azimuths: Mapping[str, float] | None = None,
) -> tuple[str, ...]:
    """Every sentence that holds now. `from_start`: no earlier stage has brought the loss down.
    `sure`: a refinement has determined every value, so that noise is known to hide none. `running`:
    what is left to do may still show what noise hides now. `transmits`: a fitted material refracts,
    and moves edges until the end. `explained`: the photos are, within noise.
    `opaque`: no light passes through what is fitted. `azimuths`: see `turntable`.
    """
    if not len(history.iteration):
        return ()
    found = [*at_bound(history, limits), *drifting(history, limits)]
    if int(history.iteration[-1]) >= FIRST_ITERATION:
        found += exposure(views)
        # What these see looks like a silhouette that does not fit, too.
        of_light = [] if explained else light_turns(views, azimuths or {})
        of_light += light_in_the_dark(views) if opaque else []
        if not of_light and not (transmits and (running or explained)):
            found += misaligned(views, transmits=transmits, rims=not explained)
        found += loss_flat(history) if from_start and not explained else []
        found += too_noisy(history, limits) if not sure else []
        found += hidden_loss(history, views) if not (sure or running) else []
        found += of_light if not running else []
    return tuple(found)


def at_bound(history: History, limits: Sequence[Limits]) -> list[str]:
    """Values that have sat on a bound for the last rows; the components of a colour together."""
    sitting: dict[tuple[Limits, str, float], dict[str, int]] = {}
    for item, label, values in _components(history, limits):
        for bound, word in ((item.minimum, "minimum"), (item.maximum, "maximum")):
            near = 0.01 * abs(bound) + 1e-6 * (item.maximum - item.minimum)
            away = np.flatnonzero(np.abs(values - bound) > near)
            rows = len(values) - (int(away[-1]) + 1 if len(away) else 0)
            if rows >= _AT_BOUND_FOR:
                sitting.setdefault((item, word, bound), {})[label] = rows
    found = []
    for (item, word, bound), labels in sitting.items():
        letters = [label.removeprefix(item.name).lstrip(".") for label in labels]
        label = next(iter(labels)) if len(labels) == 1 else f"{item.name} ({', '.join(letters)})"
        seen = message(
            "course.sat-at-iterations",
            "{label} has sat at its {word} {bound} for {count} iterations",
            label=label,
            word=trust.BOUNDS[word],
            bound=f"{bound:g}",
            count=min(labels.values()),
        )
        cause = message(
            "course.light-exposure-parameter-not",
            "light, exposure or a parameter that is not fitted is wrong",
        )
        if word in item.range_ends:
            found.append(
                message(
                    "course.if-not-plausible",
                    "{seen}: if that is not plausible, {cause}",
                    seen=seen,
                    cause=cause,
                )
            )
        else:
            found.append(
                message(
                    "course.if-not-plausible-else",
                    "{seen}: if that is not plausible, {cause}; else widen the bound",
                    seen=seen,
                    cause=cause,
                )
            )
    return found


def drifting(history: History, limits: Sequence[Limits]) -> list[str]:
    """Values that move to a bound at an even pace and will be there soon."""
    found = []
    for item, label, values in _components(history, limits):
        if len(values) <= _DRIFT_FOR:
            continue
        scale = np.log if item.logarithmic else np.asarray
        steps = np.diff(scale(values[-_DRIFT_FOR - 1 :]))
        for bound, word, sign in ((item.minimum, "minimum", -1), (item.maximum, "maximum", 1)):
            pace, left = sign * steps.mean(), sign * (scale(bound) - scale(values[-1]))
            even = bool((sign * steps > 0).all()) and sign * steps[-1] >= pace / 2
            near = left <= _DRIFT_NEAR * (scale(item.maximum) - scale(item.minimum))
            if even and near and 0 < left <= _ARRIVES_IN * pace and pace > 0:
                found.append(
                    message(
                        "course.moved-towards-iterations-without",
                        "{label} = {value} has moved towards its {word} {bound} for "
                        "{count} iterations without slowing down: check whether light, "
                        "exposure and the other parameters are right",
                        label=label,
                        value=f"{values[-1]:.3g}",
                        word=trust.BOUNDS[word],
                        bound=f"{bound:g}",
                        count=_DRIFT_FOR,
                    )
                )
    return found


def loss_flat(history: History) -> list[str]:
    """A loss that is there, beyond noise, and does not fall."""
    iteration, loss, error = _validations(history)
    if len(loss) < 3 or not loss[0] > 0:
        return []
    if loss[-1] < _SIGMAS * error[-1] or loss[-1] < _FLAT * loss[0]:
        return []
    return [
        message(
            "course.loss-not-fallen-iterations",
            "The loss has not fallen in {iteration} iterations ({first} at first, {now} "
            "now): the fitted parameters do not explain the difference; check camera, light "
            "and pairs of photo and camera",
            iteration=iteration[-1],
            first=f"{loss[0]:.3g}",
            now=f"{loss[-1]:.3g}",
        )
    ]


def shortened(fit: FitResult) -> list[str]:
    """Of a shape: steps that would have spoiled the mesh."""
    steps = fit.shape_steps
    if not (steps.turning or steps.intersecting):
        return []
    return [
        message(
            "course.steps-shortened",
            "Steps of the shape were shortened: {turning} would have turned a face over, "
            "{intersecting} led a surface through another one; {given_up} were left out",
            turning=steps.turning,
            intersecting=steps.intersecting,
            given_up=steps.given_up,
        )
    ]


def still_falling(fit: FitResult) -> list[str]:
    """Of a fit at its end, by its result: a loss that the last iterations still brought down,
    beyond noise. Where the photos are explained nothing is left to gain."""
    if fit.stopped != native.core().StopReason.ITERATIONS or trust.explained(fit):
        return []
    iteration, loss, error = _losses(fit.history)
    done = np.isfinite(loss)
    stages = fit.history.stage
    if stages is not None and len(stages):
        done &= stages == stages[-1]
    iterations = int(np.ptp(iteration[done])) if done.any() else 0
    # Rows of the last iteration are of the answer, before and after its refinement: weights of its
    # own judge it, in which no other loss is.
    done &= iteration < iteration[-1]
    if done.sum() < 2:
        return []
    iteration, loss, error = iteration[done], loss[done], error[done]
    count = int(iteration[-1] - iteration[0])
    before = int(np.flatnonzero(iteration <= iteration[-1] - _NEWEST * count)[-1])
    fall, noise = loss[before] - loss[-1], math.hypot(error[before], error[-1])
    if fall < max(_SIGMAS * noise, _FALLS_BY * loss[before]) or loss[-1] < _NOTHING_LEFT * loss[0]:
        return []
    return [
        message(
            "course.loss-still-falling-when",
            "The loss was still falling when the iterations ended ({before} at "
            "iteration {iteration}, {now} at {last}): the values have not "
            "converged; give more Iterations, such as {iterations}, and fit again",
            before=f"{loss[before]:.3g}",
            iteration=iteration[before],
            now=f"{loss[-1]:.3g}",
            last=iteration[-1],
            iterations=2 * iterations,
        )
    ]


def exposure(views: Sequence[View]) -> list[str]:
    """Photos that are a multiple of their render, in brightness or channel by channel."""
    parts = []
    for view in views:
        found = _gain(view)
        if found is not None:
            gain, explained = found
            text = message(
                "course.times-as-bright-as",
                "{mean} times as bright as the render",
                mean=f"{gain.mean():.2f}",
            )
            if gain.max() > 1.05 * gain.min():
                text = message(
                    "course.times-render-red-green",
                    "{factors} times the render in red, green, blue",
                    factors=", ".join(f"{g:.2f}" for g in gain),
                )
            parts.append(
                message(
                    "course.difference",
                    "'{id}' is {text} ({explained} of the difference)",
                    id=view.id,
                    text=text,
                    explained=f"{explained:.0%}",
                )
            )
    if not parts:
        return []
    return [
        message(
            "course.photo-exposure-white-balance",
            "Photo {photos}: its exposure or white balance is not the scene's; fit "
            "the light (World:strength, World:color) or take the loss "
            "{loss}",
            loss=control("loss.brightness-independent-mse", "brightness-independent-mse"),
            photos=joined("; ", parts),
        )
    ]


def misaligned(views: Sequence[View], *, transmits: bool = False, rims: bool = True) -> list[str]:
    """Photos that are shifted against their render, or differ at the mask's rim only: a sentence
    each, or one for all where there are many. A refraction that is not right yet moves what is seen
    through the body, with the camera where it was. rims: whether those of masks are judged; where
    the photos are explained, what is left there is noise and blur of edges."""
    cause = message("course.silhouette-does-not-fit", "the silhouette does not fit")
    cure = message(
        "course.correct-camera-align-photo",
        "correct the camera, align the photo ({align}), or mask the rim",
        align=control("align", "--align"),
    )
    if transmits:
        cause = message(
            "course.silhouette-does-not-fit-2",
            "the silhouette does not fit, or what is seen through the body is not right yet",
        )
        cure = message("course.if-outlines-differ", "if the outlines differ, {cure}", cure=cure)
    shifted, at_rim = [], []
    for view in views:
        shift = _shift(view)
        rim = _rim(view) if rims else None
        if shift is not None:
            shifted.append((view.id, *shift))
        elif rim is not None:
            at_rim.append((view.id, *rim))
    if len(shifted) + len(at_rim) > _FEW_PHOTOS:
        names = [f"'{name}'" for name, *_ in shifted + at_rim][:_FEW_PHOTOS]
        return [
            message(
                "course.photos-such-as-lie",
                "{count} of {all} photos, such as {names}, lie beside their render or "
                "differ at the rim of their mask only: {cause}; {cure}",
                count=len(shifted) + len(at_rim),
                all=len(views),
                names=", ".join(names),
                cause=cause,
                cure=cure,
            )
        ]
    found = []
    for name, across, down, explained in shifted:
        side = message("word.right", "right") if across > 0 else message("word.left", "left")
        way = message("word.down", "down") if down > 0 else message("word.up", "up")
        words = message(
            "course.pixels",
            "{across} pixels to the {side} and {down} {way}",
            across=f"{abs(across):.1f}",
            side=side,
            down=f"{abs(down):.1f}",
            way=way,
        )
        found.append(
            message(
                "course.photo-lies-about-render",
                "Photo '{name}' lies about {words} of its render ({explained} of the "
                "difference): {cause}; {cure}",
                name=name,
                words=words,
                explained=f"{explained:.0%}",
                cause=cause,
                cure=cure,
            )
        )
    for name, share, of_pixels in at_rim:
        found.append(
            message(
                "course.difference-photo-lies-within",
                "{share} of the difference of photo '{name}' lies within {width} "
                "pixels of its mask's rim, {of_pixels} of the pixels: {cause}; {cure}",
                share=f"{share:.0%}",
                name=name,
                width=_RIM_PIXELS,
                of_pixels=f"{of_pixels:.0%}",
                cause=cause,
                cure=cure,
            )
        )
    return found


def too_noisy(history: History, limits: Sequence[Limits]) -> list[str]:
    """Steps that lead nowhere."""
    found = []
    for item, label, values in _components(history, limits):
        steps = np.diff(values[-_JITTER_ROWS - 1 :])
        if len(values) <= _JITTER_FROM:
            continue
        older, newer = (np.sqrt(np.mean(np.square(half))) for half in np.split(steps, 2))
        size = float(np.sqrt(np.mean(np.square(steps))))
        span = abs(values[-1]) if item.logarithmic else item.maximum - item.minimum
        converging = newer < _CONVERGING * older
        if (
            not converging
            and size > _JITTER * span
            and abs(steps.sum()) < _JITTER_NET * np.abs(steps).sum()
        ):
            found.append(
                message(
                    "course.goes-back-forth-step",
                    "{label} goes back and forth by {size} a step and gets nowhere: the "
                    "steps are noise; take four times the samples, larger pictures or a "
                    "smaller learning rate",
                    label=label,
                    size=f"{size:.2g}",
                )
            )
    return found


def hidden_loss(history: History, views: Sequence[View]) -> list[str]:
    """A loss whose noise is larger than it and its change."""
    iteration, loss, error = _validations(history)
    level = math.sqrt(max((float(np.mean(np.square(v.reference))) for v in views), default=0.0))
    hidden = len(loss) >= 3 and abs(loss[-1] - loss[0]) < error[-1] and loss[-1] < 2 * error[-1]
    if not (hidden and math.sqrt(error[-1]) > _NOISE_OF_PHOTO * level > 0):
        return []
    return [
        message(
            "course.noise-hides-loss-at",
            "Noise hides the loss: {first} at first, {now} after {iteration} iterations, "
            "both known to {error} only; take four times the samples or larger pictures "
            "(Draft has few of both)",
            first=f"{loss[0]:.2g}",
            now=f"{loss[-1]:.2g}",
            iteration=iteration[-1],
            error=f"{error[-1]:.2g}",
        )
    ]


def _components(
    history: History, limits: Sequence[Limits]
) -> Iterator[tuple[Limits, str, np.ndarray]]:
    """(limits, "Body:base_color.r", its values row by row)."""
    for item in limits:
        if item.name in history.values:
            columns = np.asarray(history.values[item.name], float)
            columns = columns.reshape(len(columns), -1)
            for index in range(columns.shape[1]):
                label = item.name if columns.shape[1] == 1 else f"{item.name}.{'rgb'[index]}"
                yield item, label, columns[:, index]


def _losses(history: History) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Iteration, validated loss (NaN where it was not) and its standard error of every row."""
    return history.iteration, history.validation, history.validation_standard_error


def _validations(history: History) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same of the rows that have been validated."""
    iteration, loss, error = _losses(history)
    done = np.isfinite(loss)
    return iteration[done], loss[done], error[done]


def _gain(view: View) -> tuple[np.ndarray, float] | None:
    """(photo over render per channel, share of the squared difference that goes with it)."""
    weight = view.weight[..., None].astype(float)
    photo, picture = view.reference.astype(float), view.picture.astype(float)
    sums = (weight * picture).sum(axis=(0, 1))
    before = float((weight * (photo - picture) ** 2).sum())
    if not (sums > 0).all() or before <= 0:
        return None
    gain = (weight * photo).sum(axis=(0, 1)) / sums
    explained = 1 - float((weight * (photo - gain * picture) ** 2).sum()) / before
    if np.abs(gain - 1).max() < _GAIN or explained < _GAIN_EXPLAINS:
        return None
    return gain, explained


def _shift(view: View) -> tuple[float, float, float] | None:
    """(pixels to the right, pixels down, share explained) of photo against render, to first order
    in the shift: photo(x) = render(x - shift)."""
    photo, picture = blurred(view.reference), blurred(view.picture)
    middle = (photo + picture) / 2  # its slope is right for shifts of twice the size
    down, across = np.gradient(middle, axis=(0, 1))
    use = eroded(view.weight > 0, 2)
    use[:2], use[-2:], use[:, :2], use[:, -2:] = False, False, False, False
    if use.sum() < _FEWEST_PIXELS:
        return None
    slopes = -np.stack([across[use].ravel(), down[use].ravel()], axis=1)
    difference = (photo - picture)[use].ravel()
    energy = float(difference @ difference)
    normal = slopes.T @ slopes
    if energy <= 0 or np.linalg.cond(normal) > 1e6:
        return None
    shift = np.linalg.solve(normal, slopes.T @ difference)
    explained = float(shift @ (slopes.T @ difference)) / energy
    if np.hypot(*shift) < _SHIFT_PIXELS or explained < _SHIFT_EXPLAINS:
        return None
    return float(shift[0]), float(shift[1]), explained


def _rim(view: View) -> tuple[float, float] | None:
    """(share of the squared difference at the mask's rim, share of the pixels there)."""
    counted = view.weight > 0
    inside = eroded(counted, _RIM_PIXELS)
    rim = counted & ~inside
    if rim.sum() < _FEWEST_PIXELS or inside.sum() < _FEWEST_PIXELS:
        return None
    difference = np.square(view.reference.astype(float) - view.picture).sum(axis=2)
    at_rim, within = difference[rim], difference[inside]
    total = float(at_rim.sum() + within.sum())
    if total <= 0 or at_rim.mean() < _RIM_TIMES * within.mean():
        return None
    share = float(at_rim.sum()) / total
    return (share, float(rim.sum() / counted.sum())) if share >= _RIM_HOLDS else None
