# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench texture-race`: an iteration on a bitmap, against one of Mitsuba 3, in CPU time.

A diffuse body whose colour is an image: a picture, and the derivative by every texel of its mean
squared difference from a constant. Both take turns, so that what else the machine does hits both.
The derivative of the picture's mean by every texel judges ours from outside: it has to agree with
Mitsuba's to 1 % in all blocks of texels together, and by a correlation of 0.99 block by block.
Status 1 if it does not, or if a ratio lies below --require.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "blender_tests"), str(ROOT / "bench" / "peer")]

import numpy as np  # noqa: E402
import scenes  # noqa: E402
from mitsuba_process import Mitsuba  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.table import Table  # noqa: E402

from selenite import native  # noqa: E402

SELENITE = Path(sys.executable).parent / "selenite"
NAME = "Body_base_color_texture_texels.exr"
BLOCKS = 16  # a side of the image


def ours(folder, spp, seed, threads, *words):
    command = [SELENITE, "gradient", folder / "skin.blend", "--camera=Camera", f"--spp={spp}"]
    command += ["--parameter=Body:base_color_texture", f"--seed={seed}", f"--threads={threads}"]
    done = subprocess.run([*command, "--json", *words], check=True, stdout=subprocess.PIPE)
    return json.loads(done.stdout)


def blocks(gradient):
    """Sums over blocks of texels, in which noise matters less."""
    side = gradient.shape[0] // BLOCKS
    return gradient.reshape(BLOCKS, side, BLOCKS, side, 3).sum(axis=(1, 3))


def agreement(mitsuba, folder, options):
    """(sum of ours over Mitsuba's, correlation of the blocks) of d mean / d texel."""
    theirs = []
    for seed in range(4):
        mitsuba.ask(spp=options.judge_spp // 4, seed=1000 + seed, out=str(folder / "theirs.npy"))
        theirs.append(np.load(folder / "theirs.npy").astype(np.float64))
    wanted = blocks(np.mean(theirs, axis=0).reshape(options.texels, options.texels, 3))
    ours(folder, options.judge_spp, 1, options.threads, f"--out-dir={folder / 'slopes'}")
    found = blocks(native.image().read(str(folder / "slopes" / NAME))[0].astype(np.float64))
    return found.sum() / wanted.sum(), np.corrcoef(found.ravel(), wanted.ravel())[0, 1]


def race(mitsuba, folder, spp, options):
    first, second, means = [], [], []
    mitsuba.ask(spp=spp, seed=1)  # compiles
    for index in range(options.rounds):
        theirs = mitsuba.ask(spp=spp, seed=2 + index)
        mine = ours(folder, spp, 2 + index, options.threads, "--repeat=3")
        first.append(theirs["cpu"])
        second.append(np.median(mine["iteration_cpu_seconds"]))
        means.append(np.array(mine["mean_image"]) / theirs["mean"])
    mitsuba_s, selenite_s = float(np.median(first)), float(np.median(second))
    return {
        "spp": spp,
        "mitsuba_cpu_s": mitsuba_s,
        "selenite_cpu_s": selenite_s,
        "ratio": mitsuba_s / selenite_s,
        "mean_ratio": np.mean(means, axis=0).tolist(),
    }


def show(rows, options):
    title = f"CPU seconds of an iteration on {options.texels} x {options.texels} texels"
    shown = Table(title=f"{title}, {options.threads} threads")
    for column in ("pixels", "samples", "Mitsuba", "Selenite", "ratio", "means R G B", "by texels"):
        shown.add_column(column, justify="right")
    for row in rows:
        seconds = [f"{row[key]:.4f}" for key in ("mitsuba_cpu_s", "selenite_cpu_s")]
        cells = [f"{row['size']} x {row['size']}", str(row["spp"]), *seconds, f"{row['ratio']:.2f}"]
        means = " ".join(f"{value:.3f}" for value in row["mean_ratio"])
        judged = f"{row['slope_ratio']:.3f}, r = {row['correlation']:.4f}"
        shown.add_row(*cells, means, judged)
    Console(stderr=True, width=110).print(shown)


def main():
    parser = argparse.ArgumentParser(prog="./dev bench texture-race", description=__doc__)
    add = parser.add_argument
    add("--peer-python", type=Path, required=True, help="Python of the environment with Mitsuba")
    add("--size", type=int, action="append", default=[], help="pixels, may be repeated (256)")
    add("--spp", type=int, action="append", default=[], help="may be repeated (4)")
    add("--texels", type=int, default=512, help="a side of the image (%(default)s)")
    add("--threads", type=int, default=1, help="of both (%(default)s)")
    add("--rounds", type=int, default=5, help="turns of both (%(default)s)")
    add("--judge-spp", type=int, default=128, help="for the derivatives (%(default)s)")
    add("--require", type=float, default=0.0, help="the least Mitsuba / Selenite (%(default)s)")
    add("--out", type=Path, default=ROOT / "build" / "texture-race", help="(%(default)s)")
    options = parser.parse_args()
    folder = options.out.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for size in options.size or [256]:
        description = scenes.make_textured(size, folder, options.texels)
        (folder / "skin.json").write_text(json.dumps(description), encoding="utf-8")
        mitsuba = Mitsuba(
            options.peer_python, "mitsuba_texture.py", folder / "skin.json", options.threads
        )
        slope_ratio, correlation = agreement(mitsuba, folder, options)
        judged = {"size": size, "slope_ratio": slope_ratio, "correlation": correlation}
        rows += [judged | race(mitsuba, folder, spp, options) for spp in options.spp or [4]]
        mitsuba.close()
    (folder / "report.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    show(rows, options)
    wrong = any(abs(row["slope_ratio"] - 1) > 0.01 or row["correlation"] < 0.99 for row in rows)
    return 1 if wrong or any(row["ratio"] < options.require for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
