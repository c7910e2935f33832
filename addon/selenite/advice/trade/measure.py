# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits to pictures of the scene itself, whose values are known, within a time budget."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal, TypedDict

import numpy as np

from ... import native
from ...capture.prepared import Capture
from ...fit import cost
from ...fit.capture_render import evaluator
from ...fit.job import FitFailed, FitJob, fitted_values
from ...fit.plan import FitPlan
from ...fit.settings import FitSettings
from . import choices
from .choices import Choice

if TYPE_CHECKING:
    from ..._core import FitResult

#: Share of the budget for the photos, samples of one render of them, and their bounds.
_PHOTO_SHARE, _PHOTO_CHUNK, _PHOTO_LEAST, _PHOTO_MOST = 0.15, 16, 64, 1024
#: Beyond what a user can give as a seed: photos share no samples with fits.
_PHOTO_SEED = 1 << 40
_MOST_RUNS = 5
#: A fit that has taken so much longer than the budget left for it is given up.
_PATIENCE = 1.25
_PRESETS_FIRST = 0.5

Weights = Callable[[int], list[Capture]]  # height in pixels -> captures, for size and weight


class Run(TypedDict):
    """What was measured of one fit."""

    seconds: float
    cpu_seconds: float
    errors: dict[str, float]  # by name
    error: float


@dataclass
class Row:
    """What was measured with one choice.

    failure: why its fit came to no end; it is not run again.
    """

    choice: Choice
    expected_seconds: float
    runs: list[Run] = field(default_factory=list)
    failure: str = ""

    def mean(self, key: Literal["seconds", "cpu_seconds"]) -> float:
        """Over the runs; NaN without any."""
        return float(np.mean([run[key] for run in self.runs])) if self.runs else float("nan")

    def error(self) -> float:
        """Root mean square over the runs; NaN without any."""
        squares = [run["error"] ** 2 for run in self.runs]
        return float(np.sqrt(np.mean(squares))) if squares else float("nan")

    def errors(self) -> dict[str, float]:
        """The same for each unknown."""
        names = list(self.runs[0]["errors"]) if self.runs else []
        return {
            name: float(np.sqrt(np.mean([run["errors"][name] ** 2 for run in self.runs])))
            for name in names
        }


@dataclass(frozen=True)
class Step:
    """How far a measurement has come; `fraction` between 0 and 1."""

    fraction: float
    text: str


