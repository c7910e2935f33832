# SPDX-License-Identifier: GPL-3.0-or-later
"""Expected seconds and errors of each preset: from a short fit and the Fisher information."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...fit import cost
from ...fit.job import FitJob
from ...fit.plan import FitPlan
from ...fit.settings import PRESETS, FitSettings
from ...fit.unknowns import Unknown, labels
from ..information.job import Step
from ..information.photo_information import RELATIVE, PhotoInformation
from . import choices

#: Share of the time that the short fit has in the progress.
_TIMING = 0.4


@dataclass(frozen=True)
class Expected:
    """Of a fit with one preset. errors: of each unknown, in their order, the root mean square over
    its components in the units of `selenite trade`; None where the photos do not determine it.
    Empty where no errors are known."""

    seconds: float
    unknowns: Sequence[Unknown] = ()
    errors: Sequence[float | None] = ()

    @property
    def error(self) -> float | None:
        """Root mean square over what is determined, as in `selenite trade`."""
        found = self._determined()
        if not found:
            return None
        return choices.total([item for item, _ in found], {u.name: e for u, e in found})

    @property
    def left_open(self) -> list[Unknown]:
        """What is not determined."""
        pairs = zip(self.unknowns, self.errors, strict=True)
        return [item for item, error in pairs if error is None]

    def text(self) -> str:
        """As in "about 95 s, error 0.02 (worst: IOR 0.06; not determined: Transmission)"."""
        text = seconds_text(self.seconds)
        found, words = self._determined(), labels(self.unknowns)
        remarks = []
        if len(found) > 1:
            worst, size = max(found, key=lambda pair: pair[1])
            remarks.append(f"worst: {words[worst.name]} {size:.2g}")
        if self.left_open:
            names = ", ".join(words[item.name] for item in self.left_open)
            remarks.append(f"not determined: {names}")
        if found:
            text += f", error {self.error:.2g}"
        return text + (f" ({'; '.join(remarks)})" if remarks else "")

    def as_json(self) -> dict[str, object]:
        """Seconds, error (null where nothing is known) and the errors by name, null where not
        determined."""
        pairs = zip(self.unknowns, self.errors, strict=True)
        return {
            "expected_seconds": self.seconds,
            "expected_error": self.error,
            "expected_errors": {item.name: error for item, error in pairs},
        }

    def _determined(self) -> list[tuple[Unknown, float]]:
        pairs = zip(self.unknowns, self.errors, strict=True)
        return [(item, error) for item, error in pairs if error is not None]


def seconds_text(seconds: float) -> str:
    """The estimate is good to about a third."""
    return f"about {seconds:.0f} s" if seconds < 100 else f"about {seconds / 60:.0f} min"


class Estimate:
    """Driven from outside: `for step in estimate.steps(): ...`; then `presets`.

    Errors are those that the fit's own report would give at the plan's start values.
    """

    def __init__(self, plan_of: Callable[[FitSettings], FitPlan], settings: FitSettings) -> None:
        """plan_of: the plan with given settings. settings: what no preset sets, and the height at
        which a fit is timed. Raises BadInput and NativeUnavailable."""
        self._plan_of, self._settings = plan_of, settings
        self._plan = plan_of(replace(settings, height=PRESETS["draft"].height))
        self.presets: dict[str, Expected] = {}
        #: Why there are no errors, or what to know about them; "" for nothing.
        why_not = cost.too_many(self._plan)
        self.remark = f"Errors are not estimated: {why_not}" if why_not else ""
        self._photos = None if self.remark else PhotoInformation(self._plan, self._plan.scene)
        self._job: FitJob | None = None
        self._cancelled = False

    @property
    def warnings(self) -> list[str]:
        """What the plan has to say."""
        return self._plan.warnings

    def cancel(self) -> None:
        """From any thread: `steps` ends within a tile."""
        self._cancelled = True
        if self._job is not None:
            self._job.cancel()
        if self._photos is not None:
            self._photos.cancel()

    def steps(self) -> Iterator[Step]:
        """Raises BadInput and FitFailed as FitJob does, and the native Cancelled."""
        yield Step(0.0, "two iterations")
        per_path = cost.seconds_per_path(self._plan_of, self._settings, self._begun)
        if self._cancelled:
            return
        if self._photos is not None:
            for step in self._photos.at_photos():
                yield replace(step, fraction=_TIMING + (1 - _TIMING) * step.fraction)
            if self._photos.relative >= RELATIVE[1]:
                self.remark = (
                    "The photos differ from the render at these values by "
                    f"{100 * RELATIVE[1]:.0f} % of their brightness or more. Errors hold near the "
                    "right values: estimate again after the fit"
                )
        for name, preset in choices.preset_settings(self._settings).items():
            errors = () if self._photos is None else errors_of(self._photos, preset)
            seconds = cost.expected(self._plan, preset, per_path)
            unknowns = self._plan.unknowns if errors else ()
            self.presets[name] = Expected(seconds, unknowns, errors)
        yield Step(1.0, "")

    def lines(self) -> list[str]:
        """Preset by preset, and the remark."""
        found = [f"{name.capitalize()}: {item.text()}" for name, item in self.presets.items()]
        return [*found, self.remark] if self.remark else found

    def _begun(self, job: FitJob) -> None:
        self._job = job
        if self._cancelled:
            job.cancel()


def errors_of(photos: PhotoInformation, settings: FitSettings) -> list[float | None]:
    """As Expected.errors, of a fit with these settings; photos: after `at_photos`."""
    steps, known = photos.errors(settings)
    found: list[float | None] = []
    for item, group in zip(photos.plan.unknowns, photos.groups, strict=True):
        size = steps[group] * photos.slope[group]
        if item.by_ratio:
            size = size / np.asarray(item.start)
        found.append(float(np.sqrt(np.mean(size**2))) if known[group].all() else None)
    return found
