# SPDX-License-Identifier: GPL-3.0-or-later
"""Looks from every place a photo could be taken from, and ranks them."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .. import native
from ..fit_run.captures import Capture
from ..fit_run.plan import FitPlan, build_scene, prepare
from ..fit_run.request import RunRequest
from ..parameters import Values
from ..problems import BadInput, Problem
from ..scene_read.values import SceneValues
from . import information
from .candidates import Body, Candidate, body_of, candidates
from .information import Information, Noise

#: Pixels of a look, whatever its aspect.
_PIXELS = 64 * 64
#: Samples of a first look at a photo's camera, and bounds of those of all others.
_PHOTO_SPP, _LEAST_SPP, _MOST_SPP = 64, 16, 256
#: Permitted error of what a place adds, as a share of what the photos say: in the first look from
#: every place, and in the second from the best of them.
_FIRST_DOUBT, _SECOND_DOUBT = 0.25, 0.1
#: Standard deviations of noise that information has to exceed; a false alarm of the first look
#: costs a second one and no more.
_FIRST_RESOLVED, _SECOND_RESOLVED = 2.0, 3.0
#: The best share of the places is looked at again.
_AGAIN, _LEAST_AGAIN = 0.15, 4
#: A residual's relative size beyond noise is believed between these; samples to measure it with.
_RELATIVE, _RESIDUAL_SPP = (0.002, 0.05), 8
#: As in native/fit/settings.cpp: least samples of the verification.
_VERIFIED_LEAST = 64
#: An error so much smaller than the range needs no further photo.
_WELL = 0.01
#: Slots of one render.
_MOST_UNKNOWNS = 24
#: Seeds that no fit and no photo of ours uses.
_SEED = 1 << 41


@dataclass(frozen=True)
class Row:
    """A place and what a photo from there would leave of the standard errors, (n,) in units of the
    parameters. gain: see `information.gain`. known: (n,) bool, determined then."""

    candidate: Candidate
    gain: float
    errors: np.ndarray
    known: np.ndarray


@dataclass(frozen=True)
class Step:
    """How far it has come; `fraction` between 0 and 1."""

    fraction: float
    text: str


class Suggestion:
    """Driven from outside: `for step in suggestion.steps(): ...`; then `rows`, the best first.

    plan: unknowns whose start are the values to look at, and the photos. scene: native, with these
    values and the candidates' cameras.
    """

    def __init__(
        self,
        plan: FitPlan,
        scene: Any,  # noqa: ANN401
        body: Body,
        places: list[Candidate],
    ) -> None:
        self.plan, self.body, self.places = plan, body, places
        self.rows: list[Row] = []
        self.seconds = 0.0
        self._scene = scene
        height, width = plan.captures[0].reference.shape[:2]
        scale = min(1.0, math.sqrt(_PIXELS / (width * height)))
        self._size = max(1, round(width * scale)), max(1, round(height * scale))
        self._asked = [
            (item.owner, item.parameter.name, list(item.start), item.minimum, item.maximum)
            for item in plan.unknowns
        ]
        found = native.core().coordinates(scene, self._asked)
        #: Of the components, in the order of the unknowns: "Body:base_color[0]".
        self.names: list[str] = list(found["names"])
        self._slope, self._ranges = found["slope"], found["range"]
        widths = np.cumsum([0] + [item.parameter.width for item in plan.unknowns])
        #: Components of each unknown.
        self.groups = [list(range(a, b)) for a, b in zip(widths, widths[1:], strict=False)]
        #: Standard errors with the photos there are, (n,), and which are determined.
        self.errors = self.known = np.zeros(len(self.names))
        #: Whether all are known within a hundredth of their range.
        self.well_known = False
        #: Gain of another photo like the first one, from the same place.
        self.repeated = 0.0
        self._token = native.core().ProgressToken()

    def cancel(self) -> None:
        """From any thread: `steps` ends within a tile, raising the native Cancelled."""
        self._token.cancel()

    def steps(self) -> Iterator[Step]:
        """A look at each photo's camera, one from each place, and a second one with fresh seeds and
        more samples from the best: what is told of these comes from the second look alone, so that
        no luck of the first is in it."""
        begin = time.monotonic()
        photos, places = self.plan.captures, self.places
        relative = 0.0
        for index, capture in enumerate(photos):
            yield Step(0.02 * index / len(photos), f"photo of {capture.camera}")
            relative += self._relative_error(capture) / len(photos)
        relative = math.sqrt(relative)
        there = []
        for index, capture in enumerate(photos):
            yield Step(0.02 + 0.08 * index / len(photos), f"photo of {capture.camera}")
            there.append(self._of_photo(capture, relative))
        # Places that are as noisy need as many samples; the error falls as the samples rise.
        doubt = max(one.relative_doubt() for one in there) * _PHOTO_SPP
        first_spp = int(np.clip(doubt / _FIRST_DOUBT, _LEAST_SPP, _MOST_SPP / 4))
        second_spp = int(np.clip(doubt / _SECOND_DOUBT, _PHOTO_SPP, _MOST_SPP))
        for index, capture in enumerate(photos):
            if second_spp > _PHOTO_SPP:
                yield Step(0.1, f"photo of {capture.camera}, second look")
                more = self._of_photo(capture, relative, second_spp - _PHOTO_SPP, 2)
                there[index] = there[index].mean(more, 1 - _PHOTO_SPP / second_spp)
        base = [information.precision(one) for one in there]
        before = information.errors(base, self._ranges)
        self.errors, self.known = before * self._slope, information.determined(before, self._ranges)
        self.well_known = bool((before < _WELL * self._ranges).all())
        twice = information.errors([*base, base[0]], self._ranges)
        self.repeated = information.gain(before, twice, self.groups)

        def row(place: Candidate, spp: int, look: int, resolved: float) -> Row:
            seen = self._of_place(place, relative, spp, look)
            added = information.precision(seen, resolved)
            after = information.errors([*base, added], self._ranges)
            gained = information.gain(before, after, self.groups)
            known = information.determined(after, self._ranges)
            return Row(place, gained, after * self._slope, known)

        again = min(max(_LEAST_AGAIN, round(_AGAIN * len(places))), len(places))
        work, done = len(places) * first_spp + again * second_spp, 0
        first = []
        for index, place in enumerate(places):
            yield Step(0.1 + 0.9 * done / work, f"place {index + 1} of {len(places)}")
            first.append(row(place, first_spp, 3, _FIRST_RESOLVED))
            done += first_spp
        first.sort(key=lambda item: -item.gain)
        second = []
        for index, item in enumerate(first[:again]):
            yield Step(0.1 + 0.9 * done / work, f"second look {index + 1} of {again}")
            second.append(row(item.candidate, second_spp, 4, _SECOND_RESOLVED))
            done += second_spp
        second.sort(key=lambda item: -item.gain)
        self.rows = second + first[again:]
        self.seconds = time.monotonic() - begin
        yield Step(1.0, "")

    def _look(self, camera: str, spp: int, look: int) -> dict[str, Any]:
        settings = self.plan.request.settings
        seen: dict[str, Any] = native.core().look(
            self._scene, self._asked, camera, *self._size, spp,
            seed=_SEED + 8 * settings.seed + look, depth=settings.depth,
            threads=settings.threads, progress=self._token,
        )  # fmt: skip
        return seen

    def _relative_error(self, capture: Capture) -> float:
        """Mean square of what a photo differs by, relative to its brightness, beyond the noise of
        the render: noise of the photo, and what no unknown explains. Kept within _RELATIVE."""
        height, width = capture.reference.shape[:2]
        settings = self.plan.request.settings
        film = native.core().render(
            self._scene, capture.camera, width, height, _RESIDUAL_SPP,
            seed=_SEED + 8 * settings.seed, depth=settings.depth, threads=settings.threads,
            progress=self._token,
        )  # fmt: skip
        level = information.brightness(capture.reference, capture.weight)
        product = (film.half_a - capture.reference) * (film.half_b - capture.reference)
        mean = np.average((product / level**2).mean(axis=2), weights=capture.weight)
        low, high = _RELATIVE
        return float(np.clip(mean, low**2, high**2))

    def _of_photo(
        self, capture: Capture, relative: float, spp: int = _PHOTO_SPP, look: int = 1
    ) -> Information:
        counts = capture.weight[..., None]
        planes = np.dstack([capture.reference * counts, counts]).astype(np.float32)
        small = native.image().resize(np.ascontiguousarray(planes), *self._size)
        weight = np.maximum(small[..., 3], 0.0)
        picture = small[..., :3] / np.maximum(weight, 1e-6)[..., None]
        seen = self._look(capture.camera, spp, look)
        return self._information(seen, picture, weight, spp, self._noise(relative))

    def _of_place(self, place: Candidate, relative: float, spp: int, look: int) -> Information:
        seen = self._look(place.camera.name, spp, look)
        weight = np.ones(self._size[::-1], np.float32)
        return self._information(seen, seen["image"], weight, spp, self._noise(relative))

    def _noise(self, relative: float) -> Noise:
        """Photos to come are compared at the size of those that are there."""
        settings = self.plan.request.settings
        pixels = float(np.mean([item.weight.size for item in self.plan.captures]))
        spp = max(_VERIFIED_LEAST, settings.iterations * settings.spp)
        return Noise(spp, relative, pixels / (self._size[0] * self._size[1]))

    def _information(
        self, seen: dict[str, Any], picture: np.ndarray, weight: np.ndarray, spp: int, noise: Noise
    ) -> Information:
        halves = (seen["jacobian_a"], seen["jacobian_b"])
        for index, name in enumerate(self.names):
            if not (np.isfinite(halves[0][index]).all() and np.isfinite(halves[1][index]).all()):
                raise BadInput(
                    Problem(
                        f"Parameter '{name}'",
                        "its derivative is not finite",
                        "narrow its bounds, or report this scene",
                    )
                )
        return information.information(halves, seen["variance"] * spp, picture, weight, noise)


class SuggestionJob:
    """A suggestion in a thread of its own: start, progress, cancel, join. Blender is not touched
    from there."""

    def __init__(self, suggestion: Suggestion) -> None:
        self.suggestion = suggestion
        self._step = Step(0.0, "")
        self._error: Exception | None = None
        self._cancelled = False
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self) -> None:
        """Returns at once."""
        self._thread.start()

    def progress(self) -> tuple[bool, Step]:
        """Whether it runs, and how far it has come."""
        return self._thread.is_alive(), self._step

    def cancel(self) -> None:
        """Asks the thread to stop; it does within a tile."""
        self._cancelled = True
        self.suggestion.cancel()

    def join(self) -> bool:
        """Waits for the end; False if it was cancelled. Raises what went wrong."""
        self._thread.join()
        if self._cancelled:
            return False
        if self._error is not None:
            raise self._error
        return True

    def _run(self) -> None:
        try:
            for step in self.suggestion.steps():
                self._step = step
                if self._cancelled:
                    return
        except Exception as error:  # told by `join`, in the thread that asked
            self._error = error


def suggestion_of(
    values: SceneValues,
    request: RunRequest,
    packed: Mapping[str, bytes],
    changes: Mapping[tuple[str, str], Values] | None = None,
) -> Suggestion:
    """From a request to a suggestion that can start. The values are the starts of the request, and
    `changes` for what is not fitted. Raises BadInput with all problems, and NativeUnavailable."""
    plan = prepare(values, replace(request, stages=()), packed)
    problems = [
        Problem(
            f"Parameter '{item.name}'",
            "a grid has too many values to tell what a photo adds",
            "leave it out, and name the others with --fit or the ticks of the panel",
        )
        for item in plan.fields
    ]
    count = sum(item.parameter.width for item in plan.unknowns)
    if count > _MOST_UNKNOWNS:
        cause = f"{count} numbers are unknown, a suggestion is made for up to {_MOST_UNKNOWNS}"
        problems.append(Problem("Fit", cause, "fit fewer parameters"))
    if problems:
        raise BadInput(problems)
    body = body_of(values, {item.owner for item in plan.unknowns})
    photographed = [item.camera for item in plan.captures]
    places = candidates(values, plan.scene, photographed, body)
    idle = [item.camera for item in places if not item.existing]
    starts = {(item.owner, item.parameter.name): item.start for item in plan.unknowns}
    scene = build_scene(replace(values, cameras=[*values.cameras, *idle]))
    scene = scene.with_values({**(changes or {}), **starts})
    return Suggestion(plan, scene, body, places)
