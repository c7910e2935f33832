# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench expected`: errors by Fisher information against those of fits and of their reports.

For each case photos of our own at the true values, their information there, and fits with
several seeds.
Prints a row for each parameter, colours as the root mean square of their channels:
expected and reported standard error (median over the fits), error of the fits (root mean square).
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench"), str(ROOT / "scenes")]

import numpy as np  # noqa: E402
from synthetic import subjects  # noqa: E402

from selenite.advice.information.photo_information import PhotoInformation  # noqa: E402
from selenite.advice.trade.expected import errors_of  # noqa: E402
from selenite.fit.settings import FitSettings  # noqa: E402


def measure(name: str, settings: FitSettings, seeds: int, spp: int) -> None:
    subject = subjects.subject(name)
    captures = subject.photos(settings.height, spp)
    truth = subject.plan(subject.true, captures, settings)
    begin = time.process_time()
    photos = PhotoInformation(truth, truth.scene)
    for _ in photos.at_photos():
        pass
    took = time.process_time() - begin
    expected = errors_of(photos, settings)
    off = {item.name: [] for item in truth.unknowns}
    reported = {item.name: [] for item in truth.unknowns}
    seconds = []
    for seed in range(seeds):
        plan = subject.plan(subject.start, captures, replace(settings, seed=seed))
        result, errors = subjects.fit(plan, truth)
        seconds.append(result["cpu_seconds"])
        for item in truth.unknowns:
            off[item.name].append(errors[item.name])
            report = result["report"]["parameters"][item.name]
            if all(report["determined"]):
                size = np.asarray(report["standard_error"])
                size = size / item.start if item.by_ratio else size
                reported[item.name].append(float(np.sqrt(np.mean(size**2))))
    print(
        f"{name}: {settings.height} px, {settings.iterations} x {settings.spp}, {seeds} fits of "
        f"{np.mean(seconds):.1f} CPU s, information {took:.1f} CPU s, "
        f"photos off by {photos.relative:.3f}"
    )
    for item, error in zip(truth.unknowns, expected, strict=True):
        errors = np.array(off[item.name])
        shown_error = "not determined" if error is None else f"{error:.5f}"
        many = f"{np.median(reported[item.name]):.5f}" if reported[item.name] else "-"
        print(
            f"  {item.parameter.name:14} expected {shown_error:>14}  reported {many:>8} "
            f"({len(reported[item.name])})  measured {np.sqrt(np.mean(errors**2)):.5f}  "
            f"worst {errors.max(initial=0):.5f}",
            flush=True,
        )


def main() -> int:
    parser = subjects.parser("expected", __doc__, ("demo", "opaque-0", "glass-0"), seeds=8)
    parser.add_argument("--photo-spp", type=int, default=1024, help="(%(default)s)")
    options = parser.parse_args()
    for name in options.cases:
        measure(name, subjects.settings_of(options), options.seeds, options.photo_spp)
    return 0


if __name__ == "__main__":
    sys.exit(main())
