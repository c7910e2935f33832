# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench efficiency`: how much of the information in its samples a fit uses.

For each case photos of our own at the true values, and fits with several seeds. The bound is the
least standard error that any unbiased estimator has from the samples of the last refinement pass
(Cramer and Rao), with exact derivatives and the true noise of each pixel. Prints a row for each
parameter: (bound / reported standard error) squared, and the same for all paths of the fit.
Bounds are kept in the output folder.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench"), str(ROOT / "scenes")]

import numpy as np  # noqa: E402
from synthetic import subjects  # noqa: E402

from selenite import native  # noqa: E402
from selenite.fit.job import FitJob  # noqa: E402
from selenite.fit.plan import FitPlan  # noqa: E402
from selenite.fit.settings import FitSettings  # noqa: E402

_SEED = 1 << 43  # that no fit and no photo uses
#: Renders whose derivatives are multiplied with each other, never with themselves.
_BATCHES = 8
_USUAL = ("opaque-0", "glass-0", "half-0", "medium-0")


@dataclass(frozen=True)
class Row:
    """Of one parameter: root mean squares over its components, medians over the fits. Efficiencies
    are None where no fit determines it. doubt: relative standard error of the bound. contained:
    of `intervals` of 90 %, those that contain the truth."""

    case: str
    parameter: str
    efficiency: float | None
    of_all_paths: float | None
    reported: float | None
    bound: float | None
    doubt: float | None
    determined: int
    fits: int
    contained: int
    intervals: int
    cpu_seconds: float


def information(plan: FitPlan, spp: int) -> np.ndarray:
    """(batches + 1, n, n): of one sample in every pixel at the start of the plan, and the same
    without one of the batches. spp: of each batch."""
    asked = [(item.owner, item.parameter.name) for item in plan.unknowns]
    products: np.ndarray | float = 0.0
    evaluator = native.core().Evaluator(plan.scene, threads=1)
    for index, capture in enumerate(plan.captures):
        photo = capture.view()
        films = [
            evaluator.picture(photo, spp, seed=_SEED + _BATCHES * index + k, parameters=asked)
            for k in range(_BATCHES)
        ]
        slopes = np.array([film.jacobian.reshape(len(film.unknowns), -1) for film in films], float)
        variance = spp * np.mean([np.square(film.standard_error, dtype=float) for film in films], 0)
        shown = np.abs(slopes).max((0, 1)) > 0
        weight = shown / np.where(shown, variance.ravel(), 1)
        products = products + np.einsum("akp,p,blp->abkl", slopes, weight, slopes, optimize=True)
    return np.array([_of_batches(products, k) for k in (None, *range(_BATCHES))])


def _of_batches(products: Any, left_out: int | None) -> np.ndarray:  # noqa: ANN401 - an array
    """Mean of the products of two batches: without bias of noise."""
    used = [k for k in range(_BATCHES) if k != left_out]
    some = products[np.ix_(used, used)]
    mean = (some.sum((0, 1)) - np.einsum("aakl->kl", some)) / (len(used) * (len(used) - 1))
    return (mean + mean.T) / 2


