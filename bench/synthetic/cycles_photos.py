# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos of the stage by Cycles, from a process of its own that holds Blender.

Run as a script (`python cycles_photos.py FOLDER`) it renders what FOLDER/request.json asks for.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

#: Cycles renders in rounds of so many seeds, whose spread tells the noise. The rounds end where
#: that is low enough, and never look at the picture itself.
SEEDS, MOST_ROUNDS = 4, 12
_FIRST_SEED = 4321


@dataclass(frozen=True)
class Photos:
    """mean and variance of that mean: (cameras, size, size, 3), linear radiance; samples taken."""

    mean: np.ndarray
    variance: np.ndarray
    samples: int


def noise_of(variance: np.ndarray, cover: np.ndarray) -> float:
    """Root of the mean variance of a pixel over what shows the object, cover (..., h, w)."""
    return float(np.sqrt(variance.mean(axis=-1)[cover].mean()))


def take(
    mesh: str, lighting: str, cameras: int, values: dict[str, Any], size: int, samples: int,
    cover: np.ndarray, noise: float, image: np.ndarray | None = None,
) -> Photos:  # fmt: skip
    """Photos with at least `samples` per pixel, and more until `noise_of` them is at most `noise`.

    values: of the body, by parameter. cover: (cameras, size, size) bool. image: of the body's base
    colour, see `blender_scene.make`. Blocks until the other process is done; RuntimeError if it
    fails.
    """
    with tempfile.TemporaryDirectory(prefix="selenite-photos-") as place:
        folder = Path(place)
        request = {
            "stage": [mesh, lighting, cameras],
            "values": {name: np.ravel(value).tolist() for name, value in values.items()},
            "size": size,
            "samples": samples,
            "noise": noise,
        }
        (folder / "request.json").write_text(json.dumps(request), encoding="utf-8")
        np.save(folder / "cover.npy", cover)
        if image is not None:
            np.save(folder / "image.npy", image)
        done = subprocess.run(
            [sys.executable, __file__, place], stdin=subprocess.DEVNULL, capture_output=True,
            text=True, check=False,
        )  # fmt: skip
        made = folder / "photos.npz"
        if done.returncode or not made.is_file():
            raise RuntimeError(f"Cycles ended with status {done.returncode}: {done.stderr[-2000:]}")
        with np.load(made) as found:
            return Photos(found["mean"], found["variance"], int(found["samples"]))


def _render(folder: Path) -> None:
    """Leaves photos.npz."""
    import bpy  # noqa: F401 - before the native modules

    from selenite.cycles_check.compare import Estimate
    from selenite.cycles_check.render import render
    from synthetic import blender_scene, stage

    request = json.loads((folder / "request.json").read_text(encoding="utf-8"))
    cover = np.load(folder / "cover.npy")
    described = stage.make(*request["stage"])
    kept = folder / "image.npy"
    image = np.load(kept) if kept.is_file() else None
    scene = blender_scene.make(described, request["values"], image)
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    size, each = request["size"], -(-request["samples"] // SEEDS)
    pictures: list[list[np.ndarray]] = [[] for _ in described.cameras]
    for index in range(MOST_ROUNDS):
        for i, taken in enumerate(pictures):
            for seed in range(index * SEEDS, (index + 1) * SEEDS):
                path = folder / "cycles.exr"
                camera, at = f"Camera {i + 1}", _FIRST_SEED + seed
                taken.append(render(scene, camera, (size, size), each, at, path))
        estimates = [Estimate.of_seeds(taken) for taken in pictures]
        variance = np.stack([one.variance for one in estimates])
        if noise_of(variance, cover) <= request["noise"]:
            break
    mean = np.stack([one.mean for one in estimates]).astype(np.float32)
    samples = each * len(pictures[0])
    np.savez(folder / "photos.npz", mean=mean, variance=variance, samples=samples)


if __name__ == "__main__":
    bench = Path(__file__).resolve().parents[1]
    sys.path[:0] = [str(bench.parent / "addon"), str(bench)]
    _render(Path(sys.argv[1]))
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)  # bpy can hang in its own destructors
