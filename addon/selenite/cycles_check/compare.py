# SPDX-License-Identifier: GPL-3.0-or-later
"""How much two noisy pictures differ beyond their noise. Arrays only; no Blender here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..capture.prepared import Capture
from ..fit.capture_render import shown

if TYPE_CHECKING:
    from .._core import Film
    from ..json_text import JsonObject


@dataclass(frozen=True)
class Estimate:
    """A Monte Carlo picture: mean and variance of that mean, both (h, w, 3) float64."""

    mean: np.ndarray
    variance: np.ndarray

    @staticmethod
    def of_seeds(pictures: Sequence[np.ndarray]) -> Estimate:
        """Independent renders of one view; at least two."""
        stack = np.asarray(pictures, np.float64)
        return Estimate(stack.mean(axis=0), stack.var(axis=0, ddof=1) / len(stack))

    @staticmethod
    def of_film(film: Film) -> Estimate:
        """What the native renderer returns."""
        error = np.asarray(film.standard_error, np.float64)
        return Estimate(np.asarray(film.image, np.float64), error**2)

    def shown(self, capture: Capture) -> Estimate:
        """As a photo shows it."""
        deviation = shown(np.sqrt(self.variance), capture)
        return Estimate(shown(self.mean, capture), deviation**2)

    @staticmethod
    def exact(picture: np.ndarray) -> Estimate:
        """A photo: its noise is not known and counts as a difference."""
        mean = np.asarray(picture, np.float64)
        return Estimate(mean, np.zeros_like(mean))


def misfit(ours: Estimate, wanted: Estimate, weight: np.ndarray) -> JsonObject:
    """Bias and RMSE of `ours` relative to the mean of `wanted`, over weight (h, w).

    `..._noise`: one standard deviation of the bias, and the RMSE that noise alone would give.
    `..._beyond_noise`: what is left; the square of the noise is taken from the mean square, so it
    is unbiased before the cut at 0. The bias is beyond noise where it exceeds two deviations.
    """
    share = (weight / weight.sum())[..., None]
    scale = max(float((wanted.mean * share).sum()) / 3, 1e-30)
    difference = ours.mean - wanted.mean
    variance = ours.variance + wanted.variance
    rgb = (difference * share).sum(axis=(0, 1))
    bias = float(rgb.mean()) / scale
    # the channels of a pixel share their paths: their errors add up, not their squares
    deviation = np.sqrt((variance * share**2).sum(axis=(0, 1)))
    bias_noise = float(deviation.mean()) / scale
    square = float((difference**2 * share).sum()) / 3
    noise = float((variance * share).sum()) / 3
    return {
        "relative_bias": bias,
        "relative_bias_noise": bias_noise,
        "relative_bias_beyond_noise": float(np.sign(bias)) * max(0.0, abs(bias) - 2 * bias_noise),
        "relative_bias_rgb": (rgb / scale).tolist(),
        "relative_rmse": float(np.sqrt(square)) / scale,
        "relative_rmse_noise": float(np.sqrt(noise)) / scale,
        "relative_rmse_beyond_noise": float(np.sqrt(max(0.0, square - noise))) / scale,
    }


def line(name: str, row: JsonObject) -> str:
    """A misfit for the terminal."""
    return (
        f"{name}: bias {100 * row['relative_bias']:+.2f} % "
        f"(noise {100 * row['relative_bias_noise']:.2f} %), "
        f"RMSE {100 * row['relative_rmse']:.2f} %, "
        f"of it beyond noise {100 * row['relative_rmse_beyond_noise']:.2f} %"
    )


@dataclass(frozen=True)
class Verdict:
    """Of one picture against its reference, per channel where it is an array (3,)."""

    bias: np.ndarray
    bias_noise: np.ndarray
    z_rms: float
    z_max: float
    blocks: int
    largest_bias: float

    @property
    def passed(self) -> bool:
        """Bias within its limit beyond two deviations, and blocks as far apart as noise says."""
        return bool(
            (np.abs(self.bias) <= self.largest_bias + 2 * self.bias_noise).all()
            and self.z_rms < Z_LIMIT
        )


BIAS_LIMIT = 0.005
Z_LIMIT = 1.3
#: Relative difference of a block that counts as equal: rounding and interpolation, not noise.
FLOOR = 0.003


def judge(
    ours: Estimate, wanted: Estimate, mask: np.ndarray, bins: int = 4, dark: float = 1e-6
) -> Verdict:
    """Bias over mask (h, w) bool, and z scores of the means of blocks of bins x bins pixels.

    A channel that is black in both has bias 0. Blocks count where half of them lies in the mask;
    `dark` is the absolute difference in radiance that always counts as equal.
    """
    inside = mask[..., None]
    count = mask.sum()
    difference = ours.mean - wanted.mean
    variance = ours.variance + wanted.variance
    mean = np.maximum(np.abs((wanted.mean * inside).sum(axis=(0, 1)) / count), dark)
    bias = (difference * inside).sum(axis=(0, 1)) / count / mean
    noise = np.sqrt((variance * inside).sum(axis=(0, 1))) / count / mean
    block_difference, pixels = _blocks(difference, bins)
    block_variance = _blocks(variance, bins)[0] / pixels
    reference = _blocks(wanted.mean, bins)[0]
    z = block_difference / np.sqrt(block_variance + (FLOOR * reference) ** 2 + dark**2)
    z = z[_blocks(inside.astype(float), bins)[0][..., 0] >= 0.5]
    return Verdict(
        bias, noise, float(np.sqrt(np.mean(z**2))), float(np.abs(z).max()), len(z), BIAS_LIMIT
    )


def _blocks(picture: np.ndarray, bins: int) -> tuple[np.ndarray, np.ndarray]:
    """Means of blocks and the numbers of their pixels; blocks at the border may be smaller."""
    rows, columns = (range(0, size, bins) for size in picture.shape[:2])

    def total(array: np.ndarray) -> np.ndarray:
        return np.add.reduceat(np.add.reduceat(array, rows, axis=0), columns, axis=1)

    pixels = total(np.ones((*picture.shape[:2], 1)))
    return total(picture) / pixels, pixels
