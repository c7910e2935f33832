# SPDX-License-Identifier: GPL-3.0-or-later
"""Error over CPU time of one fit, and when it has arrived. NumPy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Curve:
    """After `seconds` (k,) of CPU time, ascending, a fit that is stopped returns an answer with the
    mean relative `errors` (k,); before the first of them it has none."""

    seconds: np.ndarray
    errors: np.ndarray

    def __post_init__(self) -> None:
        if len(self.seconds) != len(self.errors) or not len(self.seconds):
            raise ValueError(f"{len(self.seconds)} seconds for {len(self.errors)} errors")
        if (np.diff(self.seconds) < 0).any():
            raise ValueError("seconds must ascend")

    def reached(self, level: float) -> float | None:
        """Seconds until the answer is within `level` for the first time; None: never."""
        inside = np.flatnonzero(self.errors < level)
        return float(self.seconds[inside[0]]) if len(inside) else None

    def converged(self, level: float, hold: float = 0.0) -> float | None:
        """Seconds from which on every answer is within `level`; None: not the last one, or the
        answers after it cover less than `hold` times those seconds, which may be chance."""
        if not self.errors[-1] < level:
            return None
        outside = np.flatnonzero(~(self.errors < level))
        since = float(self.seconds[outside[-1] + 1 if len(outside) else 0])
        return since if self.seconds[-1] - since >= hold * since else None

    def late_share(self, level: float) -> float:
        """Share of the answers of the last quarter of the time that are within `level`."""
        late = self.errors[self.seconds >= 0.75 * self.seconds[-1]]
        return float(np.mean(late < level))


def at_smallest(errors: np.ndarray, losses: np.ndarray) -> np.ndarray:
    """(k,) errors of the answer that has had the smallest absolute loss so far."""
    best = np.minimum.accumulate(np.abs(losses))
    newest = np.maximum.accumulate(np.where(np.abs(losses) == best, np.arange(len(losses)), 0))
    return np.asarray(errors)[newest]
