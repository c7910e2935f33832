# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench extremes`: light and derivatives at the ends of every range, on our renderer alone.

Two tables, as Markdown. Extremes: a row for each setting with what is finite, the white furnace
(nothing gains light, and nothing loses any where nothing absorbs), the derivative of the mean
picture against one-sided differences of pictures, and the limit that paper gives. Ends: every
parameter of a material at both ends of its range, at both ends of a fit's range and where its model
changes. Writes extremes.csv and ends.csv; status 1 if a row fails that is not explained in
bench/extreme/known.py. Takes about four minutes of one core.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from dataclasses import replace
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench")]

from extreme.ends import ends, measure_end  # noqa: E402
from extreme.known import FINE, OPEN, reason  # noqa: E402
from extreme.measure import Settings, mean_of, slope_of  # noqa: E402
from extreme.rows import rows  # noqa: E402
from extreme.scenes import furnace  # noqa: E402

#: How far a white furnace in which nothing is lost may be from 1.
_FURNACE = 1e-3
#: Pictures without derivatives take so many times the samples.
_PLAIN = 16


def slope_cells(slope, why):
    """Cells of a derivative; `why`: a known reason, or empty."""
    return {
        "carried": f"{slope.carried:.4g}",
        "difference": f"{slope.difference:.4g}",
        "noise": f"{slope.error:.2g}",
        "z": f"{slope.z:+.1f}",
        "ratio": f"{slope.ratio:.3f}",
        "verdict": slope.verdict + (f" ({why})" if why else ""),
    }


def stands(slope, why):
    """Whether a derivative does not fail."""
    return slope.whole and (slope.verdict in (*FINE, OPEN) or bool(why))


def extreme_row(row, settings):
    """(cells, whether the row passes)."""
    settings = replace(settings, spp=max(4, settings.spp // row.thrift))
    picture = mean_of(row.scene(row.values), settings)
    passed = picture.whole
    cells = {"group": row.group, "row": row.name, "finite": "yes" if picture.whole else "NO"}
    if row.white is not None:
        # Long walks are in the thrifty rows, and they lose nothing: few samples do.
        more = _PLAIN if row.thrift == 1 else 1
        scene = furnace({**row.values, **row.white})
        white = mean_of(scene, replace(settings, spp=settings.spp * more))
        over = white.value - 1
        passed &= white.whole and over - 4 * white.error <= row.gain
        passed &= not row.lossless or abs(over) <= 4 * white.error + _FURNACE
        cells["furnace"] = f"{white.value:.4f} +- {white.error:.1g}"
    if row.limit is not None:
        limit = row.limit(replace(settings, spp=settings.spp * _PLAIN))
        passed &= limit.holds
        share = (limit.measured - limit.wanted) / limit.wanted if limit.wanted else 0.0
        cells |= {
            "measured": f"{limit.measured:.5g} +- {limit.error:.1g}",
            "on paper": f"{limit.wanted:.5g}",
            "off": f"{share:+.2%}" if limit.wanted else f"{limit.measured:.1g}",
        }
    if row.slope is not None:
        name, at, step = row.slope
        slope = slope_of(row.scene(row.values), name, at, step, settings)
        why = reason(name, at, step, row.values, slope.verdict)
        passed &= stands(slope, why)
        cells |= {"by": name} | slope_cells(slope, why)
    return cells, passed


def end_row(end, settings):
    """(cells, whether the row passes)."""
    slope = measure_end(end, settings)
    why = reason(end.parameter, end.at, end.step, end.values, slope.verdict)
    cells = {
        "parameter": end.parameter,
        "at": f"{end.at:.5g}",
        "side": "upwards" if end.step > 0 else "downwards",
        "of a fit": "yes" if end.of_fit else "",
        "on": end.base,
        "distances": f"{abs(end.step):.2g} to {abs(end.step) / 4:.2g}",
        **slope_cells(slope, why),
        "seeds": slope.seeds,
    }
    return cells, stands(slope, why)


def markdown(found):
    """A table; columns in the order of their first appearance."""
    if not found:
        return ""
    names = list(dict.fromkeys(name for cells, _ in found for name in cells))
    lines = ["| " + " | ".join([*names, ""]) + " |", "|---" * (len(names) + 1) + "|"]
    for cells, passed in found:
        texts = [str(cells.get(name, "")) for name in names]
        lines.append("| " + " | ".join([*texts, "" if passed else "**FAIL**"]) + " |")
    return "\n".join(lines) + "\n"


def write(path, found):
    names = list(dict.fromkeys(name for cells, _ in found for name in cells))
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, [*names, "passed"])
        writer.writeheader()
        writer.writerows({**cells, "passed": passed} for cells, passed in found)


def run(items, measure, settings, label):
    """Measures and tells how far it is."""
    found = []
    for item in items:
        begin = time.process_time()
        found.append(measure(item, settings))
        cells, passed = found[-1]
        texts = ", ".join(f"{name} {text}" for name, text in cells.items() if text)
        spent = time.process_time() - begin
        state = "pass" if passed else "FAIL"
        print(f"{label}: {texts}: {state}, {spent:.1f} CPU s", file=sys.stderr, flush=True)
    return found


def main():
    parser = argparse.ArgumentParser(
        prog="./dev bench extremes", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    add = parser.add_argument
    add("only", nargs="*", help="only rows whose names contain one of these")
    add("--table", choices=("extremes", "ends", "both"), default="both", help="(%(default)s)")
    usual = Settings()
    add("--size", type=int, default=usual.size, help="pixels, square (%(default)s)")
    add("--spp", type=int, default=usual.spp, help="samples a pixel and seed (%(default)s)")
    add("--seeds", type=int, default=usual.seeds, help="at most, for a derivative (%(default)s)")
    add("--out", type=Path, default=ROOT / "build" / "extremes", help="(%(default)s)")
    options = parser.parse_args()
    settings = Settings(options.size, options.spp, options.seeds)
    begin = time.process_time()
    options.out.mkdir(parents=True, exist_ok=True)
    failed = counted = unresolved = 0
    tables = {"extremes": (rows, extreme_row), "ends": (ends, end_row)}
    for name, (listed, measure) in tables.items():
        if options.table not in (name, "both"):
            continue
        found = run(listed(options.only), measure, settings, name)
        if found:
            write(options.out / f"{name}.csv", found)
        print(markdown(found), flush=True)
        counted += len(found)
        failed += sum(not passed for _, passed in found)
        unresolved += sum(cells.get("verdict") == OPEN for cells, _ in found)
    spent = time.process_time() - begin
    summary = f"{counted - failed} passed ({unresolved} with a derivative lost in noise)"
    print(f"{summary}, {failed} failed, {spent:.0f} CPU s; {options.out}")
    return 1 if failed or not counted else 0


if __name__ == "__main__":
    sys.exit(main())
