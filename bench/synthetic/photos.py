# SPDX-License-Identifier: GPL-3.0-or-later
"""The photos of a case, by our own renderer or by Cycles; kept on disk."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from selenite import native
from selenite.cycles_check.compare import Estimate, Verdict, judge

from . import cycles_photos, fits, scenes, table
from .cases import Case

SOURCES = ("selenite", "cycles")
_SEED = 987654321
#: Pixels whose share of object is more than this count as object.
_COVERED = 0.99


@dataclass(frozen=True)
class Wanted:
    """Square photos of `size` pixels; `spp`: our samples, and the least of Cycles."""

    size: int
    spp: int
    source: str
    threads: int = 1

    def key(self, case: Case) -> str:
        """Name of the file that keeps them."""
        return f"{case.photos}-{self.size}-{self.spp}-{self.source}"


def take(case: Case, scene: Any, wanted: Wanted, folder: Path) -> np.ndarray:  # noqa: ANN401
    """(cameras, h, w, 3) linear radiance at the target; `scene`: native, at any values.

    Photos by Cycles have no more noise than ours; how they agree with ours is printed and added to
    equality.csv. Raises ValueError for a grid: Cycles has none in a mesh.
    """
    if wanted.source == "cycles" and case.albedo_grid is not None:
        raise ValueError(f"{case.name}: Cycles does not render a grid in a mesh")
    path = folder / f"{wanted.key(case)}.npy"
    if path.exists():
        return np.load(path)
    true = fits.at_target(case, scene)
    ours = [
        Estimate.of_film(
            native.core().render(
                true, camera, wanted.size, wanted.size, wanted.spp, seed=_SEED + i,
                threads=wanted.threads,
            )
        )
        for i, camera in enumerate(true.cameras)
    ]  # fmt: skip
    folder.mkdir(parents=True, exist_ok=True)
    pictures = np.stack([one.mean for one in ours]).astype(np.float32)
    if wanted.source == "cycles":
        pictures = _by_cycles(case, ours, wanted, folder)
    partial = path.with_suffix(".partial.npy")
    np.save(partial, pictures)
    partial.rename(path)
    return pictures


def _by_cycles(case: Case, ours: list[Estimate], wanted: Wanted, folder: Path) -> np.ndarray:
    cover = scenes.coverage(case.mesh, case.lighting, case.cameras, wanted.size) > _COVERED
    noise = cycles_photos.noise_of(np.stack([one.variance for one in ours]), cover)
    made = cycles_photos.take(
        case.mesh, case.lighting, case.cameras, case.fixed | case.target, wanted.size, wanted.spp,
        cover, noise, case.image,
    )  # fmt: skip
    ratio = cycles_photos.noise_of(made.variance, cover) / noise
    for i, one in enumerate(ours):
        theirs = Estimate(made.mean[i].astype(np.float64), made.variance[i])
        verdict = judge(one, theirs, cover[i])
        _announce(
            folder / "equality.csv", wanted.key(case), f"Camera {i + 1}", verdict, made, ratio
        )
    return made.mean


def _announce(
    path: Path, key: str, camera: str, verdict: Verdict, made: cycles_photos.Photos, ratio: float
) -> None:
    """A row of equality.csv, and the same in words."""
    passed = within(verdict)
    row = {
        "photos": key,
        "camera": camera,
        **{f"bias_{c}": f"{b:.5f}" for c, b in zip("rgb", verdict.bias, strict=True)},
        **{f"noise_{c}": f"{b:.5f}" for c, b in zip("rgb", verdict.bias_noise, strict=True)},
        "z_rms": f"{verdict.z_rms:.3f}",
        "cycles_samples": made.samples,
        "noise_ratio": f"{ratio:.2f}",
        "equal": int(passed),
    }
    table.append(path, row, list(row))
    bias = " ".join(f"{100 * value:+.2f}" for value in verdict.bias)
    print(
        f"{key}, {camera}: Selenite / Cycles - 1 over the object {bias} % "
        f"(noise {100 * verdict.bias_noise.max():.2f} %), z RMS {verdict.z_rms:.2f}, "
        f"{made.samples} samples with {ratio:.2f} of our noise: "
        f"{'equal' if passed else 'NOT EQUAL'}",
        file=sys.stderr,
        flush=True,
    )


def within(verdict: Verdict) -> bool:
    """The mean over the object is ours within 0.5 % beyond two standard deviations."""
    limit = verdict.largest_bias + 2 * verdict.bias_noise
    return bool((np.abs(verdict.bias) <= limit).all())
