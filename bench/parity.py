# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench parity`: Selenite against Cycles, setting by setting; status 1 if one fails.

Passes: bias over the object's mask at most 0.5 % beyond two standard deviations in each channel,
and an RMS below 1.3 of the z scores of 4 x 4 blocks (0.3 % counts as equal).
"""

import argparse
import csv
import json
import os
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "blender_tests")]

import bpy  # noqa: E402, F401 - before the native modules
import numpy as np  # noqa: E402
import parity_cases as parity  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.table import Table  # noqa: E402

from selenite import native  # noqa: E402
from selenite.problems import BadInput  # noqa: E402


def names(options):
    """What is compared, in order."""
    every = [case.name for case in parity.CASES] + list(parity.CHECKED)
    return [name for name in every if not options.only or any(o in name for o in options.only)]


def run_one(name, options, folder):
    """A row of the report."""
    cases = {case.name: case for case in parity.CASES}
    begin = time.perf_counter()
    size = options.size
    if name in cases:
        parity.make(cases[name], size)
        mask = parity.mask_of()
    else:
        mask = parity.check_scene(name, size)
        if mask is None:
            return {"name": name, "skipped": "the scene is not beside this checkout"}
    try:
        verdict, ours, cycles = parity.compare(mask, folder, options.effort)
    except BadInput as error:
        return {"name": name, "skipped": error.problems[0].line()}
    if options.pictures:
        difference = np.ascontiguousarray(ours.mean - cycles.mean, np.float32)
        for kind, pixels in (("native", ours.mean), ("cycles", cycles.mean), ("diff", difference)):
            stem = "".join(c if c.isalnum() else "_" for c in name)
            path = options.out / f"{stem}_{kind}.exr"
            native.image().write_exr(str(path), np.ascontiguousarray(pixels, np.float32))
    return {
        "name": name,
        "passed": verdict.passed,
        "bias": verdict.bias.tolist(),
        "bias_noise": verdict.bias_noise.tolist(),
        "z_rms": verdict.z_rms,
        "z_max": verdict.z_max,
        "blocks": verdict.blocks,
        "pixels": int(mask.sum()),
        "seconds": time.perf_counter() - begin,
    }


def write(rows, options):
    """report.json and report.csv."""
    (options.out / "report.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    columns = ["name", "passed", "bias r", "bias g", "bias b", "noise r", "noise g", "noise b"]
    columns += ["z_rms", "z_max", "skipped"]
    with (options.out / "report.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        for row in rows:
            flat = {key: row[key] for key in columns if key in row}
            for i, c in enumerate("rgb"):
                if "bias" in row:
                    flat |= {f"bias {c}": row["bias"][i], f"noise {c}": row["bias_noise"][i]}
            writer.writerow(flat)


def table(rows):
    shown = Table(title="Selenite against Cycles")
    for column in ("setting", "bias R", "bias G", "bias B", "+-", "z RMS", "max |z|", ""):
        shown.add_column(column, justify="left" if column == "setting" else "right")
    for row in rows:
        if "skipped" in row:
            shown.add_row(row["name"], *[""] * 6, f"[yellow]skipped: {row['skipped']}")
            continue
        cells = [f"{100 * bias:+.2f} %" for bias in row["bias"]]
        cells += [f"{100 * max(row['bias_noise']):.2f} %", f"{row['z_rms']:.2f}"]
        verdict = "[green]pass" if row["passed"] else "[bold red]FAIL"
        shown.add_row(row["name"], *cells, f"{row['z_max']:.1f}", verdict)
    Console(stderr=True, width=110).print(shown)


def main():
    parser = argparse.ArgumentParser(prog="./dev bench parity", description=__doc__)
    parser.add_argument("only", nargs="*", help="only settings whose name contains one of these")
    parser.add_argument("--size", type=int, default=48, help="pixels (%(default)s)")
    parser.add_argument("--samples", type=int, default=64, help="of Cycles per seed (%(default)s)")
    parser.add_argument("--seeds", type=int, default=8, help="of Cycles (%(default)s)")
    parser.add_argument("--native-samples", type=int, default=512, help="(%(default)s)")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "parity", help="(%(default)s)")
    parser.add_argument("--pictures", action="store_true", help="keep the pictures, as OpenEXR")
    parser.add_argument("--noise", type=float, default=0.0025, help="of the bias (%(default)s)")
    parser.add_argument("--rounds", type=int, default=5, help="at most, to get there (%(default)s)")
    options = parser.parse_args()
    options.effort = parity.Effort(
        options.samples, options.seeds, options.native_samples, options.noise, options.rounds
    )
    options.out = options.out.resolve()
    options.out.mkdir(parents=True, exist_ok=True)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name in names(options):
            rows.append(run_one(name, options, Path(folder)))
            row = rows[-1]
            write(rows, options)  # a long run that is broken off has something to show
            verdict = row.get("skipped") or f"{'pass' if row['passed'] else 'FAIL'}"
            print(f"{len(rows)}: {name}: {verdict}", file=sys.stderr, flush=True)
    table(rows)
    judged = [row for row in rows if "passed" in row]
    failed = [row["name"] for row in judged if not row["passed"]]
    seconds = sum(row["seconds"] for row in judged)
    print(
        f"{len(judged) - len(failed)} passed, {len(failed)} failed, "
        f"{len(rows) - len(judged)} skipped in {seconds:.0f} s; {options.out}",
        file=sys.stderr,
        flush=True,
    )
    return 1 if failed or not judged else 0


if __name__ == "__main__":
    status = main()
    os._exit(status)  # bpy can hang in its own destructors
