# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench derivatives`: derivatives of the native render against differences of Cycles.

The mean of the picture, channel by channel: d/dp of Selenite against the central difference of
Cycles renders with equal seeds on both sides of p. Error bars come from several seeds. Status 1 if
one of them is four standard deviations away or more.
"""

import argparse
import json
import os
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "blender_tests")]

import bpy  # noqa: E402
import numpy as np  # noqa: E402
import parity_cases as parity  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.table import Table  # noqa: E402

from selenite import native, write_back  # noqa: E402
from selenite.cycles_check.compare import Estimate  # noqa: E402
from selenite.cycles_check.render import render  # noqa: E402
from selenite.scene_read.build import build  # noqa: E402
from selenite.scene_read.scene import read_scene  # noqa: E402

LIMIT = 4.0
_USUAL = {"base_color": (0.7, 0.45, 0.3), "emission_color": parity.TEAL, "emission_strength": 0.1}
# Every parameter lies inside its range, so that both sides of it can be rendered.
SCENES = {
    "opaque, lamp": ("lamp", {"roughness": 0.4, "metallic": 0.1, "transmission": 0.1, "ior": 1.5}),
    "glass, lamp": ("lamp", {"roughness": 0.25, "metallic": 0.1, "transmission": 0.8, "ior": 1.4}),
    "metal, sky": ("sky", {"roughness": 0.3, "metallic": 0.8, "transmission": 0.1, "ior": 1.5}),
    "glass, sky": ("sky", {"roughness": 0.2, "metallic": 0.1, "transmission": 0.8, "ior": 1.45}),
    "half, sun": ("sun", {"roughness": 0.35, "metallic": 0.2, "transmission": 0.5, "ior": 1.6}),
}
#: Half of the difference. None: a quarter of the value, the picture being linear in the emitters;
#: the others are extrapolated to 0 from h and 2 h (Richardson), which leaves an error of h^4.
STEPS = {
    ("Body", "base_color"): 0.03,
    ("Body", "roughness"): 0.02,
    ("Body", "transmission"): 0.03,
    ("Body", "ior"): 0.03,
    ("Body", "metallic"): 0.03,
    ("Body", "specular_level"): 0.1,
    ("Body", "emission_strength"): None,
    ("Lamp", "power"): None,
    ("World", "strength"): None,
}
_CENTRAL = {1: 1.0, -1: -1.0}
_RICHARDSON = {1: 8 / 6, -1: -8 / 6, 2: -1 / 6, -2: 1 / 6}
#: Of the sphere. Cycles sees other parts of a coarse smooth mesh by light sampling than by chance
#: (0.2 % of an emissive sphere of 48 segments), so that it has no single derivative there.
SEGMENTS = 128


def slopes_of_cycles(key, value, options, path):
    """Derivative picture by all components of a parameter together."""
    scene = bpy.context.scene
    owners = read_scene(scene).owners
    linear = STEPS[key] is None
    step = 0.25 * value[0] if linear else STEPS[key]
    offsets = _CENTRAL if linear or options.order == 2 else _RICHARDSON
    size = (scene.render.resolution_x, scene.render.resolution_y)
    pictures = []
    for seed in range(options.seeds):
        total = np.zeros((size[1], size[0], 3))
        for offset, weight in offsets.items():
            changed = tuple(number + offset * step for number in value)
            write_back.write(scene, owners, {key: changed})
            picture = render(scene, scene.camera.name, size, options.samples, seed, path)
            total += weight * picture.astype(np.float64)
        pictures.append(total / (2 * step))
    write_back.write(scene, owners, {key: value})
    return Estimate.of_seeds(pictures)


def slopes_of_ours(keys, options):
    """key -> derivative picture; the components of a colour are added up."""
    scene = bpy.context.scene
    size = (scene.render.resolution_x, scene.render.resolution_y)
    ready = build(read_scene(scene))
    film = native.core().render(
        ready, scene.camera.name, *size, options.native_samples, seed=11, parameters=list(keys)
    )
    assert not film.dropped, film.dropped
    found = {}
    for index, (owner, name, _) in enumerate(film.unknowns):
        mean = np.asarray(film.jacobian[index], np.float64)
        # Components of a colour act on channels of their own; where they do not, errors add up.
        error = np.asarray(film.jacobian_standard_error[index], np.float64)
        before = found.get((owner, name), (0.0, 0.0))
        found[owner, name] = (before[0] + mean, before[1] + error)
    return {key: Estimate(mean, error**2) for key, (mean, error) in found.items()}


def mean_of(estimate):
    """(mean, standard deviation) per channel over the pixels, which are independent."""
    pixels = estimate.mean.shape[0] * estimate.mean.shape[1]
    return estimate.mean.mean(axis=(0, 1)), np.sqrt(estimate.variance.sum(axis=(0, 1))) / pixels


def run_scene(name, options, path):
    """A row per parameter."""
    kind, values = SCENES[name]
    parity.make(parity.Case(name, kind, _USUAL | values), options.size, SEGMENTS)
    owners = read_scene(bpy.context.scene).owners
    keys = [key for key in STEPS if key[0] in owners]
    ours = slopes_of_ours(keys, options)
    rows = []
    for key in keys:
        if options.only and not any(word in f"{key[0]}:{key[1]}" for word in options.only):
            continue
        cycles = slopes_of_cycles(key, owners[key[0]].values[key[1]], options, path)
        (mean, error), (wanted, noise) = mean_of(ours[key]), mean_of(cycles)
        z = (mean - wanted) / np.maximum(np.hypot(error, noise), 1e-12)
        rows.append({
            "scene": name,
            "parameter": f"{key[0]}:{key[1]}",
            "selenite": mean.tolist(),
            "selenite_error": error.tolist(),
            "cycles": wanted.tolist(),
            "cycles_error": noise.tolist(),
            "z": z.tolist(),
            "passed": bool((np.abs(z) < LIMIT).all()),
        })  # fmt: skip
        print(f"{name}: {rows[-1]['parameter']}", file=sys.stderr, flush=True)
    return rows


def table(rows):
    shown = Table(title="d mean picture / d parameter: Selenite, Cycles (green channel), z of RGB")
    for column in ("scene", "parameter", "Selenite", "+-", "Cycles", "+-", "differ by", "z", ""):
        shown.add_column(column, justify="left" if column in {"scene", "parameter"} else "right")
    for row in rows:
        numbers = [row[k][1] for k in ("selenite", "selenite_error", "cycles", "cycles_error")]
        share = 100 * (numbers[0] - numbers[2]) / max(abs(numbers[2]), 1e-12)
        cells = [f"{number:.5f}" for number in numbers]
        verdict = "[green]pass" if row["passed"] else "[bold red]FAIL"
        z = " ".join(f"{value:+.1f}" for value in row["z"])
        shown.add_row(row["scene"], row["parameter"], *cells, f"{share:+.1f} %", z, verdict)
    Console(stderr=True, width=130).print(shown)


def main():
    parser = argparse.ArgumentParser(prog="./dev bench derivatives", description=__doc__)
    add = parser.add_argument
    add("only", nargs="*", help="only parameters whose name contains one of these")
    add("--scene", action="append", default=[], help=f"of {', '.join(SCENES)}")
    add("--size", type=int, default=48, help="pixels (%(default)s)")
    add("--samples", type=int, default=64, help="of Cycles per seed (%(default)s)")
    add("--seeds", type=int, default=8, help="of Cycles (%(default)s)")
    add("--native-samples", type=int, default=4096, help="(%(default)s)")
    add("--order", type=int, choices=(2, 4), default=4, help="2: no extrapolation, half the time")
    add("--out", type=Path, default=ROOT / "build" / "derivatives", help="(%(default)s)")
    options = parser.parse_args()
    begin = time.perf_counter()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name in options.scene or SCENES:
            rows += run_scene(name, options, Path(folder) / "cycles.exr")
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "report.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    table(rows)
    failed = sum(not row["passed"] for row in rows)
    seconds = time.perf_counter() - begin
    print(
        f"{len(rows) - failed} passed, {failed} failed in {seconds:.0f} s; {options.out}",
        file=sys.stderr,
        flush=True,
    )
    return 1 if failed or not rows else 0


if __name__ == "__main__":
    status = main()
    os._exit(status)  # bpy can hang in its own destructors
