# SPDX-License-Identifier: GPL-3.0-or-later
"""How well a fitted scene renders photos, those that no fit has seen above all."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..capture.prepared import Capture
from ..capture.request import CaptureRequest
from ..fit.capture_render import evaluator
from ..fit.settings import FitSettings
from ..messages import message
from .pictures import comparison, sheet

if TYPE_CHECKING:
    from .._core import Scene

#: In the folder of a fit that held photos out.
SHEET = "hold_out.png"
#: Standard errors of a squared error below which noise hides it, and those of its upper limit.
_HIDDEN, _LIMIT = 2.0, 1.645
#: Between the seeds of renders that are added up: more than photos have.
_SEEDS = 100_003


@dataclass(frozen=True)
class SquaredError:
    """Sums over the pixels of a mask: of the squared difference without the noise of renders, its
    variance, and of the squared photo."""

    difference: float
    variance: float
    light: float

    def __add__(self, other: SquaredError) -> SquaredError:
        return SquaredError(
            self.difference + other.difference,
            self.variance + other.variance,
            self.light + other.light,
        )

    def as_json(self) -> dict[str, float | None]:
        """Keys of a photo, or of all, in compare.json."""
        return {"relative_error": self.relative, "at_most": self.at_most}

    @property
    def relative(self) -> float | None:
        """Root mean square over that of the photos; None where noise of the renders hides it."""
        square, deviation = self._relative_to_light()
        return None if square <= _HIDDEN * deviation else math.sqrt(square)

    @property
    def at_most(self) -> float:
        """Its upper limit, of 95 %."""
        square, deviation = self._relative_to_light()
        return math.sqrt(max(square, 0.0) + _LIMIT * deviation)

    @property
    def noise(self) -> float:
        """Standard error of `relative`, as a share of it."""
        square, deviation = self._relative_to_light()
        return deviation / (2 * square) if square > 0 else math.inf

    def percent(self) -> str:
        """In words."""
        if self.relative is None:
            return message(
                "hold_out.at-most-hidden-noise",
                "at most {percent} %, hidden by noise",
                percent=f"{100 * self.at_most:.2g}",
            )
        return f"{100 * self.relative:.3g} %"

    def _relative_to_light(self) -> tuple[float, float]:
        """The squared difference and its deviation."""
        light = max(self.light, 1e-30)
        return self.difference / light, math.sqrt(self.variance) / light


NOTHING = SquaredError(0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Compared:
    """A photo beside its render, the mean of two halves with noise of their own. spp: of both
    together. `own`: the same with the gain that suits the photo best."""

    capture: Capture
    halves: tuple[np.ndarray, np.ndarray]
    spp: int
    error: SquaredError
    own: SquaredError
    own_gain: tuple[float, float, float]

    @property
    def render(self) -> np.ndarray:
        """(h, w, 3)."""
        return ((self.halves[0] + self.halves[1]) / 2).astype(np.float32)

    def as_json(self) -> dict[str, object]:
        """Keys of a photo in compare.json."""
        return {
            **self.error.as_json(),
            "with_own_gain": self.own.as_json(),
            "own_gain": list(self.own_gain),
            "gain": list(self.capture.gain),
            "mask_share": self.capture.mask_share,
        }


def compare(
    scene: Scene,
    capture: Capture,
    settings: FitSettings,
    spp: int,
    before: Compared | None = None,
) -> Compared:
    """Renders the photo twice, by random numbers of their own: products of both differences have no
    bias by their noise. The own gain is one factor, or one of each channel where the capture's gain
    is free by channel. before: what fewer samples have shown, which count too."""
    renders, view = evaluator(scene, settings), capture.view()
    known = 0 if before is None else before.spp // 2
    each = max(1, spp // 2)
    halves = []
    for half in range(2):
        # Each number of samples has random numbers of its own.
        seed = 2 * settings.seed + half + _SEEDS * known
        seen = renders.picture(view, each - known, seed=seed).image.astype(float)
        halves.append(seen)
        if before is not None:
            halves[half] += (before.halves[half] - seen) * known / each
    photo, weight = capture.reference.astype(float), capture.weight.astype(float)[..., None]
    axes = (0, 1) if capture.free_gain == "rgb" else (0, 1, 2)
    strength = (weight * halves[0] * halves[1]).sum(axis=axes)
    common = (weight * photo * (halves[0] + halves[1]) / 2).sum(axis=axes)
    gain = np.where((strength > 0) & (common > 0), common / np.maximum(strength, 1e-30), 1.0)
    gain = np.broadcast_to(gain, 3)
    return Compared(
        capture,
        (halves[0], halves[1]),
        2 * each,
        squared_error(halves, photo, weight),
        squared_error([half * gain for half in halves], photo, weight),
        (float(gain[0]), float(gain[1]), float(gain[2])),
    )


def squared_error(
    halves: Sequence[np.ndarray], photo: np.ndarray, weight: np.ndarray
) -> SquaredError:
    """halves: renders (h, w, 3) with noise of their own; weight: (h, w, 1)."""
    first, second = (half - photo for half in halves)
    products = weight * first * second
    noise = np.square(first - second)  # twice the variance of one
    # Of m^2 + m (a + b) + a b; the channels of a pixel come from the same paths.
    spread = np.sqrt(np.maximum(first * second, 0) * noise + np.square(noise) / 12)
    of_pixels = np.square((weight * spread).sum(axis=-1))
    return SquaredError(
        float(products.sum()), float(of_pixels.sum()), float((weight * np.square(photo)).sum())
    )


@dataclass(frozen=True)
class Comparison:
    """Of several photos. fitted: ids of those that the fit has seen."""

    rows: Sequence[Compared]
    fitted: Sequence[str] = ()

    @property
    def error(self) -> SquaredError:
        """Of all photos together."""
        return sum((row.error for row in self.rows), NOTHING)

    @property
    def own(self) -> SquaredError:
        """The same, each photo with the gain that suits it best."""
        return sum((row.own for row in self.rows), NOTHING)

    def as_json(self) -> dict[str, object]:
        """For compare.json, and for result.json of a fit that held photos out."""
        captures = {
            row.capture.id: row.as_json() | {"fitted": row.capture.id in self.fitted}
            for row in self.rows
        }
        own = self.own.as_json()
        return {**self.error.as_json(), "with_own_gain": own, "captures": captures}

    def sentence(self) -> str:
        """Of a fit that held them out."""
        count = f"{len(self.rows)} photos" if len(self.rows) > 1 else "1 photo"
        return message(
            "hold_out.held-out-off-gain",
            "Held out: {count}, off by {percent}, with a gain of their own by {own}",
            count=count,
            percent=self.error.percent(),
            own=self.own.percent(),
        )


def fitted_among(captures: Sequence[Capture], asked: Sequence[CaptureRequest]) -> list[str]:
    """Ids of those whose photo a fit has compared with. asked: the captures of its run."""
    files = {Path(item.photo).name: item for item in asked if item.photo}
    found = []
    for item in captures:
        same = files.get(Path(item.photo).name)
        if same is not None and _same_file(item.photo, same.photo):
            found.append(item.id)
    return found


def _same_file(one: str, other: str) -> bool:
    try:
        return one == other or Path(one).samefile(other)
    except OSError:
        return False


def write_sheet(rows: Iterable[Compared], path: Path) -> None:
    """Photo, render, difference, and both again with the own gain. Raises OSError."""
    shown = {}
    for row in rows:
        photo, weight = row.capture.reference, row.capture.weight
        scaled = row.render * np.asarray(row.own_gain, np.float32)
        shown[row.capture.id] = {
            "photo": comparison.marked(photo, weight),
            "render": comparison.marked(row.render, weight),
            "|render - photo|": comparison.difference(row.render, photo, weight),
            "with its own gain": comparison.marked(scaled, weight),
            "|difference|": comparison.difference(scaled, photo, weight),
        }
    masked = any(bool((row.capture.weight <= 0).any()) for row in rows)
    sheet.sheet(shown, comparison.ERROR_SCALE, masked=masked).write(path)


def compare_all(
    scene: Scene,
    captures: Sequence[Capture],
    settings: FitSettings,
    spp: int,
    progress: Callable[[str, float], None] = lambda _text, _fraction: None,
    before: Sequence[Compared] = (),
) -> list[Compared]:
    """`compare` for each photo. before: the same of fewer samples."""
    rows = []
    for index, capture in enumerate(captures):
        progress(capture.id, index / len(captures))
        own = replace(settings, seed=settings.seed + index)
        rows.append(compare(scene, capture, own, spp, before[index] if before else None))
    return rows
