# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench guard`: whether fits got slower or worse, beside the last record.

The race with Mitsuba (CPU times, ratios), and default fits of ten bodies to photos by Cycles with
three seeds each, through the command line. Photos are made once and kept. One table: errors,
intervals that hold, values left open, CPU seconds, in brackets what `guard/recorded.csv` has of the
same kind of processor. A loss of more than 10 % beyond the spread of the seeds is named: status 1.
With SELENITE_AVX2=0 in the environment this processor stands in for one without AVX2.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench")]

from guard import compare, measure, photos, processor  # noqa: E402
from guard.bodies import BODIES  # noqa: E402
from synthetic import table  # noqa: E402

OUT = ROOT / "build" / "guard"
RECORDED = ROOT / "bench" / "guard" / "recorded.csv"


def parse():
    parser = argparse.ArgumentParser(prog="./dev bench guard", description=__doc__)
    add = parser.add_argument
    names = [body.name for body in BODIES]
    add("--only", nargs="+", default=names, metavar="NAME", help=f"of {', '.join(names)}")
    add("--seeds", type=int, default=3, help="of each body (%(default)s)")
    add("--without", choices=["race", "fits"], nargs="+", default=[])
    add("--record", action="store_true", help="what was measured becomes the record")
    add("--jobs", type=int, default=int(os.environ.get("SELENITE_JOBS", 2)), help="(%(default)s)")
    options = parser.parse_args()
    if wrong := set(options.only) - set(names):
        parser.error(f"there is no body '{min(wrong)}'; choose of {', '.join(names)}")
    if options.seeds < 1 or options.jobs < 1:
        parser.error("--seeds and --jobs are at least 1")
    return options


def fits(options, report):
    """Rows; those that take longest come first, so that no process waits at the end."""
    chosen = [body for body in BODIES if body.name in options.only]
    kept = {}
    for body in chosen:
        kept[body.name] = photos.of(body, OUT / "photos")
    order = sorted(chosen, key=lambda body: "extinction" not in body.target)
    work = [(body, seed) for body in order for seed in range(1, options.seeds + 1)]

    def one(item):
        body, seed = item
        with tempfile.TemporaryDirectory(prefix="selenite-guard-") as place:
            row = measure.fit(body, kept[body.name], seed, Path(place))
        report(
            f"{body.name}, seed {seed}: error {row.get('mean_error', '-')}, "
            f"{row.get('cpu_seconds', '-')} CPU s, {row['stopped']}; {row.get('values', '')}"
        )
        return row

    with ThreadPoolExecutor(options.jobs) as pool:
        rows = list(pool.map(one, work))
    place = {body.name: index for index, body in enumerate(BODIES)}
    return sorted(rows, key=lambda row: (place[row["name"]], row["seed"]))


def revision():
    found = subprocess.run(
        ["git", "describe", "--always", "--dirty", "--abbrev=12"], cwd=ROOT, capture_output=True,
        text=True, check=False,
    )  # fmt: skip
    return found.stdout.strip() or "unknown"


def record(rows, kind):
    """Replaces what is recorded of this kind of processor under the same names."""
    measured = {row["name"] for row in rows}
    kept = [
        row
        for row in table.read(RECORDED)
        if row["processor"] != kind or row["name"] not in measured
    ]
    table.write(RECORDED, [*kept, *rows], compare.COLUMNS)


def main():
    options = parse()

    def report(text):
        print(text, file=sys.stderr, flush=True)

    kind, rows = processor.kind(), []
    if "race" not in options.without:
        ratios, reason = measure.race(OUT / "race")
        rows += ratios
        if reason:
            report(f"race skipped: {reason}")
    if "fits" not in options.without:
        rows += fits(options, report)
    rows = [{"processor": kind, "revision": revision(), **row} for row in rows]
    before = [row for row in table.read(RECORDED) if row["processor"] == kind]
    table.write(OUT / "guard.csv", rows, compare.COLUMNS)
    text = compare.table(rows, before, kind)
    lost = compare.losses(rows, before)
    text += "".join(f"\nworse: {sentence}" for sentence in lost) + ("\n" if lost else "")
    (OUT / "guard.md").write_text(text, encoding="utf-8")
    print(text, flush=True)
    if options.record:
        record(rows, kind)
    return 1 if lost else 0


if __name__ == "__main__":
    sys.exit(main())
