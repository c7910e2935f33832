# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench precision`: the Principled BSDF and its derivatives in 32 bits against 64.

Renders compute with 32 bits. Rows: random materials, and the corners of the parameters' ranges seen
from steep and grazing directions. Differences are relative to the largest channel of the row in 64
bits; those of a derivative to the derivative or, where it is smaller because two lobes cancel, to
the value. Seconds are CPU time.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon")]

import numpy as np  # noqa: E402

from selenite import native, parameters  # noqa: E402

VERSION = "v2"
#: Corners: beside the smallest and largest values what is known to be delicate. The IOR by the
#: index of air; roughnesses whose squares are near the limit below which a lobe counts as a mirror.
CORNERS = {
    "roughness": (0.0, 0.005, 0.02, 0.1, 1.0),
    "ior": (1.0, 1.0001, 1.5, 3.0),
    "metallic": (0.0, 1.0),
    "transmission": (0.0, 0.5, 1.0),
    "base": (0.0, 0.5, 1.0),
    "coat_weight": (0.0, 1.0),
    "sheen_weight": (0.0, 1.0),
}
#: Cosines of the viewer and of the light, which stands opposite.
COSINES = (1.0, 0.7, 0.1, 0.01)
#: Rows whose largest channel is smaller are left out: nobody sees them. 1/sr, and that by the
#: parameter's unit.
VISIBLE = 1e-4
SHOWN = ("base_r", "roughness", "ior", "transmission", "metallic", "coat_roughness", "coat_ior")


def directions(cosine, azimuth):
    sine = np.sqrt(1 - np.square(cosine))
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=-1)


def columns():
    """Names of the parameters."""
    table = native.core().probe_columns(VERSION)
    return [c["name"] for c in table if c["parameter"]]


def stem(name):
    """The parameter that a column is a channel of."""
    return name[:-2] if name.endswith(("_r", "_g", "_b")) else name


def default(name):
    parameter = "base_color" if stem(name) == "base" else stem(name)
    return np.ravel(parameters.table()["material", parameter].initial)[0]


def corner_rows(names):
    """Every combination of CORNERS and COSINES; mirrored, beside it, and through the surface."""
    rows = []
    for values in itertools.product(*CORNERS.values()):
        chosen = dict(zip(CORNERS, values, strict=True))
        material = [chosen.get(stem(name), default(name)) for name in names]
        for cosine in COSINES:
            wi = directions(cosine, 0.0)
            for turn, side in ((np.pi, 1), (np.pi - 0.05, 1), (np.pi, -1)):
                wo = directions(cosine, turn) * (1, 1, side)
                rows.append([*material, *wi, *wo])
    return np.array(rows)


def random_rows(names, count, seed=1):
    """Materials from all of the ranges of fits, directions from the sphere."""
    random = np.random.default_rng(seed)
    known = {c["name"]: c for c in native.core().probe_columns(VERSION)}
    values = []
    for name in names:
        upper = {"ior": 3.0, "coat_ior": 3.0}.get(name, min(known[name]["upper"], 1.0))
        lower = {"ior": 1.0, "coat_ior": 1.0}.get(name, known[name]["lower"])
        values.append(random.uniform(lower, upper, count))
        if name in ("roughness", "coat_roughness"):  # as many of .01 to .1 as of .1 to 1
            values[-1] = np.exp(random.uniform(np.log(0.01), 0, count))
    vectors = random.normal(size=(2, count, 3))
    vectors /= np.linalg.norm(vectors, axis=2, keepdims=True)
    return np.concatenate([np.array(values).T, vectors[0], vectors[1]], axis=1)


def evaluated(names, rows, precision):
    """Values (n, 3), slopes (n, 3, p) and CPU nanoseconds of a row for each."""
    core = native.core()
    header = [*names, *(f"{w}_{axis}" for w in ("wi", "wo") for axis in "xyz")]
    multi = np.zeros(len(rows), bool)
    found = []
    for function in (core.probe, core.probe_slopes):
        times = []
        for _ in range(3):
            begin = time.process_time()
            result = function(VERSION, header, rows, multi, precision=precision)
            times.append(time.process_time() - begin)
        found.append((result, 1e9 * min(times) / len(rows)))
    return found


def quantiles(single, double, scale):
    """Relative differences: median, 99 %, largest; share above 1e-3; rows not finite."""
    finite = np.isfinite(single)
    seen = finite & (scale > VISIBLE)
    error = np.abs(single - double)[seen] / scale[seen]
    if not error.size:
        return None
    parts = [*np.quantile(error, (0.5, 0.99)), error.max(), (error > 1e-3).mean()]
    return [*parts, int((~finite).sum())]


def report(names, sets):
    lines = [
        "| rows | what | median | 99 % | largest | above 1e-3 | not finite |",
        "|---" * 7 + "|",
    ]
    clock = ["| rows | what | 32 bits | 64 bits |", "|---" * 4 + "|"]
    for label, rows in sets.items():
        one = evaluated(names, rows, "single")
        two = evaluated(names, rows, "double")
        values = np.abs(two[0][0]).max(axis=1, keepdims=True) + np.zeros((1, 3))
        cells = {"value": quantiles(one[0][0], two[0][0], values)}
        for name in SHOWN:
            k = names.index(name)
            a, b = one[1][0][:, :, k], two[1][0][:, :, k]
            scale = np.maximum(np.abs(b).max(axis=1, keepdims=True), values)
            cells[f"by {name}"] = quantiles(a, b, scale)
        for what, found in cells.items():
            if found:
                text = " | ".join(f"{x:.1e}" for x in found[:3])
                lines.append(f"| {label} | {what} | {text} | {found[3]:.2%} | {found[4]} |")
        for what, i in (("value", 0), (f"value and {len(names)} slopes", 1)):
            clock.append(f"| {label} | {what} | {one[i][1]:.0f} ns | {two[i][1]:.0f} ns |")
    return "\n".join([*lines, "", *clock]) + "\n"


def main():
    parser = argparse.ArgumentParser(
        prog="./dev bench precision", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--rows", type=int, default=20000, help="random ones (%(default)s)")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "precision")
    options = parser.parse_args()
    names = columns()
    text = report(
        names, {"random": random_rows(names, options.rows), "corners": corner_rows(names)}
    )
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "precision.md").write_text(text, encoding="utf-8")
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
