# SPDX-License-Identifier: GPL-3.0-or-later
"""Ranks the places that a photo could be taken from, by the information it would add."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ...capture.prepared import Capture
from ...fit.plan import FitPlan, build_scene, prepare
from ...fit.request import RunRequest
from ...parameters import Values
from ...problems import BadInput, Problem
from ...scene_read.values import SceneValues
from ..information import fisher
from ..information.job import Step
from ..information.photo_information import PHOTO_SPP, PhotoInformation
from .candidates import Body, Candidate, body_of, candidates

if TYPE_CHECKING:
    from ..._core import Scene

#: Bounds of the samples of all passes but the first at a photo's camera.
_LEAST_SPP, _MOST_SPP = 16, 256
#: Permitted error of what a place adds, as a share of what the photos say: in the first pass over
#: every place, and in the second from the best of them.
_FIRST_DOUBT, _SECOND_DOUBT = 0.25, 0.1
#: Standard deviations of noise that information has to exceed; a false alarm of the first pass
#: costs a second one and no more.
_FIRST_RESOLVED, _SECOND_RESOLVED = 2.0, 3.0
#: The best share of the places has a second pass.
_AGAIN, _LEAST_AGAIN = 0.15, 4
#: An error so much smaller than the range needs no further photo.
_WELL = 0.01
#: Slots of one render.
_MOST_UNKNOWNS = 24


@dataclass(frozen=True)
class Row:
    """A place and what a photo from there would leave of the standard errors, (n,) in units of the
    parameters. gain: see `fisher.gain`. known: (n,) bool, determined then."""

    candidate: Candidate
    gain: float
    errors: np.ndarray
    known: np.ndarray


class Suggestion:
    """Driven from outside: `for step in suggestion.steps(): ...`; then `rows`, the best first.

    plan: unknowns whose starts are the values that count, and the photos. scene: native, with these
    values and the candidates' cameras.
    """

    def __init__(
        self,
        plan: FitPlan,
        scene: Scene,
        body: Body,
        places: list[Candidate],
        model_error: fisher.ModelError = fisher.EXPLAINED,
    ) -> None:
        self.plan, self.body, self.places = plan, body, places
        self.rows: list[Row] = []
        self.seconds = 0.0
        self._photos = PhotoInformation(plan, scene, model_error)
        self.names, self.groups = self._photos.names, self._photos.groups
        self._slope, self._ranges = self._photos.slope, self._photos.ranges
        #: Light state of a photo to come.
        self.lights = self._photos.usual_lights
        #: Standard errors with the photos there are, (n,), and which are determined.
        self.errors = self.known = np.zeros(len(self.names))
        #: Whether all are known within a hundredth of their range.
        self.well_known = False
        #: Gain of another photo like the first one, from the same place.
        self.repeated = 0.0

    def cancel(self) -> None:
        """From any thread: `steps` ends within a tile, raising the native Cancelled."""
        self._photos.cancel()

    def steps(self) -> Iterator[Step]:
        """A pass at each photo's camera, one at each place, and a second one with fresh seeds and
        more samples at the best: what is reported of these comes from the second pass alone, so
        that no selection bias of the first is in it."""
        begin = time.monotonic()
        places = self.places
        for step in self._photos.at_photos(_SECOND_DOUBT, _MOST_SPP):
            yield replace(step, fraction=0.1 * step.fraction)
        # Places that are as noisy need as many samples; the error falls as the samples rise.
        first_spp = int(np.clip(self._photos.doubt / _FIRST_DOUBT, _LEAST_SPP, _MOST_SPP / 4))
        second_spp = int(np.clip(self._photos.doubt / _SECOND_DOUBT, PHOTO_SPP, _MOST_SPP))
        settings = self.plan.request.settings
        noise = self._photos.noise(settings)
        there = self._photos.informations(settings)
        base = [one.precision() for one in there]
        before = fisher.errors(base, self._ranges)
        self.errors, self.known = before * self._slope, fisher.determined(before, self._ranges)
        self.well_known = bool((before < _WELL * self._ranges).all())
        twice = fisher.errors([*base, base[0]], self._ranges)
        self.repeated = fisher.gain(before, twice, self.groups)

        def row(place: Candidate, spp: int, number: int, resolved: float) -> Row:
            seen = self._photos.at_place(place.camera.name, spp, number).information(noise)
            added = seen.precision(resolved)
            after = fisher.errors([*base, added], self._ranges)
            gained = fisher.gain(before, after, self.groups)
            known = fisher.determined(after, self._ranges)
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
            yield Step(0.1 + 0.9 * done / work, f"second pass {index + 1} of {again}")
            second.append(row(item.candidate, second_spp, 4, _SECOND_RESOLVED))
            done += second_spp
        second.sort(key=lambda item: -item.gain)
        self.rows = second + first[again:]
        self.seconds = time.monotonic() - begin
        yield Step(1.0, "")


def suggestion_of(
    values: SceneValues,
    request: RunRequest,
    packed: Mapping[str, bytes],
    changes: Mapping[tuple[str, str], Values] | None = None,
    model_error: fisher.ModelError = fisher.EXPLAINED,
    as_taken: Callable[[Capture], Capture] = lambda capture: capture,
) -> Suggestion:
    """From a request to a suggestion that can start. The values are the starts of the request, and
    `changes` for what is not fitted. model_error: of the fit that found them; as_taken: a photo
    with the gain and alignment that it has found. Raises BadInput with all problems, and
    NativeUnavailable."""
    plan = prepare(values, replace(request, stages=()), packed)
    plan = replace(plan, captures=[as_taken(item) for item in plan.captures])
    problems = [
        Problem(
            f"Parameter '{item.name}'",
            "a grid or image has too many values to compute what a photo adds",
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
    return Suggestion(plan, scene, body, places, model_error)
