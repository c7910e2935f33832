# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench shape-race`: an iteration on vertices, against one of Mitsuba 3, in CPU time.

A picture of a dented ball under a lamp or a sky, direct light alone, and the derivative of its mean
squared difference from a constant by every vertex, with `prb_projective`. Both take turns, so that
what else the machine does hits both. Differences of Mitsuba's pictures as the body grows judge both
derivatives from outside. Status 1 if a ratio lies below --require.
"""

import argparse
import json
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "blender_tests"), str(ROOT / "bench" / "peer")]

import made_scenes as made  # noqa: E402
import numpy as np  # noqa: E402
import scenes  # noqa: E402
from mitsuba_process import Mitsuba  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.table import Table  # noqa: E402

from selenite import native  # noqa: E402
from selenite.scene_read.build import build  # noqa: E402

COLOUR = (0.6, 0.45, 0.3)
DIRECT = 1  # bounces


def matte():
    material = made.material("Body", base_color=COLOUR, roughness=1.0)
    made.principled(material).inputs["Specular IOR Level"].default_value = 0.0
    return material


def race(kind, guiding, folder, options):
    description = scenes.make(kind, options.size, folder, matte, options.subdivisions)
    description["body"]["reflectance"] = COLOUR
    path = folder / f"{kind}.json"
    path.write_text(json.dumps(description), encoding="utf-8")
    scene = build(made.read())
    evaluator = native.core().Evaluator(scene, depth=DIRECT, threads=options.threads)
    size = (options.size, options.size)
    reference = np.full((*size, 3), 0.3, np.float32)
    photo = native.core().Photo("Camera", reference)
    vertices = scene.vertices("Body").astype(float)
    mitsuba = Mitsuba(options.peer_python, "mitsuba_shape.py", path, options.threads, guiding)
    mitsuba.ask(spp=options.spp, seed=1)  # compiles
    first, second, growth = [], [], ([], [], [])
    for seed in range(2, 2 + options.rounds):
        first.append(mitsuba.ask(spp=options.spp, seed=seed)["cpu"])
        started = time.process_time()
        evaluator.gradient(
            photo, "Body", "vertex_positions", options.spp, loss="squared_error", seed=seed
        )
        second.append(time.process_time() - started)
    for seed in range(options.judge_rounds):
        asked = {"spp": options.judge_spp, "seed": 1000 + seed, "judge": True}
        theirs = mitsuba.ask(**asked)
        growth[0].append(theirs["difference"])
        growth[1].append(theirs["growth"])
        _, slopes = evaluator.gradient(
            photo, "Body", "vertex_positions", options.judge_spp, seed=1000 + seed
        )
        growth[2].append(float((slopes * vertices).sum()))
    mitsuba.close()
    means = [np.mean(one) for one in growth]
    errors = [np.std(one, ddof=1) / np.sqrt(len(one)) for one in growth]
    return {
        "light": kind, "guiding": guiding, "vertices": len(vertices),
        "mitsuba_cpu_s": float(np.median(first)), "selenite_cpu_s": float(np.median(second)),
        "ratio": float(np.median(first) / np.median(second)),
        "growth": [float(x) for x in means], "growth_error": [float(x) for x in errors],
    }  # fmt: skip


def main():
    parser = argparse.ArgumentParser(prog="./dev bench shape-race", description=__doc__)
    add = parser.add_argument
    add("--peer-python", type=Path, required=True, help="Python of the environment with Mitsuba")
    add("--lights", nargs="+", default=["lamp", "sky"], choices=["lamp", "sky"])
    add("--guiding", nargs="+", default=["none", "octree"], help="of prb_projective (%(default)s)")
    add("--size", type=int, default=64, help="pixels (%(default)s)")
    add("--spp", type=int, default=16, help="(%(default)s)")
    add("--subdivisions", type=int, default=5, help="of the ball (%(default)s: 2562 vertices)")
    add("--threads", type=int, default=1, help="of both (%(default)s)")
    add("--rounds", type=int, default=5, help="turns of both (%(default)s)")
    add("--judge-spp", type=int, default=128, help="for the derivatives (%(default)s)")
    add("--judge-rounds", type=int, default=4, help="likewise (%(default)s)")
    add("--require", type=float, default=0.0, help="the least Mitsuba / Selenite (%(default)s)")
    add("--out", type=Path, default=ROOT / "build" / "shape-race", help="(%(default)s)")
    options = parser.parse_args()
    folder = options.out.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    rows = [
        race(kind, guiding, folder, options)
        for kind in options.lights
        for guiding in options.guiding
    ]
    (folder / "report.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    shown = Table(title=f"CPU seconds of an iteration on vertices, {options.threads} threads")
    for column in (
        "light",
        "guiding",
        "Mitsuba",
        "Selenite",
        "ratio",
        "growth: differences, theirs, ours",
    ):
        shown.add_column(column, justify="right")
    for row in rows:
        growth = ", ".join(
            f"{mean:.4f} +- {error:.4f}"
            for mean, error in zip(row["growth"], row["growth_error"], strict=True)
        )
        seconds = [f"{row[key]:.3f}" for key in ("mitsuba_cpu_s", "selenite_cpu_s")]
        shown.add_row(row["light"], row["guiding"], *seconds, f"{row['ratio']:.1f}", growth)
    Console(stderr=True, width=130).print(shown)
    return 1 if any(row["ratio"] < options.require for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
