# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders of a fit's photos at its start, its result, and any stored iteration."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...fit.capture_render import as_found, evaluator
from ...fit.plan import FitPlan
from ...fit.settings import FitSettings
from ...fit.staging.plan import constants
from ..finished_fit import FinishedFit

if TYPE_CHECKING:
    from ..._core import ProgressToken, Scene

START, RESULT = -1, -2
#: Samples per pixel of a pass. A picture of an iteration has one; start and result have as many as
#: the settings ask for.
_SPP = 16
#: The picture of the start is for the eye alone: it has a part of the samples of the result's.
_SHARE_OF_START = 4
_CACHED = 64 << 20  # bytes of pictures that are kept


def start_spp(settings: FitSettings) -> int:
    """Samples of a picture of the start."""
    return max(settings.picture_spp // _SHARE_OF_START, 1)


@dataclass(frozen=True)
class Moment:
    """One picture: which photo (its index), and the row of the history, START or RESULT."""

    photo: int
    row: int


class Moments:
    """Renders on demand and keeps what was rendered last. The object may be asked from one thread
    while `render` works in another: what is shared is replaced as a whole."""

    def __init__(self, plan: FitPlan, result: FinishedFit) -> None:
        self.plan = plan
        self.result = result
        self._kept: OrderedDict[Moment, np.ndarray] = OrderedDict()

    @property
    def iterations(self) -> np.ndarray:
        """(k,): the iteration of each row of the history."""
        return self.result.fit.history.iteration

    def values(self, row: int) -> dict[str, tuple[float, ...]]:
        """Name -> value at a moment."""
        if row == START:
            return {item.name: item.start for item in self.plan.unknowns}
        if row == RESULT:
            return {name: tuple(value) for name, value in self.result.fit.values_best.items()}
        columns = self.result.fit.history.values
        return {name: tuple(rows[row].tolist()) for name, rows in columns.items()}

    def scene(self, row: int) -> Scene:
        """With these values. Of grids and images the history keeps means alone: those of the result
        stand at every moment but the start."""
        if row == START:
            return self.plan.scene
        scene = self.result.scene(self.plan)
        if row == RESULT:
            return scene
        return scene.with_values(constants(self.values(row), self.plan.unknowns, self.plan.fields))

    def kept(self, moment: Moment) -> np.ndarray | None:
        """The picture, where it was rendered before."""
        return self._kept.get(moment)

    def render(self, moment: Moment, progress: ProgressToken | None = None) -> np.ndarray:
        """(h, w, 3), as the photo would show it: aligned, times its gain. Raises RuntimeError where
        `progress`, a native ProgressToken, was cancelled."""
        found = self._kept.get(moment)
        if found is None:
            found = self._rendered(moment, progress)
            self._keep(moment, found)
        return found

    def _rendered(self, moment: Moment, progress: ProgressToken | None) -> np.ndarray:
        """In passes of few samples: a render can be cancelled between two tiles, and a tile takes
        as long as it has samples."""
        capture = self.plan.captures[moment.photo]
        settings = self.plan.request.settings
        spp = start_spp(settings) if moment.row == START else settings.picture_spp
        passes = 1 if moment.row >= 0 else -(-spp // _SPP)
        scene = evaluator(self.scene(moment.row), settings)
        photo = as_found(capture, self.result.fit).view()
        total = np.zeros(capture.reference.shape, np.float64)
        for number in range(passes):
            total += scene.picture(
                photo, min(_SPP, spp), seed=settings.seed + number,
                progress=progress,
            ).image  # fmt: skip
        return (total / passes).astype(np.float32)

    def _keep(self, moment: Moment, picture: np.ndarray) -> None:
        kept = OrderedDict(self._kept)
        kept[moment] = picture
        while len(kept) > 4 and sum(item.nbytes for item in kept.values()) > _CACHED:
            kept.popitem(last=False)
        self._kept = kept
