# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench equivalence`: rough glass with a medium in it, against Mitsuba 3.

Mitsuba's `roughdielectric` (GGX) around a `homogeneous` medium is, up to a roughness of 0.3, what
Cycles renders without energy compensation; so it judges the native render from outside. Passes: the
mean over the object differs by at most 0.5 % beyond two standard deviations in each channel.

Under a lamp (--light lamp) they differ on purpose at a roughness of 0.3, by about 1 %: Cycles takes
light samples through micronormals that could not refract them (Flavour in native/model), and so do
we. Without that they agree there too.
"""

import argparse
import itertools
import json
import os
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "blender_tests"), str(ROOT / "bench" / "peer")]

import bpy  # noqa: E402
import numpy as np  # noqa: E402
import parity_cases as parity  # noqa: E402
import scenes  # noqa: E402
from mitsuba_process import Mitsuba  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.table import Table  # noqa: E402

from selenite import native  # noqa: E402
from selenite.scene_read.build import build  # noqa: E402
from selenite.scene_read.scene import read_scene  # noqa: E402

LIMIT, DEVIATIONS = 0.005, 2.0
IOR, ALBEDO = 1.49, (0.412, 0.824, 0.999)
SPP, SEEDS = 32, 8  # of one round: Mitsuba's renders, and ours with all of their samples


def ours(mask, seed):
    """(mean over the mask, its variance) of the open file."""
    scene = bpy.context.scene
    size = (scene.render.resolution_x, scene.render.resolution_y)
    film = native.core().render(build(read_scene(scene)), "Camera", *size, SPP * SEEDS, seed=seed)
    assert not film.dropped, film.dropped
    error = np.asarray(film.standard_error, np.float64)[mask]
    mean = np.asarray(film.image, np.float64)[mask].mean(axis=0)
    return mean, (error**2).sum(axis=0) / len(error) ** 2


def compare(mitsuba, description, mask, options):
    """A row of the report. The rule that ends the rounds uses the noise alone."""
    scenes.set_body(description["body"])
    mitsuba.ask(load=description)
    means, variances, theirs = [], [], []
    for index in range(options.rounds):
        mean, variance = ours(mask, 1000 + index)
        means.append(mean)
        variances.append(variance)
        seeds = range(index * SEEDS, (index + 1) * SEEDS)
        theirs += [mitsuba.ask(spp=SPP, seed=1 + seed)["mean"] for seed in seeds]
        mean, wanted = np.mean(means, axis=0), np.mean(theirs, axis=0)
        variance = np.sum(variances, axis=0) / len(variances) ** 2
        variance = variance + np.var(theirs, axis=0, ddof=1) / len(theirs)
        noise = np.sqrt(variance) / wanted
        if index > 0 and noise.max() <= options.noise:
            break
    difference = mean / wanted - 1
    return {
        "selenite": mean.tolist(),
        "mitsuba": wanted.tolist(),
        "difference": difference.tolist(),
        "noise": noise.tolist(),
        "samples": SPP * SEEDS * len(means),
        "passed": bool((np.abs(difference) <= LIMIT + DEVIATIONS * noise).all()),
    }


def table(rows):
    shown = Table(title=f"Selenite / Mitsuba - 1: mean over the object, IOR {IOR}")
    for column in ("light", "rough", "sigma_t", "g", "R", "G", "B", "+-", "max |z|", ""):
        shown.add_column(column, justify="left" if column == "light" else "right")
    for row in rows:
        cells = [f"{row[name]:g}" for name in ("roughness", "sigma_t", "g")]
        cells += [f"{100 * value:+.2f} %" for value in row["difference"]]
        z = np.abs(np.array(row["difference"]) / row["noise"]).max()
        cells += [f"{100 * max(row['noise']):.2f} %", f"{z:.1f}"]
        verdict = "[green]pass" if row["passed"] else "[bold red]FAIL"
        shown.add_row(row["light"], *cells, verdict)
    Console(stderr=True, width=110).print(shown)


def numbers(text):
    return [float(word) for word in text.split(",")]


def main():
    parser = argparse.ArgumentParser(prog="./dev bench equivalence", description=__doc__)
    add = parser.add_argument
    add("--peer-python", type=Path, required=True, help="Python of the environment with Mitsuba")
    add("--light", action="append", choices=("sky", "lamp"), default=[], help="(sky)")
    add("--roughness", type=numbers, default=[0.1, 0.2, 0.3], help="(.1,.2,.3)")
    add("--sigma-t", type=numbers, default=[0.4, 3.0], help="0: no medium (.4,3)")
    add("--g", type=numbers, default=[0.0, 0.5], help="(0,.5)")
    add("--size", type=int, default=48, help="pixels (%(default)s)")
    add("--noise", type=float, default=0.0015, help="of the difference (%(default)s)")
    add("--rounds", type=int, default=12, help="at most, to get there (%(default)s)")
    add("--out", type=Path, default=ROOT / "build" / "equivalence", help="(%(default)s)")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    begin = time.perf_counter()
    rows = []
    mitsuba = Mitsuba(options.peer_python, "mitsuba_side.py")
    with tempfile.TemporaryDirectory() as folder:
        for light in options.light or ("sky",):
            description = scenes.make(light, options.size, Path(folder))
            mask = parity.mask_of()
            description["mask"] = str(Path(folder) / "mask.npy")
            np.save(description["mask"], mask)
            for values in itertools.product(options.roughness, options.sigma_t, options.g):
                case = dict(zip(("roughness", "sigma_t", "g"), values, strict=True))
                description["body"] |= case | {"ior": IOR, "albedo": ALBEDO}
                rows.append({"light": light} | case | compare(mitsuba, description, mask, options))
                reported = "pass" if rows[-1]["passed"] else "FAIL"
                print(f"{len(rows)}: {light} {case}: {reported}", file=sys.stderr, flush=True)
                text = json.dumps(rows, indent=1) + "\n"
                (options.out / "report.json").write_text(text, encoding="utf-8")
    mitsuba.close()
    table(rows)
    failed = sum(not row["passed"] for row in rows)
    seconds = time.perf_counter() - begin
    reported = f"{len(rows) - failed} passed, {failed} failed in {seconds:.0f} s; {options.out}"
    print(reported, file=sys.stderr, flush=True)
    return 1 if failed or not rows else 0


if __name__ == "__main__":
    status = main()
    os._exit(status)  # bpy can hang in its own destructors
