# SPDX-License-Identifier: GPL-3.0-or-later
"""What photos determine: the native Fisher information, and the errors that follow from it.

All in the scale in which a fit steps (native `reparametrization`), n components of it. Weights and
instruments are those of a fit (native/fit/inference/fisher_information.h).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from typing import TYPE_CHECKING

import numpy as np

from ... import native
from ...fit.model_error import EXPLAINED, ModelError

if TYPE_CHECKING:
    from ..._core import FisherInformation, PhotoJacobian


@dataclass(frozen=True)
class Noise:
    """Of a photo's residual: samples of a pixel in the render that is compared with it, the error
    of the photo itself as a share of brightness, and how many of its pixels are one of the small
    picture whose derivatives are known. model: what a fit has left unexplained."""

    spp: float
    relative: float
    pixels: float
    model: ModelError = EXPLAINED


def information(
    seen: PhotoJacobian,
    picture: np.ndarray | None,
    weight: np.ndarray,
    noise: Noise,
) -> FisherInformation:
    """picture: the photo, (h, w, 3); None: the render in its place. weight: (h, w), 0 where a pixel
    does not count."""
    return native.core().fisher_information(
        seen, picture, weight, spp=noise.spp, relative=noise.relative, pixels=noise.pixels,
        model_error=astuple(noise.model),
    )  # fmt: skip


def weakest(photos: Sequence[FisherInformation]) -> float:
    """Of all directions the least information of the photos together, in standard deviations of its
    noise; 0 where a component is not seen."""
    found: float = native.core().weakest_direction(list(photos))
    return found


def errors(photos: Sequence[np.ndarray], ranges: np.ndarray) -> np.ndarray:
    """(n,): standard error of each component, those of the others being unknown too, from the
    precision of each photo. What no photo shows is as wide as its bounds, `ranges` (n,) apart,
    leave it.
    """
    found: np.ndarray = native.core().expected_errors(list(photos), ranges)
    return found


def determined(error: np.ndarray, ranges: np.ndarray) -> np.ndarray:
    """(n,) bool: as in a fit's report."""
    known: np.ndarray = native.core().determined(error, ranges)
    return known


def gain(before: np.ndarray, after: np.ndarray, groups: Sequence[Sequence[int]]) -> float:
    """Logarithm of the factor by which errors shrink, the mean over `groups` (the components of
    each parameter: a colour counts as much as a number). 0: nothing is gained."""
    found: float = native.core().information_gain(before, after, [list(g) for g in groups])
    return found
