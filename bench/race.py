# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench race`: an iteration of a fit against one of Mitsuba 3, in CPU time.

Runs the project's outside check (shared/check/peer beside this checkout): `make_scenes.py` writes
the scenes, `race.py` lets both renderers take turns, so that what else the machine does hits both.
Status 1 if a ratio lies below --require.
"""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).resolve().parent.parent
CHECK = ROOT.parent / "shared" / "check" / "peer"
SELENITE = Path(sys.executable).parent / "selenite"


def table(rows):
    shown = Table(title="CPU seconds of one picture with the gradient of its mean squared error")
    for column in ("scene", "pixels", "samples", "Mitsuba", "Selenite", "ratio", "means R G B"):
        shown.add_column(column, justify="left" if column == "scene" else "right")
    for row in rows:
        seconds = [f"{row[key]:.4f}" for key in ("mitsuba_cpu_s", "selenite_cpu_s")]
        means = " ".join(f"{value:.3f}" for value in row["mean_ratio"])
        cells = [f"{row['size']} x {row['size']}", str(row["spp"]), *seconds]
        shown.add_row(row["kind"], *cells, f"{row['ratio']:.2f}", means)
    Console(stderr=True, width=110).print(shown)


def main():
    parser = argparse.ArgumentParser(prog="./dev bench race", description=__doc__)
    add = parser.add_argument
    add("kinds", nargs="*", default=["medium"], help="of opaque, glass, half, medium (medium)")
    add("--peer-python", type=Path, required=True, help="Python of the environment with Mitsuba")
    add("--check", type=Path, default=CHECK, help="(%(default)s)")
    add("--size", type=int, action="append", default=[], help="pixels, may be repeated (256)")
    add("--spp", default="4", help="samples per pixel, with commas (%(default)s)")
    add("--threads", type=int, default=1, help="of both (%(default)s)")
    add("--rounds", type=int, default=5, help="turns of both (%(default)s)")
    add("--require", type=float, default=0.0, help="the least Mitsuba / Selenite (%(default)s)")
    add("--out", type=Path, default=ROOT / "build" / "race", help="(%(default)s)")
    options = parser.parse_args()
    if not (options.check / "race.py").is_file():
        print(f"{options.check / 'race.py'} is missing: --check names its folder", file=sys.stderr)
        return 2
    out = options.out.resolve()
    made = [sys.executable, options.check / "make_scenes.py", "--out", out]
    subprocess.run(made, check=True, stdout=subprocess.DEVNULL)
    rows = []
    for size in options.size or [256]:
        report = out / f"race_{size}.json"
        command = [options.peer_python, options.check / "race.py", "--dir", out, "--json", report]
        command += ["--selenite", SELENITE, "--kinds", ",".join(options.kinds), "--size", size]
        command += ["--spp", options.spp, "--rounds", options.rounds]
        command += ["--threads", options.threads]
        # Both folders may be read-only: no compiled copies of what is imported there.
        environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
        subprocess.run([str(word) for word in command], check=True, env=environment)
        rows += json.loads(report.read_text(encoding="utf-8"))
    table(rows)
    return 1 if any(row["ratio"] < options.require for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
