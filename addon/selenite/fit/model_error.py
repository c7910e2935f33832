# SPDX-License-Identifier: GPL-3.0-or-later
"""What residuals show that no values of the unknowns explain."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ModelError:
    """Standard deviations: shares of a pixel's and of the mean brightness, and pixels along the
    photo's gradient. See docs/method/losses.md."""

    relative: float = 0.0
    absolute: float = 0.0
    shift: float = 0.0


EXPLAINED = ModelError()
