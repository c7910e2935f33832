# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench lights`: what photos under lamps that are switched cost.

One camera, as many photos as lamps, one lamp on in each, against the same fit in a scene that has
one lamp, which all photos show. CPU seconds of the whole fit, in turns, and of one render. Status 1
where the switched lamps take more than 1.2 times as long.
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench")]

import numpy as np  # noqa: E402
from synthetic.stage import icosphere, look_at  # noqa: E402

from selenite import native  # noqa: E402

_LIMIT = 1.2
_PHOTO_SEED = 987654321


def stage(lamps: int, of: int) -> Any:  # noqa: ANN401 - a native Scene has no Python type
    """A ball on a floor under the first of so many lamps, which stand around it."""
    builder = native.core().SceneBuilder()
    usual = {"base_color": [0.5, 0.4, 0.3], "roughness": 1.0}
    floor = builder.add_material("Floor", usual)
    body = builder.add_material("Body", {"base_color": [0.7, 0.3, 0.2], "roughness": 0.4})
    square = np.array([[-9, -9, -1], [9, -9, -1], [9, 9, -1], [-9, 9, -1]], np.float32)
    two = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    up = np.tile(np.array([0, 0, 1], np.float32), (6, 1))
    positions, triangles = icosphere()
    positions, triangles = positions.astype(np.float32), triangles.astype(np.int32)
    ball = positions, triangles, positions[triangles.ravel()]
    meshes = {"Floor": (square, two, up), "Body": ball}
    for name, (positions, triangles, normals) in meshes.items():
        slots = np.zeros(len(triangles), np.int32)
        mesh = builder.add_mesh(name, positions, triangles, normals, slots)
        builder.add_object(name, mesh, np.eye(4), [floor if name == "Floor" else body])
    for index in range(lamps):
        angle = 2 * math.pi * index / of
        place = 4 * np.array([math.cos(angle), math.sin(angle), 1.0])
        builder.add_area_light(
            f"Lamp {index}", look_at(place, np.zeros(3)), 400, np.ones(3), "SQUARE", 1, 1, math.pi
        )
    builder.add_camera(
        "Camera", look_at(np.array([0, -6, 3.0]), np.zeros(3)), "PERSP", 50, 36, 24, "AUTO",
        0, 0, 1, 0.01, 100,
    )  # fmt: skip
    return builder.build()


def photos(scene: Any, lamps: list[str], size: int) -> list[Any]:  # noqa: ANN401
    """One for each of the lamps, which is on alone."""
    found = []
    for index, lamp in enumerate(lamps):
        lights = {"lamps": [lamp]}
        film = native.core().render(
            scene.with_lights(lights), "Camera", size, size, 256, seed=_PHOTO_SEED + index
        )
        picture = np.ascontiguousarray(film.image, np.float32)
        found.append(native.core().Photo("Camera", picture, id=f"{index}", lights=lights))
    return found


def fit(scene: Any, taken: list[Any], options: argparse.Namespace) -> float:  # noqa: ANN401
    """CPU seconds."""
    unknowns = [
        native.core().Unknown("Body", "base_color", 0.0, 1.0, [0.4] * 3),
        native.core().Unknown("Body", "roughness", 0.05, 1.0, 0.6),
    ]
    settings = {
        "iterations": options.iterations, "spp": options.spp, "threads": 1, "search": "off",
        "tolerance": 0.0,
    }  # fmt: skip
    job = native.core().Fit(scene, taken, unknowns, settings)
    job.start()
    job.join()
    return float(job.result().cpu_seconds)


def main() -> int:
    """Prints the table."""
    asked = argparse.ArgumentParser(prog="./dev bench lights", description=__doc__)
    asked.add_argument("--lamps", type=int, default=8, help="and photos (%(default)s)")
    asked.add_argument("--size", type=int, default=64, help="pixels of the photos (%(default)s)")
    asked.add_argument("--iterations", type=int, default=20, help="(%(default)s)")
    asked.add_argument("--spp", type=int, default=4, help="(%(default)s)")
    asked.add_argument("--rounds", type=int, default=3, help="(%(default)s)")
    options = asked.parse_args()
    many, one = stage(options.lamps, options.lamps), stage(1, options.lamps)
    names = [f"Lamp {index}" for index in range(options.lamps)]
    switched = photos(many, names, options.size)
    alone = photos(one, names[:1] * options.lamps, options.size)
    renders = {"one lamp": one, "switched": many.with_lights({"lamps": names[:1]}), "all on": many}
    times: dict[str, list[float]] = {name: [] for name in ("one lamp", "switched")}
    for _ in range(options.rounds):
        times["one lamp"].append(fit(one, alone, options))
        times["switched"].append(fit(many, switched, options))
    ratio = statistics.median(times["switched"]) / statistics.median(times["one lamp"])
    for name, seconds in times.items():
        print(f"fit, {name}: {' '.join(f'{s:.2f}' for s in seconds)} CPU s")
    print(f"switched lamps over one lamp: {ratio:.3f} (limit {_LIMIT})")
    for name, scene in renders.items():
        cpu = [
            native.core().render(scene, "Camera", 128, 128, 32, seed=k, threads=1).cpu_seconds
            for k in range(options.rounds)
        ]
        print(f"render, {name}: {statistics.median(cpu):.3f} CPU s")
    return int(ratio > _LIMIT)


if __name__ == "__main__":
    sys.exit(main())
