# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench presets`: what time buys, over materials, shapes, lights and cameras.

The settings that `selenite trade` compares on a user's scene, the presets among them, fit the cases
of `./dev bench fit`, all from the same photos: those of the tallest setting, averaged for the
others. The table says which settings no other one beats in both time and error. What has been done
before, by the table in the output folder, is not done again.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench")]

from synthetic import cases, fits, photos, report, table  # noqa: E402

from selenite.advice.trade.choices import choices, front  # noqa: E402
from selenite.fit.settings import FitSettings  # noqa: E402

TALLEST = 256
KINDS = ("opaque", "glass", "half", "medium")
#: An error that nobody asks for; below it, errors differ by luck.
LEAST_ERROR = 1e-3
CHOICES = {choice.name: choice for choice in choices(FitSettings(), TALLEST)}


def fit(case, choice, options):
    """A row of the table."""
    scene = fits.scene_of(case)
    wanted = photos.Wanted(TALLEST, options.photo_spp, "selenite", options.threads)
    pictures = smaller(
        photos.take(case, scene, wanted, options.out / "photos"), choice.settings.height
    )
    settings = choice.settings.native() | {"threads": options.threads, "seed": 1000 + case.seed}
    job = fits.job_of(case, scene, pictures, settings)
    return report.row(choice.name, case, *fits.ended(job, case.name))


def smaller(pictures, height):
    """(cameras, height, height, 3): means of blocks of pixels."""
    cameras, tall = pictures.shape[:2]
    block = tall // height
    blocks = pictures.reshape(cameras, height, block, height, block, 3)
    return np.ascontiguousarray(blocks.mean(axis=(2, 4)), dtype=np.float32)


def show(rows):
    """Markdown on stdout: geometric means over the cases that all settings have fitted."""
    by_label = {}
    for row in rows:
        by_label.setdefault(row["label"], {})[row["case"]] = row
    shared = set.intersection(*map(set, by_label.values())) if by_label else set()
    if not shared:
        print("no case has been fitted with all settings yet")
        return
    points = {}
    for label, found in by_label.items():
        some = [found[name] for name in shared]
        seconds = np.exp(np.mean([np.log(float(row["cpu_seconds"])) for row in some]))
        errors = np.array([max(float(row["mean_error"]), LEAST_ERROR) for row in some])
        points[label] = (float(seconds), float(np.exp(np.log(errors).mean())), errors)
    best = front([(seconds, error) for seconds, error, _ in points.values()])
    print(f"{len(shared)} cases\n")
    print("| settings | CPU s | error: geometric mean, worst | under 10 / 5 / 2 % | front |")
    print("|---|---|---|---|---|")
    for (label, (seconds, error, errors)), on_front in sorted(
        zip(points.items(), best, strict=True), key=lambda item: item[0][1][0]
    ):
        under = " / ".join(str(int((errors < level).sum())) for level in report.LEVELS)
        print(
            f"| {label} | {seconds:.0f} | {error:.3f}, {errors.max():.3f} | {under} "
            f"| {'front' if on_front else ''} |"
        )


def parse():
    parser = argparse.ArgumentParser(prog="./dev bench presets", description=__doc__)
    add = parser.add_argument
    add("kind", nargs="*", help=f"of {', '.join(cases.KINDS)} (default: {', '.join(KINDS)})")
    add("--seeds", type=int, default=2, help="per kind (%(default)s)")
    add("--first-seed", type=int, default=0)
    add("--settings", action="append", help="name of one; repeatable (all)")
    add("--photo-spp", type=int, default=1024, help="samples of a photo (%(default)s)")
    add("--threads", type=int, default=1, help="(%(default)s)")
    add("--report-only", action="store_true", help="table of what has been done")
    add("--out", type=Path, default=ROOT / "build" / "bench-presets", help="(%(default)s)")
    options = parser.parse_args()
    for name, given, known in (
        ("kind", options.kind, cases.KINDS),
        ("settings", options.settings or (), CHOICES),
    ):
        wrong = [item for item in given if item not in known]
        if wrong:
            parser.error(f"{name} '{wrong[0]}' is unknown; choose of {', '.join(known)}")
    return options


def main():
    options = parse()
    path = options.out / "runs.csv"
    done = {(row["label"], row["case"]) for row in table.read(path)}
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    for seed in () if options.report_only else seeds:
        for kind in options.kind or KINDS:
            case = cases.make(kind, seed)
            for name in options.settings or CHOICES:
                if (name, case.name) in done:
                    continue
                found = fit(case, CHOICES[name], options)
                table.append(path, found, report.COLUMNS)
                print(f"{name}: {report.line(found)}", file=sys.stderr, flush=True)
    show(table.read(path))
    return 0


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)
