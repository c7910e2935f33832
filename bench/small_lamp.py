# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench small-lamp`: noise of glass with a medium under a small lamp.

The standard deviation between renders with equal settings and different seeds, over all pixels of
the body but the brightest 3 % (the lamp's mirror image), over their mean; and CPU seconds of a
picture. Status 1 where a ball is noisier than 0.3.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench")]

import numpy as np  # noqa: E402
from extreme.scenes import Mesh, Stage, box  # noqa: E402
from synthetic.stage import icosphere, look_at  # noqa: E402

from selenite import native  # noqa: E402

_LIMIT = 0.3
_MIRRORED = 0.03  # share of the pixels
_LAMP = np.array([1.95, -1.3, 2.6])


def scene(mesh: Mesh, roughness: float, radius: float) -> Any:  # noqa: ANN401 - a native Scene has no Python type
    """A body of jade under nothing but a lamp."""
    jade = {
        "base_color": 1, "transmission": 1, "ior": 1.5, "roughness": roughness,
        "extinction": 2, "albedo": [0.9, 0.81, 0.72],
    }  # fmt: skip
    stage = Stage(jade, mesh)
    towards = look_at(_LAMP, np.zeros(3))
    stage.builder.add_point_light("Lamp", towards, 500, np.ones(3), radius, True)
    stage.world(0)
    stage.camera((0, -5, 0), (0, 0, 0), 60)
    return stage.build()


def noise(scene: Any, size: int, samples: int, seeds: int) -> tuple[float, float]:  # noqa: ANN401
    """Over the mean; CPU seconds of a picture."""
    films = [native.core().render(scene, "Camera", size, size, samples, seed=seed + 1)
             for seed in range(seeds)]  # fmt: skip
    pictures = np.array([film.image for film in films], float)
    mean = pictures.mean((0, 3))
    body = (mean > 0) & (mean < np.quantile(mean[mean > 0], 1 - _MIRRORED))
    deviation = np.sqrt(pictures.var(0, ddof=1).mean(-1)[body].mean())
    return deviation / mean[body].mean(), sum(film.cpu_seconds for film in films) / seeds


def main() -> int:
    parser = argparse.ArgumentParser(prog="./dev bench small-lamp", description=__doc__)
    parser.add_argument("--size", type=int, default=128, help="pixels (default 128)")
    parser.add_argument("--samples", type=int, default=32, help="per pixel (default 32)")
    parser.add_argument("--seeds", type=int, default=6, help="renders of each (default 6)")
    parser.add_argument("--radius", type=float, default=0.1, help="of the lamp (default 0.1)")
    options = parser.parse_args()
    late = False
    print(f"{'body':6}{'roughness':>10}{'noise':>8}{'CPU s':>8}")
    for name, mesh in (("ball", icosphere(5)), ("box", box(0.7, 0.7, 0.7))):
        for roughness in (0.0, 0.1, 0.2, 0.3, 0.45):
            made = scene(mesh, roughness, options.radius)
            found, seconds = noise(made, options.size, options.samples, options.seeds)
            print(f"{name:6}{roughness:10g}{found:8.3f}{seconds:8.2f}", flush=True)
            late = late or (name == "ball" and found > _LIMIT)
    return int(late)


if __name__ == "__main__":
    sys.exit(main())
