# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench fit`: fits whose truth is known, many of them.

Random targets and starts (half of the starts dark and opaque) on several shapes, lights and numbers
of cameras; photos rendered by ourselves with other seeds, or by Cycles (--photos cycles), which
shares no line of code with the fit. What has been done before, by the table in the output folder,
is not done again: a run can be stopped and taken up.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench")]

from synthetic import cases, fits, photos, report, table  # noqa: E402

from selenite.fit.settings import PRESETS, with_overrides  # noqa: E402


def fit(case, options, folder):
    """A row of the table."""
    scene = fits.scene_of(case)
    wanted = photos.Wanted(options.size, options.photo_spp, options.photos, options.threads)
    pictures = photos.take(case, scene, wanted, folder / "photos")
    job = fits.job_of(case, scene, pictures, settings_of(case, options))
    ended = fits.ended(job, case.name)
    weights = fits.texel_weights(case, scene, options.size, options.threads)
    return report.row(options.label, case, *ended, weights)


def settings_of(case, options):
    given = {"iterations": options.iterations, "spp": options.spp, "optimiser": options.optimiser}
    settings = with_overrides(PRESETS[options.preset], given).native()
    settings["threads"], settings["seed"] = options.threads, 1000 + case.seed
    for text in options.set:
        name, _, value = text.partition("=")
        settings[name] = _number(value)
    return settings


def _number(text):
    """An int, a float or the text itself."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            pass
    return text


def parse():
    parser = argparse.ArgumentParser(prog="./dev bench fit", description=__doc__)
    add = parser.add_argument
    others = ", ".join(kind for kind in cases.ALL_KINDS if kind not in cases.KINDS)
    add("kind", nargs="*", help=f"of {', '.join(cases.KINDS)} (all of these), {others}")
    add("--seeds", type=int, default=20, help="per kind (%(default)s)")
    add("--first-seed", type=int, default=0)
    add("--label", help="name of the recipe in the table (default; 'default, cycles')")
    add("--size", type=int, default=128, help="pixels, square (%(default)s)")
    add("--photo-spp", type=int, default=1024, help="samples of a photo (%(default)s)")
    add("--photos", choices=photos.SOURCES, default="selenite", help="by whom (%(default)s)")
    add("--preset", choices=PRESETS, default="balanced")
    add("--iterations", type=int)
    add("--spp", type=int, help="samples of a step")
    add("--optimiser")
    add(
        "--set", action="append", default=[], metavar="NAME=VALUE", help="setting of the native fit"
    )
    add("--threads", type=int, default=1, help="(%(default)s)")
    add("--report-only", action="store_true", help="tables and plot of what has been done")
    add("--out", type=Path, default=ROOT / "build" / "bench-fit", help="(%(default)s)")
    options = parser.parse_args()
    wrong = [kind for kind in options.kind if kind not in cases.ALL_KINDS]
    if wrong:
        parser.error(f"kind '{wrong[0]}' is unknown; choose of {', '.join(cases.ALL_KINDS)}")
    if options.label is None:
        options.label = "default" if options.photos == "selenite" else f"default, {options.photos}"
    return options


def main():
    options = parse()
    path = options.out / "runs.csv"
    rows = table.read(path)
    done = {(row["label"], row["case"]) for row in rows}
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    for seed in () if options.report_only else seeds:
        for kind in options.kind or cases.KINDS:
            case = cases.make(kind, seed)
            if (options.label, case.name) in done:
                continue
            found = fit(case, options, options.out)
            table.append(path, found, report.COLUMNS)
            rows.append({name: str(value) for name, value in found.items()})
            print(report.line(found), file=sys.stderr, flush=True)
    report.show(rows, options.out)
    return 0


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)
