# SPDX-License-Identifier: GPL-3.0-or-later
"""What a grid or image explains of the photos, and what is left as model error.

A residual that follows a texel through several photos is pattern. One that does not is model error.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from ..messages import message

if TYPE_CHECKING:
    from .._core import FitResult

#: Share of the squared residuals from which a pattern that is left is worth a word.
_WORTH_A_WORD = 0.05


@dataclass(frozen=True)
class Pattern:
    """explained: share of the squared residuals beside one value at all places. left: share of
    those at the end that photos agree on. model_error: the others, as a share of the photos'
    brightness."""

    explained: float
    left: float
    model_error: float

    def as_json(self) -> dict[str, float]:
        """For result.json."""
        return asdict(self)

    def sentence(self, name: str) -> str:
        """For the report."""
        explained, error = f"{self.explained:.0%}", f"{self.model_error:.1%}"
        if self.left < _WORTH_A_WORD:
            return message(
                "pattern.explains",
                "{name}: its pattern explains {explained} of the residual; model error {error} of "
                "the photos' brightness",
                name=name,
                explained=explained,
                error=error,
            )
        return message(
            "pattern.explains-in-part",
            "{name}: its pattern explains {explained} of the residual, and photos agree on {left} "
            "of the rest; model error {error} of the photos' brightness",
            name=name,
            left=f"{self.left:.0%}",
            explained=explained,
            error=error,
        )


def of_field(fit: FitResult, name: str) -> Pattern | None:
    """None where it is not known: the fit was stopped, or vertices are fitted."""
    found = fit.patterns.get(name)
    if found is None or math.isnan(found.explained):
        return None
    shares = [photo.unexplained for photo in fit.captures.values()]
    square = sum(share**2 for share in shares) / max(len(shares), 1)
    return Pattern(found.explained, found.left, math.sqrt(square * (1 - found.left)))
