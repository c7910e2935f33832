# SPDX-License-Identifier: GPL-3.0-or-later
"""What pictures say about unknowns: their Fisher information, and the errors that follow from it.

All in the coordinates in which a fit steps (native `coordinates`), n of them. A photo's noise is
taken as that of the verification's render and a share of its brightness; weights are those of a fit
(native/fit/gauss_newton.cpp), so that the errors are those that the fit's own report would tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

# As in native/fit: weights.cpp, gauss_newton.cpp, uncertainty.cpp.
_DIM_SHARE, _BLUR_RADIUS, _BLACK = 0.3, 2, 1e-6
_CLIP_QUANTILE, _INSTRUMENT_RADIUS = 0.998, 1
_FINAL_SAMPLES, _MODEL_ERROR = 64, 0.05
_RESOLVED, _PRIOR, _UNDETERMINED, _DECADES = 3.0, 0.29, 0.1, 4.6


@dataclass(frozen=True)
class FisherInformation:
    """Of one photo. With J = d picture / d coordinates, w the fit's weights and V the
    variance of a residual, each summed over pixels and channels:

    normal (n, n): Z^T w J, without the bias of noise in J. doubt (n, n): variance of its entries.
    spread (n, n): Z^T w V w Z, the channels of a pixel varying together, as most noise of light
    does. low, high: what spread can be in units of normal; w V with channels apart, and three times
    that. Z: J clipped and blurred, the instruments of a fit; they keep most of the noise out.
    """

    normal: np.ndarray
    doubt: np.ndarray
    spread: np.ndarray
    low: float
    high: float

    def mean(self, other: FisherInformation, share: float) -> FisherInformation:
        """Of two looks at the same picture, the other one having that share of the samples."""
        rest = 1 - share
        return FisherInformation(
            rest * self.normal + share * other.normal,
            rest**2 * self.doubt + share**2 * other.doubt,
            rest * self.spread + share * other.spread,
            min(self.low, other.low),
            max(self.high, other.high),
        )

    def relative_doubt(self) -> float:
        """Of the information about the single components the largest error, as a share of it;
        infinite where there is none but noise."""
        with np.errstate(divide="ignore", invalid="ignore"):
            shares = np.sqrt(np.diag(self.doubt)) / np.maximum(np.diag(self.normal), 0.0)
        return float(np.max(np.nan_to_num(shares, nan=0.0, posinf=np.inf)))


@dataclass(frozen=True)
class Noise:
    """Of a photo's residual: samples of a pixel in the render that is compared with it, the error
    of the photo itself as a share of brightness, and how many of its pixels are one of the small
    picture that is looked at."""

    spp: float
    relative: float
    pixels: float


def brightness(picture: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """(h, w, 3): around each pixel, kept away from 0. `weight` (h, w) >= 0."""
    level = np.maximum(picture, 0.0).astype(np.float64)
    mean = float((level * weight[..., None]).sum() / (3 * weight.sum()))
    return blurred(level, _BLUR_RADIUS) + _DIM_SHARE * max(mean, _BLACK)


def information(
    halves: tuple[np.ndarray, np.ndarray],
    sample_variance: np.ndarray,
    picture: np.ndarray,
    weight: np.ndarray,
    noise: Noise,
) -> FisherInformation:
    """halves: independent estimates of J, (n, h, w, 3). sample_variance: of one sample, (h, w, 3).
    picture: the photo or a render in its place. weight: (h, w), 0 where a pixel does not count."""
    counts = weight > 0
    instruments = [_instruments(half, counts) for half in halves]
    a, b = (half.reshape(len(half), -1).astype(np.float64) for half in halves)
    za, zb = (half.reshape(len(half), -1) for half in instruments)
    level = brightness(picture, weight)
    variance = blurred(np.maximum(sample_variance, 0.0), _BLUR_RADIUS)
    share = np.repeat(weight[..., None], 3, axis=2) / (3 * weight.sum())
    w = share / (variance / _FINAL_SAMPLES + (_MODEL_ERROR * level) ** 2)
    v = (variance / noise.spp + (noise.relative * level) ** 2) / noise.pixels
    ratio = (w * v)[counts]
    together = (len(a), -1, 3)
    noisy = [(half * (w * np.sqrt(v)).ravel()).reshape(together).sum(axis=2) for half in (za, zb)]
    w = w.ravel()
    size, uncertain = (za**2 + zb**2) / 2, (a - b) ** 2 / 2
    mixed = (size * w**2) @ uncertain.T
    return FisherInformation(
        normal=_symmetric((za * w) @ b.T + (zb * w) @ a.T) / 2,
        doubt=mixed + mixed.T,
        spread=_symmetric(noisy[0] @ noisy[1].T),
        low=float(ratio.min()),
        high=3 * float(ratio.max()),
    )


def relative_square(
    halves: tuple[np.ndarray, np.ndarray],
    sample_variance: np.ndarray,
    photo: np.ndarray,
    weight: np.ndarray,
) -> float:
    """Mean square of what a photo differs by from a render beyond the render's noise, in units of
    its brightness. Pixels count as in a fit, which hardly looks at the noisiest ones: else a few
    bright paths would be all of it. halves: of the render. Shapes as for `information`."""
    level = brightness(photo, weight)
    variance = blurred(np.maximum(sample_variance, 0.0), _BLUR_RADIUS)
    trust = 1 / (variance / (_FINAL_SAMPLES * level**2) + _MODEL_ERROR**2)
    share = (trust * weight[..., None]) ** 2
    product = (halves[0] - photo) * (halves[1] - photo)
    return float((share * product / level**2).sum() / share.sum())


def precision(found: FisherInformation, resolved: float = _RESOLVED) -> np.ndarray:
    """(n, n), positive semidefinite: inverse covariance of what a fit to the photo would find.

    Directions whose information is not more than `resolved` standard deviations of its own noise,
    a negative one among them, count as not seen. So another photo never makes anything less known.
    """
    result = np.zeros_like(found.normal)
    seen = np.diag(found.normal) > resolved * np.sqrt(np.diag(found.doubt))
    if not seen.any():
        return result
    part = np.ix_(seen, seen)
    scale, values, basis, noise = _directions(found.normal[part], found.doubt[part])
    good = values > resolved * noise
    # H S^-1 H, with S in units of H: that keeps noise in S inside what it can be.
    root = scale[:, None] * basis[:, good] * np.sqrt(values[good])
    across = basis[:, good] / (scale[:, None] * np.sqrt(values[good]))
    ratios, axes = np.linalg.eigh(across.T @ found.spread[part] @ across)
    root = root @ axes
    result[part] = (root / np.clip(ratios, found.low, found.high)) @ root.T
    return result


def weakest(photos: Sequence[FisherInformation]) -> float:
    """Of all directions the least information of the photos together, in standard deviations of its
    noise; 0 where a component is not seen."""
    normal = np.sum([one.normal for one in photos], axis=0)
    doubt = np.sum([one.doubt for one in photos], axis=0)
    if not (np.diag(normal) > 0).all():
        return 0.0
    _, values, _, noise = _directions(normal, doubt)
    return float(np.min(values / np.maximum(noise, 1e-300)))


def errors(
    photos: Sequence[np.ndarray], ranges: np.ndarray, free: Sequence[int] | None = None
) -> np.ndarray:
    """(n,): standard error of each coordinate, those of the others being unknown too, from the
    `precision` of each photo. What no photo shows is as wide as its bounds, `ranges` (n,) apart,
    leave it. free: the coordinates that are unknown, in the order of the answer; all, unless given.
    """
    width = _PRIOR * np.minimum(ranges, _DECADES)
    total = sum(photos, np.diag(1 / width**2))
    if free is not None:
        total = total[np.ix_(list(free), list(free))]
    # Scaled to a diagonal of 1: precisions differ by many orders of magnitude.
    scale = np.sqrt(np.diag(total))
    return np.sqrt(np.diag(np.linalg.inv(total / np.outer(scale, scale)))) / scale


def determined(error: np.ndarray, ranges: np.ndarray) -> np.ndarray:
    """(n,) bool: as in a fit's report."""
    known: np.ndarray = error < _UNDETERMINED * np.minimum(ranges, _DECADES)
    return known


