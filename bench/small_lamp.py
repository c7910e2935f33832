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
from lights import ball, facing_origin  # noqa: E402

from selenite import native  # noqa: E402

_LIMIT = 0.3
_MIRRORED = 0.03  # share of the pixels
_LAMP = np.array([1.95, -1.3, 2.6])


def box() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, triangles and flat corner normals."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 0.7
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], np.int32)
    a, b, c = (corners[triangles[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return corners.astype(np.float32), triangles, np.repeat(normals, 3, 0).astype(np.float32)


def scene(mesh: tuple[np.ndarray, np.ndarray, np.ndarray], roughness: float, radius: float) -> Any:  # noqa: ANN401 - a native Scene has no Python type
    """A body of jade under nothing but a lamp."""
    builder = native.core().SceneBuilder()
    jade = {
        "base_color": [1, 1, 1], "transmission": 1, "ior": 1.5, "roughness": roughness,
        "extinction": [2, 2, 2], "albedo": [0.9, 0.81, 0.72],
    }  # fmt: skip
    material = builder.add_material("Jade", jade)
    positions, triangles, normals = mesh
    slots = np.zeros(len(triangles), np.int32)
    body = builder.add_mesh("Body", positions, triangles, normals, slots)
    builder.add_object("Body", body, np.eye(4), [material])
    builder.add_point_light("Lamp", facing_origin(_LAMP), 500, np.ones(3), radius, True)
    builder.set_world(np.ones(3), 0)
    builder.add_camera(
        "Camera", facing_origin(np.array([0, -5, 0.0])), "PERSP", 60, 36, 24, "AUTO",
        0, 0, 1, 0.01, 100,
    )  # fmt: skip
    return builder.build()


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
    for name, mesh in (("ball", ball(64)), ("box", box())):
        for roughness in (0.0, 0.1, 0.2, 0.3, 0.45):
            made = scene(mesh, roughness, options.radius)
            found, seconds = noise(made, options.size, options.samples, options.seeds)
            print(f"{name:6}{roughness:10g}{found:8.3f}{seconds:8.2f}", flush=True)
            late = late or (name == "ball" and found > _LIMIT)
    return int(late)


if __name__ == "__main__":
    sys.exit(main())