def bounds(found: np.ndarray, samples: float, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least standard errors of the components `free`, (n,) bool, and how far these are off. NaN
    where the information is too noisy for one."""
    least = np.full((len(found), len(free)), np.nan)
    for row, one in zip(least, found, strict=True):
        own = one[np.ix_(free, free)] * samples
        scale = np.sqrt(np.abs(np.diag(own)))
        if (np.linalg.eigvalsh(own / np.outer(scale, scale)) > 0).all():
            row[free] = np.sqrt(np.diag(np.linalg.inv(own / np.outer(scale, scale)))) / scale
    spread = np.sqrt(np.mean((least[1:] - least[1:].mean(0)) ** 2, axis=0) * (_BATCHES - 1))
    return least[0], spread


def together(*samples: float) -> float:
    """Samples of a difference whose parts have so many."""
    return 1 / sum(1 / one for one in samples)


def _root_mean_square(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def rows(name: str, settings: FitSettings, options: argparse.Namespace) -> list[Row]:
    """Of a case."""
    subject = subjects.subject(name)
    captures = subject.photos(settings.height, options.photo_spp)
    truth = subject.plan(subject.true, captures, settings)
    kept = options.out / f"{name}-{settings.height}-{options.bound_spp}.npy"
    if not kept.exists():
        options.out.mkdir(parents=True, exist_ok=True)
        np.save(kept, information(truth, options.bound_spp // _BATCHES))
    pixels = sum(capture.weight.size for capture in captures)
    fits = [
        Fitted(subject.plan(subject.start, captures, replace(settings, seed=seed)), pixels)
        for seed in range(options.seeds)
    ]
    found, at = [], 0
    information_of_sample = np.load(kept)
    for item in truth.unknowns:
        part = slice(at, at := at + item.parameter.width)
        shares, of_all, reported, least, doubts = [], [], [], [], []
        contained = intervals = 0
        for one in fits:
            if not one.determined[part].all():
                continue
            low, high = one.intervals[part].T
            contained += int(((low <= item.start) & (item.start <= high)).sum())
            intervals += item.parameter.width
            reported.append(_root_mean_square(one.errors[part]))
            for samples, kept_in in ((one.own, shares), (one.samples, of_all)):
                bound, doubt = bounds(
                    information_of_sample, together(samples, options.photo_spp), one.free
                )
                kept_in.append((_root_mean_square(bound[part]) / reported[-1]) ** 2)
                if kept_in is shares:
                    least.append(_root_mean_square(bound[part]))
                    doubts.append(_root_mean_square(doubt[part] / bound[part]))

        def median(values: list[float]) -> float | None:
            return None if not values or np.isnan(values).any() else float(np.median(values))

        found.append(
            Row(
                name, item.parameter.name, median(shares), median(of_all), median(reported),
                median(least), median(doubts), len(reported), len(fits), contained, intervals,
                float(np.median([one.cpu_seconds for one in fits])),
            )
        )  # fmt: skip
    return found


class Fitted:
    """What a fit reports, by component. free: those that are at no bound. own: samples of the last
    pass. samples: paths of the whole fit over the pixels of the photos."""

    def __init__(self, plan: FitPlan, pixels: int) -> None:
        job = FitJob(plan)
        job.start()
        job.join()
        result = job.result()
        reports = [result.report.parameters[item.name] for item in plan.unknowns]
        self.errors = np.concatenate([one.standard_error for one in reports])
        self.intervals = np.concatenate([one.interval_90 for one in reports])
        self.determined = np.concatenate([one.determined for one in reports])
        self.free = np.concatenate([[at is None for at in one.at_bound] for one in reports])
        self.own, self.samples = result.report.spp, result.samples / pixels
        self.cpu_seconds = result.cpu_seconds


def line(row: Row) -> str:
    """Of the table."""

    def shown(value: float | None, digits: str) -> str:
        return "-" if value is None else format(value, digits)

    return (
        f"| {row.case} | {row.parameter} | {shown(row.efficiency, '.3f')} "
        f"| {shown(row.of_all_paths, '.3f')} | {shown(row.reported, '.2g')} "
        f"| {shown(row.bound, '.2g')} ± {shown(row.doubt, '.0%')} "
        f"| {row.contained} of {row.intervals} | {row.determined} of {row.fits} |"
    )


def main() -> int:
    """Prints the table, or a line of JSON per row."""
    parser = subjects.parser("efficiency", __doc__, _USUAL, seeds=3)
    parser.set_defaults(height=96)
    add = parser.add_argument
    add("--photo-spp", type=int, default=1024, help="(%(default)s)")
    add("--bound-spp", type=int, default=2048, help="samples of the bound (%(default)s)")
    add("--json", action="store_true", help="a line of JSON for each row")
    add("--out", type=Path, default=ROOT / "build" / "efficiency", help="(%(default)s)")
    options = parser.parse_args()
    if not options.json:
        print(
            "| case | parameter | efficiency | of all paths | reported | bound | intervals | fits |"
        )
        print("|---|---|---|---|---|---|---|---|", flush=True)
    for name in options.cases:
        for row in rows(name, subjects.settings_of(options), options):
            print(json.dumps(asdict(row)) if options.json else line(row), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
