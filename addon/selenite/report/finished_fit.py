# SPDX-License-Identifier: GPL-3.0-or-later
"""A fit that has ended, and what was found out about it since."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ..fit.fields import FieldUnknown
from ..fit.job import scene_at
from ..fit.plan import FitPlan
from ..parameters import Values

if TYPE_CHECKING:
    from .._core import FitResult, Scene
    from .halves import Halves
    from .hold_out import Compared

Intervals = Sequence[tuple[float, float]]


@dataclass(frozen=True)
class FinishedFit:
    """notes: sentences for the user. finished_fields, coverage and fitted_means: of images whose
    texels no photo sees were kept or filled, what photos see of each texel, and the means before.
    gain_intervals: by id, where they are wider than those of the fit. halves: by the image's name.
    hold_out: photos that the fit has not seen. doubtful_shifts: id -> why."""

    fit: FitResult
    notes: tuple[str, ...] = ()
    finished_fields: Mapping[str, np.ndarray] | None = None
    coverage: Mapping[str, np.ndarray] = field(default_factory=dict)
    fitted_means: Mapping[str, Values] = field(default_factory=dict)
    gain_intervals: Mapping[str, Intervals] = field(default_factory=dict)
    halves: Mapping[str, Halves] = field(default_factory=dict)
    hold_out: Sequence[Compared] = ()
    doubtful_shifts: Mapping[str, str] = field(default_factory=dict)

    @property
    def fields(self) -> Mapping[str, np.ndarray]:
        """The best values of grids and images."""
        return self.fit.fields_best if self.finished_fields is None else self.finished_fields

    def scene(self, plan: FitPlan) -> Scene:
        """The plan's scene with the best values."""
        return scene_at(plan, self.fit, self.fields)

    def gain_interval(self, capture: str) -> Intervals | None:
        """Of 90 %, by channel; None where the photo's gain is not free."""
        found = self.fit.captures.get(capture)
        return self.gain_intervals.get(capture, found.gain_interval_90 if found else None)

    def mean(self, item: FieldUnknown) -> Values:
        """As in the history: of the texels as they were fitted, before they were finished."""
        return self.fitted_means.get(item.name) or item.mean(self.fields[item.name])
