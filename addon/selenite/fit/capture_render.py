# SPDX-License-Identifier: GPL-3.0-or-later
"""What photos show of a scene, and what a fit has found of how they were taken."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from .. import native
from ..capture.prepared import Alignment, Capture
from .settings import FitSettings

if TYPE_CHECKING:
    from .._core import Evaluator, FitResult, Scene


def evaluator(scene: Scene, settings: FitSettings) -> Evaluator:
    """Of pictures and derivatives at a scene's values, as a fit with these settings makes them."""
    return native.core().Evaluator(scene, depth=settings.depth, threads=settings.threads)


def as_found(capture: Capture, fit: FitResult) -> Capture:
    """The capture with the gain and alignment that a fit has found."""
    found = fit.captures.get(capture.id)
    gain = found.gain if found is not None else None
    return replace(capture, gain=gain or capture.gain, alignment=alignment_of(capture, fit))


def like(capture: Capture, other: Capture | None) -> Capture:
    """The capture with gain and alignment of another one of its photo, maybe of another size."""
    if other is None:
        return capture
    factor = capture.reference.shape[0] / other.reference.shape[0]
    across, down, roll = other.alignment
    return replace(capture, gain=other.gain, alignment=(across * factor, down * factor, roll))


def alignment_of(capture: Capture, fit: FitResult) -> Alignment:
    """What a fit has found, for a picture of the reference's size. After stages it is of the last
    one's pictures, which may have another height."""
    found = fit.captures.get(capture.id)
    if found is None or found.shift is None:
        return capture.alignment
    across, down, roll = found.shift
    height = capture.reference.shape[0]
    of_fit = fit.stages[-1].height if fit.stages else height
    scale = height / min(of_fit, capture.photo_size[1])
    return (across * scale, down * scale, roll)


def shown(picture: np.ndarray, capture: Capture) -> np.ndarray:
    """A picture that Cycles has rendered, or its standard deviations, times the photo's gain."""
    return picture * np.asarray(capture.gain, picture.dtype)
