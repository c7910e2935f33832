# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench estimators`: which estimate of a derivative has the least noise in a CPU second.

The derivative that the path tracer carries along (detached) against differences of two pictures
with equal seeds, parameter by parameter, on four materials at several roughnesses. Prints Markdown,
writes estimators.csv and estimators.md. Takes about a quarter of an hour of one core.

power: noise of the derivative picture, per sample. mean: standard error of d(mean picture)/du times
the root of the CPU seconds. loss: standard error of the gradient of the dual-buffer loss away from
its minimum, at equal CPU time, as is `step`: the same for the gradient in a fit of all parameters,
where the derivatives of the others are carried along and pairs come on top.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench")]

import numpy as np  # noqa: E402
from synthetic import scenes, stage  # noqa: E402
from synthetic.slopes import (  # noqa: E402
    DETACHED,
    PAIRS,
    Camera,
    Gathered,
    Scale,
    detached_of,
    half_covariance,
)

_COLOUR = [0.7, 0.5, 0.35]
_SURFACE = {"base_color": _COLOUR, "ior": 1.5}
#: Values beside the roughness; what is listed first is fixed, the rest is differentiated.
MATERIALS = {
    "opaque": ({}, _SURFACE | {"transmission": 0.1}),
    "glass": ({}, _SURFACE | {"transmission": 0.9}),
    "half": ({}, _SURFACE | {"transmission": 0.5}),
    "medium": (
        {"base_color": [1.0] * 3, "transmission": 1.0},
        {"albedo": [0.9, 0.8, 0.7], "ior": 1.4, "extinction": [4.0] * 3},
    ),
}
ROUGHNESSES = (0.02, 0.05, 0.1, 0.3, 0.6)
#: The photo lies this many steps of the differences away in every parameter.
_DISPLACED = 1.0
_PHOTO_SEED = 987654321
#: Two pictures on both sides have random numbers of their own, as in a fit.
_OTHER_SEEDS = 500000
#: Renders by which the cost of one slot is told.
_TIMED = 3
COLUMNS = (
    "material", "roughness", "parameter", "estimator", "cpu", "mean", "mean_se", "mean_noise",
    "power", "gradient", "gradient_se", "loss", "step", "doubt",
)  # fmt: skip


def photo_of(camera, values, options):
    """Picture of values some way off, with seeds of its own."""
    moved = {}
    for name, value in values.items():
        scale = Scale(name)
        # Downwards: a colour near 1 has no other way.
        moved[name] = scale.moved(value, -_DISPLACED * scale.step)
    return camera.shoot(moved, _PHOTO_SEED, spp=options.photo_spp).mean


def gather(camera, values, options):
    """(parameter, estimator) -> Gathered alone, the same in a fit of all parameters, and the median
    CPU seconds by kind of render.

    A render that carries derivatives has other paths than one that does not. Alone differences are
    between pictures without. In a fit the picture carries what is not a difference, and so does one
    that is held against it."""
    photo = photo_of(camera, values, options)
    names = tuple(values)
    kinds = [(n, e) for n in names for e in (DETACHED, *(p.name for p in PAIRS))]
    alone, in_fit = ({kind: Gathered() for kind in kinds} for _ in range(2))
    cpu = {"joint": [], "primal": []} | {name: [] for name in names}
    cpu |= {_without(name): [] for name in names}
    for seed in range(options.seeds):
        base = camera.shoot(values, seed, names)
        cpu["joint"].append(base.cpu)
        plain = camera.shoot(values, seed)
        cpu["primal"].append(plain.cpu)
        for name in names:
            scale = Scale(name)
            if seed < _TIMED:
                cpu[name].append(camera.shoot(values, seed, (name,)).cpu)
            slope, covariance = detached_of(base, name, scale.slope(values[name]))
            for gathered in (alone, in_fit):
                gathered[name, DETACHED].add(slope, covariance, base, photo)
            others = tuple(other for other in names if other != name)
            carrying = camera.shoot(values, seed, others)
            cpu[_without(name)].append(carrying.cpu)

            def shots(pair, base, slots, name=name, scale=scale, seed=seed):
                result = {0: base}
                for offset in pair.offsets:
                    moved = scale.moved(values[name], offset * scale.step)
                    own = _OTHER_SEEDS if len(pair.offsets) == 2 else 0
                    result[offset] = camera.shoot(values | {name: moved}, seed + own, slots)
                return result

            for pair in PAIRS:
                distance = (pair.above + pair.below) * scale.step
                pictures = shots(pair, plain, ())
                alone[name, pair.name].add(*_difference(pair, pictures, distance), plain, photo)
                if len(pair.offsets) == 1:
                    pictures = shots(pair, carrying, others)
                in_fit[name, pair.name].add(*_difference(pair, pictures, distance), carrying, photo)
    return alone, in_fit, {kind: float(np.median(seconds)) for kind, seconds in cpu.items()}


def _difference(pair, shots, distance):
    """Derivative picture, and its covariance with the picture at the values."""
    high, low = shots[pair.above], shots[-pair.below]
    slope = (high.mean - low.mean) / distance
    if len(pair.offsets) == 2:
        return slope, np.zeros_like(slope)
    return slope, half_covariance(shots[0], slope, (high.half_a - low.half_a) / distance)


def _without(name):
    """Kind of render: all parameters but one are carried."""
    return f"without {name}"


def _cost_in_fit(pair, name, cpu):
    others = cpu[_without(name)]
    return 2 * others if len(pair.offsets) == 1 else others + 2 * cpu["primal"]