class Trade:
    """A measurement that is driven from outside: `for step in trade.steps(): ...`, and what has
    been found so far is in `rows` at any time.

    plan: unknowns whose start is the truth. weights: captures at a height, of which camera, size
    and weight are taken.
    """

    def __init__(self, plan: FitPlan, weights: Weights, budget: float, tallest: int) -> None:
        self.plan = plan
        self.budget = budget
        self.photo_spp = 0
        self.rows: list[Row] = []
        self.seconds = 0.0
        self._weights = weights
        self._tallest = tallest
        self._photos: list[np.ndarray] = []
        self._captures: dict[int, list[Capture]] = {}
        self._job: FitJob | None = None
        self._stop = threading.Event()

    def cancel(self) -> None:
        """From any thread: `steps` ends soon, and the row of the running fit stays without it."""
        self._stop.set()
        if self._job is not None:
            self._job.cancel()

    def steps(self) -> Iterator[Step]:
        """Photos, one timed fit, then round after round of fits, cheap ones first. Yields many
        times a second. Raises BadInput and FitFailed as FitJob does, FitFailed of the timed fit
        only: the failure of another one is noted in its row."""
        begin = time.monotonic()
        settings = choices.choices(self.plan.request.settings, self._tallest)
        yield from self._render_photos(begin)
        if self._stop.is_set():
            return
        per_path = self._time()
        if self._stop.is_set():
            return
        for choice in settings:
            self.rows.append(Row(choice, cost.expected(self.plan, choice.settings, per_path)))
        for run in range(_MOST_RUNS):
            for row in sorted(self.rows, key=_urgency):
                left = self.budget - (time.monotonic() - begin)
                if row.expected_seconds > left or len(row.runs) < run or row.failure:
                    continue
                if self._stop.is_set():
                    break
                try:
                    for _ in self._fit(row, run, left):
                        self.seconds = time.monotonic() - begin
                        text = f"run {run + 1} of '{row.choice.name}'"
                        yield Step(min(1.0, self.seconds / self.budget), text)
                except FitFailed as error:
                    row.failure = str(error)
        self.seconds = time.monotonic() - begin

    def captures(self, height: int) -> list[Capture]:
        """The captures of a height with our own photos in them."""
        if height not in self._captures:
            made = []
            for capture, photo in zip(self._weights(height), self._photos, strict=True):
                rows, columns = capture.reference.shape[:2]
                small = native.image().resize(photo, columns, rows)
                size = photo.shape[1], photo.shape[0]
                pixels = np.ascontiguousarray(small, np.float32)
                made.append(replace(capture, reference=pixels, photo_size=size))
            self._captures[height] = made
        return self._captures[height]

    def _render_photos(self, begin: float) -> Iterator[Step]:
        """As many samples as their share of the budget allows."""
        settings = self.plan.request.settings
        sums: list[np.ndarray | None] = [None] * len(self._weights(self._tallest))
        seen = evaluator(self.plan.scene, settings)
        while True:
            for index, capture in enumerate(self._weights(self._tallest)):
                film = seen.picture(
                    capture.view(of_file=False), _PHOTO_CHUNK,
                    seed=_PHOTO_SEED + settings.seed + (self.photo_spp << 20),
                )  # fmt: skip
                before = sums[index]
                image = film.image.astype(np.float64)
                sums[index] = image if before is None else before + image
                yield Step(0.0, f"photo {capture.id}")
                if self._stop.is_set():
                    return
            self.photo_spp += _PHOTO_CHUNK
            used = time.monotonic() - begin
            if self.photo_spp >= _PHOTO_MOST:
                break
            if self.photo_spp >= _PHOTO_LEAST and used > _PHOTO_SHARE * self.budget:
                break
        chunks = self.photo_spp / _PHOTO_CHUNK
        self._photos = [
            np.ascontiguousarray(total / chunks, np.float32) for total in sums if total is not None
        ]

    def _time(self) -> float:
        """Seconds per path of a short fit."""
        settings = replace(self.plan.request.settings, height=self._tallest)
        return cost.seconds_per_path(self._plan_of, settings, self._begun)

    def _begun(self, job: FitJob) -> None:
        self._job = job
        if self._stop.is_set():
            job.cancel()

    def _plan_of(self, settings: FitSettings) -> FitPlan:
        unknowns = [replace(item, start=choices.displaced(item)) for item in self.plan.unknowns]
        starts = {(item.owner, item.parameter.name): item.start for item in unknowns}
        return replace(
            self.plan,
            request=replace(self.plan.request, settings=settings),
            scene=self.plan.scene.with_values(starts),
            captures=self.captures(settings.height),
            unknowns=unknowns,
        )

    def _fit(self, row: Row, run: int, left: float) -> Iterator[None]:
        """One run; yields while it works."""
        settings = replace(row.choice.settings, seed=row.choice.settings.seed + run)
        plan = self._plan_of(settings)
        job = FitJob(plan)
        job.start()
        self._begun(job)
        try:
            while (state := job.progress()).running:
                if state.seconds > _PATIENCE * left:
                    job.cancel()
                time.sleep(0.02)
                yield
        finally:  # nobody may want it any more
            job.cancel()
            job.join()
        if state.stopped == native.core().StopReason.CANCELLED:
            return
        result = job.result()
        row.runs.append(_run(self.plan, plan, result))


def _urgency(row: Row) -> float:
    """Cheap ones first; a preset before a variation that costs half as much."""
    return row.expected_seconds * (_PRESETS_FIRST if row.choice.preset else 1.0)


def _run(truth: FitPlan, plan: FitPlan, result: FitResult) -> Run:
    values = fitted_values(plan, dict(result))
    errors = {
        item.name: choices.error_of(item, values[item.owner, item.parameter.name])
        for item in truth.unknowns
    }
    return {
        "seconds": result["seconds"],
        "cpu_seconds": result["cpu_seconds"],
        "errors": errors,
        "error": choices.total(truth.unknowns, errors),
    }