def gain(before: np.ndarray, after: np.ndarray, groups: Sequence[Sequence[int]]) -> float:
    """Logarithm of the factor by which errors shrink, the mean over `groups` (the components of
    each parameter: a colour counts as much as a number). 0: nothing is gained. It does not change
    with the units of a parameter, and what becomes known at all counts most."""
    parts = np.log(before / after)
    return float(np.mean([np.mean(parts[list(group)]) for group in groups]))


def blurred(picture: np.ndarray, radius: int) -> np.ndarray:
    """Mean over squares of 2 radius + 1 pixels, within the picture; (h, w, c)."""
    result = picture.astype(np.float64)
    for axis in (0, 1):
        count = result.shape[axis]
        sums = np.cumsum(result, axis=axis)
        sums = np.concatenate([np.zeros_like(np.take(sums, [0], axis)), sums], axis)
        first = np.maximum(np.arange(count) - radius, 0)
        last = np.minimum(np.arange(count) + radius + 1, count)
        shape = [1, 1, 1]
        shape[axis] = count
        result = (np.take(sums, last, axis) - np.take(sums, first, axis)) / (last - first).reshape(
            shape
        )
    return result


def _instruments(half: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """(n, h, w, 3): each picture cut at a quantile of its absolute values, so that no single path
    rules it, and blurred. A channel that a component never shows in takes no part."""
    result = np.empty(half.shape)
    for index, picture in enumerate(half):
        sizes = np.abs(picture[counts])
        sizes = sizes[:, sizes.any(axis=0)]
        limit = np.quantile(sizes, _CLIP_QUANTILE) if sizes.size else 0.0
        result[index] = blurred(np.clip(picture, -limit, limit), _INSTRUMENT_RADIUS)
    return result


def _directions(
    normal: np.ndarray, doubt: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """scale (n,) that takes the diagonal of `normal` to 1; eigenvalues (n,) and, in columns,
    eigenvectors of the scaled matrix; standard deviation of the eigenvalues, (n,)."""
    scale = np.sqrt(np.diag(normal))
    values, basis = np.linalg.eigh(normal / np.outer(scale, scale))
    square = basis**2
    variance = np.einsum("ij,ik,kj->j", square, doubt / np.outer(scale, scale) ** 2, square)
    return scale, values, basis, np.sqrt(variance)


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    return (matrix + matrix.T) / 2