def rows_of(material, roughness, found, options):
    """Rows of the table; `found`: of `gather`."""
    alone, in_fit, cpu = found
    pairs = {pair.name: pair for pair in PAIRS}
    rows, reference = [], {}
    for (name, estimator), gathered in alone.items():
        renders = len(pairs[estimator].offsets) if estimator in pairs else 0
        mean, gradient, power = gathered.mean_picture(), gathered.gradient(), gathered.power()
        # The derivative alone: two pictures; with the loss, the picture at the values as well.
        seconds = 2 * cpu["primal"] if renders else cpu[name]
        with_loss = (1 + renders) * cpu["primal"] if renders else cpu[name]
        in_step = _cost_in_fit(pairs[estimator], name, cpu) if renders else cpu["joint"]
        step = in_fit[name, estimator].gradient().variance
        costs = np.array([gradient.variance * with_loss, step * in_step, power])
        reference.setdefault(name, costs)
        relative = costs / np.maximum(reference[name], 1e-300)
        errors = [np.sqrt(s.variance / options.seeds) for s in (mean, gradient)]
        numbers = (
            seconds, mean.mean, errors[0], np.sqrt(mean.variance * seconds), relative[2],
            gradient.mean, errors[1], np.sqrt(relative[0]), np.sqrt(relative[1]), gradient.doubt,
        )  # fmt: skip
        row = (material, roughness, name, estimator, *(float(f"{x:.4g}") for x in numbers))
        rows.append(dict(zip(COLUMNS, row, strict=True)))
    return rows


def table(rows, name, cell):
    """Roughness across, materials and estimators down."""
    chosen = [row for row in rows if row["parameter"] == name]
    roughnesses = sorted({row["roughness"] for row in chosen})
    cells = {(row["material"], row["estimator"], row["roughness"]): row for row in chosen}
    lines = [f"| {name} | | " + " | ".join(f"{r:g}" for r in roughnesses) + " |"]
    lines.append("|---" * (len(roughnesses) + 2) + "|")
    for material, estimator in dict.fromkeys((m, e) for m, e, _ in cells):
        shown = [cells.get((material, estimator, r)) for r in roughnesses]
        texts = [cell(row) if row else "" for row in shown]
        lines.append(f"| {material} | {estimator} | " + " | ".join(texts) + " |")
    return "\n".join(lines)


def markdown(rows):
    """Two tables per parameter: each estimator alone, and within a fit of everything."""

    def alone(row):
        return f"{1e3 * row['mean_noise']:.2g} / {row['loss']:.2g} / {row['power']:.2g}"

    names = dict.fromkeys(row["parameter"] for row in rows)
    parts = ["Alone: 1000 mean / loss / power; the last two relative to detached."]
    parts += [table(rows, name, alone) for name in names]
    parts += [
        "In a fit of all parameters: gradient of the loss at equal CPU, relative to detached."
    ]
    parts += [table(rows, name, lambda row: f"{row['step']:.2g}") for name in names]
    return "\n\n".join(parts) + "\n"


def parse():
    parser = argparse.ArgumentParser(
        prog="./dev bench estimators", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    add = parser.add_argument
    add("material", nargs="*", help=f"of {', '.join(MATERIALS)} (all)")
    add("--roughness", type=float, nargs="*", default=ROUGHNESSES, help="(%(default)s)")
    add("--only", nargs="*", help="parameters to differentiate (all)")
    add("--mesh", choices=stage.MESHES, default="bunny_6598", help="(%(default)s)")
    add("--lighting", choices=stage.LIGHTINGS, default="lamp", help="(%(default)s)")
    add("--size", type=int, default=64, help="pixels, square (%(default)s)")
    add("--spp", type=int, default=4, help="samples a pixel, even (%(default)s)")
    add("--seeds", type=int, default=16, help="(%(default)s)")
    add("--photo-spp", type=int, default=128, help="(%(default)s)")
    add("--out", type=Path, default=ROOT / "build" / "estimators", help="(%(default)s)")
    options = parser.parse_args()
    wrong = [name for name in options.material if name not in MATERIALS]
    if wrong:
        parser.error(f"material '{wrong[0]}' is unknown; choose of {', '.join(MATERIALS)}")
    if options.spp < 2 or options.spp % 2:
        parser.error(f"--spp {options.spp} has to be even: two halves are compared")
    return options


def measure(material, roughness, options):
    """Rows of one material at one roughness."""
    fixed, free = MATERIALS[material]
    values = free | {"roughness": roughness}
    scene = scenes.make(options.mesh, options.lighting, fixed | values, 1)
    if options.only:
        values = {name: value for name, value in values.items() if name in options.only}
    camera = Camera(scene, options.size, options.spp)
    return rows_of(material, roughness, gather(camera, values, options), options)


def main():
    options = parse()
    begin = time.process_time()
    rows = []
    for material in options.material or MATERIALS:
        for roughness in options.roughness:
            rows += measure(material, roughness, options)
            spent = time.process_time() - begin
            print(f"{material} {roughness:g}: {spent:.0f} CPU s", file=sys.stderr, flush=True)
    options.out.mkdir(parents=True, exist_ok=True)
    with (options.out / "estimators.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        writer.writerows(rows)
    text = markdown(rows)
    (options.out / "estimators.md").write_text(text, encoding="utf-8")
    print(text)
    print(f"{time.process_time() - begin:.0f} CPU s; {options.out}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
