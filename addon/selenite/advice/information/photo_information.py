# SPDX-License-Identifier: GPL-3.0-or-later
"""Small pictures with their derivatives, at fixed values: of photos, and of places without one."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ... import native
from ...capture.light_states import most_common
from ...capture.prepared import Capture
from ...capture.window import WHOLE
from ...fit import cost
from ...fit.capture_render import evaluator
from ...fit.plan import FitPlan
from ...fit.settings import FitSettings
from ...problems import BadInput, Problem
from . import fisher
from .fisher import EXPLAINED, ModelError, Noise
from .job import Step

if TYPE_CHECKING:
    from ..._core import FisherInformation, Photo, PhotoJacobian, Scene

#: Samples of the first pass at a photo's camera.
PHOTO_SPP = 64
#: Usual bounds of the second pass, see `PhotoInformation.at_photos`.
_DOUBT, _MOST_SPP, _WEAKEST = 0.1, 192, 6.0
#: Pixels of a Jacobian's picture, whatever its aspect.
_PIXELS = 64 * 64
#: A residual's relative size beyond noise is believed between these; samples to measure it with.
RELATIVE, _RESIDUAL_SPP = (0.002, 0.05), 32
#: Seeds that no fit and no photo of ours uses.
_SEED = 1 << 41


@dataclass(frozen=True)
class Seen:
    """What a camera shows. jacobian: native, of d picture / d component. picture: the photo; None:
    the render stands in its place. weight: (h, w), 0 where a pixel does not count."""

    jacobian: PhotoJacobian
    picture: np.ndarray | None
    weight: np.ndarray

    def information(self, noise: Noise) -> FisherInformation:
        """About the unknowns, of a photo with this noise."""
        return fisher.information(self.jacobian, self.picture, self.weight, noise)


class PhotoInformation:
    """At the cameras of a scene, for the unknowns of a plan.

    plan: unknowns whose starts are the values that count, and the photos. scene: native, with these
    values and every camera that is asked for. model_error: of the fit that found the values.
    """

    def __init__(
        self,
        plan: FitPlan,
        scene: Scene,
        model_error: ModelError = EXPLAINED,
    ) -> None:
        self.plan = plan
        self._model_error = model_error
        self._scene = scene
        self._evaluator = evaluator(scene, plan.request.settings)
        self._asked = [item.native() for item in plan.unknowns]
        found = native.core().reparametrization(scene, self._asked)
        #: Of the components, in the order of the unknowns: "Body:base_color[0]".
        self.names: list[str] = list(found["names"])
        #: Of the components: d parameter / d coordinate, and how far a coordinate's bounds are.
        self.slope, self.ranges = found["slope"], found["range"]
        widths = np.cumsum([0] + [item.parameter.width for item in plan.unknowns])
        #: Components of each unknown.
        self.groups = [list(range(a, b)) for a, b in zip(widths, widths[1:], strict=False)]
        #: After `at_photos`: error of the photos as a share of brightness; by how much one sample
        #: leaves the information open (native `relative_uncertainty`), the worst photo's.
        self.relative = self.doubt = 0.0
        self._seen: list[Seen] = []  # of each photo
        #: The light state that most photos have: that of a photo to come.
        self.usual_lights = most_common([item.lights for item in plan.captures])
        self._token = native.core().ProgressToken()

    def cancel(self) -> None:
        """From any thread: a pass ends within a tile, raising the native Cancelled."""
        self._token.cancel()

    def at_photos(
        self, doubt: float = _DOUBT, most_spp: int = _MOST_SPP, weakest: float = _WEAKEST
    ) -> Iterator[Step]:
        """A pass at each photo's camera; where that leaves more doubt than is permitted, as a share
        of the information, a second one, with at most `most_spp` samples in all; with so many where
        a direction has less than `weakest` (as fisher.weakest). A capture without a photo
        counts as if its photo were the render. Raises BadInput for derivatives that are not finite,
        and the native Cancelled."""
        photos = self.plan.captures
        square = 0.0
        for index, capture in enumerate(photos):
            yield Step(0.2 * index / len(photos), f"photo {capture.id}")
            square += self._relative_error(capture) / len(photos)
        self.relative, self._seen = math.sqrt(square), []
        for index, capture in enumerate(photos):
            yield Step(0.2 + 0.4 * index / len(photos), f"photo {capture.id}")
            self._seen.append(self._at_photo(capture, PHOTO_SPP, 1))
        settings = self.plan.request.settings
        there = self.informations(settings)
        self.doubt = PHOTO_SPP * max(one.relative_uncertainty() for one in there)
        wanted = most_spp if fisher.weakest(there) < weakest else self.doubt / doubt
        spp = int(np.clip(wanted, PHOTO_SPP, most_spp)) - PHOTO_SPP
        for index, capture in enumerate(photos if spp > 0 else ()):
            yield Step(0.6 + 0.4 * index / len(photos), f"photo {capture.id}, second pass")
            self._seen[index].jacobian.join(self._at_photo(capture, spp, 2).jacobian)

    def informations(self, settings: FitSettings) -> list[FisherInformation]:
        """After `at_photos`: of each photo, for a fit with these settings."""
        noise = self.noise(settings)
        return [seen.information(noise) for seen in self._seen]

    def errors(self, settings: FitSettings) -> tuple[np.ndarray, np.ndarray]:
        """After `at_photos`: standard errors of such a fit, (n,), in the coordinates of steps, and
        whether it will report them as determined, (n,) bool."""
        photos = [one.precision() for one in self.informations(settings)]
        found = fisher.errors(photos, self.ranges)
        return found, fisher.determined(found, self.ranges)

    def _at_photo(self, capture: Capture, spp: int, number: int) -> Seen:
        """Passes of other numbers have other random numbers."""
        small = capture.small(_size_of(capture))
        seen = self._at(small.view(), spp, number)
        return Seen(seen, small.reference if capture.photo else None, small.weight)

    def at_place(self, camera: str, spp: int, number: int) -> Seen:
        """From where there is no photo: all pixels count, size and shape are those of the first
        photo, without its crop, and the lights are `usual_lights`. Raises as `at_photos`."""
        first = self.plan.captures[0]
        size, frame = _size_of(first), first.frame
        if first.window != WHOLE:
            rows = math.sqrt(size[0] * size[1] / first.aspect)
            size = max(1, round(rows * first.aspect)), max(1, round(rows))
            frame = (first.aspect, 0, 0)
        photo = native.core().Photo(camera, size=size, frame=frame, lights=self.usual_lights)
        weight = np.ones(size[::-1], np.float32)
        return Seen(self._at(photo, spp, number), None, weight)

    def noise(self, settings: FitSettings) -> Noise:
        """After `at_photos`: of a fit with these settings; photos to come are compared at the size
        of those that are there, and are as good."""
        photos = self.plan.captures
        pixels = cost.pixels_at(photos, settings.height) / len(photos)
        spp = native.core().refinement_spp(settings.native())
        seen = sum(math.prod(_size_of(photo)) for photo in photos) / len(photos)
        return Noise(spp, self.relative, pixels / seen, self._model_error)

    def _relative_error(self, capture: Capture) -> float:
        """Mean square of what a photo differs by, relative to its brightness, beyond the noise of
        the render: noise of the photo, and what no unknown explains. Kept within RELATIVE; the
        least where there is no photo."""
        low, high = RELATIVE
        if not capture.photo:
            return low**2
        seed = _SEED + 8 * self.plan.request.settings.seed
        found = self._evaluator.misfit(
            capture.native(), _RESIDUAL_SPP, seed=seed, progress=self._token
        )
        return float(np.clip(found, low**2, high**2))

    def _at(self, photo: Photo, spp: int, number: int) -> PhotoJacobian:
        seed = _SEED + 8 * self.plan.request.settings.seed + number
        seen = self._evaluator.jacobian(photo, self._asked, spp, seed=seed, progress=self._token)
        if seen.not_finite:
            raise BadInput(
                [
                    Problem(
                        f"Parameter '{name}'",
                        "its derivative is not finite",
                        "narrow its bounds, or report this scene",
                    )
                    for name in seen.not_finite
                ]
            )
        return seen


def _size_of(capture: Capture) -> tuple[int, int]:
    """Width and height of a Jacobian's picture, of the photo's shape."""
    height, width = capture.reference.shape[:2]
    scale = min(1.0, math.sqrt(_PIXELS / (width * height)))
    return max(1, round(width * scale)), max(1, round(height * scale))
