# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench shape-derivatives [BODY ...]`: derivatives by vertices against differences.

A body over a floor under an area lamp: a sphere, and a decimated bunny of shared/data beside this
checkout (skipped where it is absent). The mean of the picture is differentiated by a coordinate of
each of 50 vertices that the camera sees, those of the outline among them, and compared with central
differences of our renders at several steps, and of Cycles'. A row each: root mean square of the
derivatives, the gap to the differences beyond their noise as a share of it, vertices whose |z| is
below 4, and the largest.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "blender_tests"), str(ROOT / "bench")]

import bpy  # noqa: E402
import made_scenes as made  # type: ignore[import-not-found]  # noqa: E402
from mathutils import Vector  # noqa: E402

from selenite import native  # noqa: E402
from selenite.cycles_check.render_settings import set_comparison  # noqa: E402
from selenite.scene_read.build import build  # noqa: E402

_BUNNY = ROOT.parent / "shared/data/meshes/bunny_6598.obj"
_SIZE, _COUNT = 24, 50  # pixels; vertices
_TRIANGLES = 400
BODIES = ("sphere", "bunny")


def _body(name: str) -> Any:  # noqa: ANN401
    if name == "sphere":
        bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8, radius=0.7)
        item = bpy.context.object
    else:
        bpy.ops.wm.obj_import(filepath=str(_BUNNY))
        item = bpy.context.selected_objects[0]
        bpy.context.view_layer.objects.active = item
        bpy.ops.object.transform_apply()
        modifier = item.modifiers.new("Decimate", "DECIMATE")
        modifier.ratio = _TRIANGLES / len(item.data.polygons)
        bpy.ops.object.modifier_apply(modifier=modifier.name)
        places = np.array([vertex.co for vertex in item.data.vertices])
        places -= (places.max(0) + places.min(0)) / 2
        places *= 0.8 / np.linalg.norm(places, axis=1).max()
        item.data.vertices.foreach_set("co", places.astype(np.float32).ravel())
    item.name = "Body"
    bpy.ops.object.modifier_add(type="TRIANGULATE")
    bpy.ops.object.modifier_apply(modifier=item.modifiers[-1].name)
    item.data.polygons.foreach_set("use_smooth", [True] * len(item.data.polygons))
    item.data.materials.clear()
    item.data.materials.append(made.material("Body", base_color=(0.7, 0.7, 0.7), roughness=0.5))
    return item


def _scene(name: str, depth: int) -> Any:  # noqa: ANN401
    bpy.ops.wm.read_factory_settings(use_empty=True)
    item = _body(name)
    bpy.ops.mesh.primitive_plane_add(size=8, location=(0, 0, -0.9))
    bpy.context.object.data.materials.append(made.material("Floor", base_color=(0.6, 0.6, 0.6)))
    lamp = made.light("Lamp", "AREA", energy=60, size=1.0)
    lamp.location, lamp.visible_camera = (1.5, -1, 2.5), False
    lamp.rotation_euler = (-Vector(lamp.location)).to_track_quat("-Z", "Y").to_euler()
    camera = made.camera("Camera")
    camera.location = (0.3, -4, 1.8)
    camera.rotation_euler = (
        (Vector((0, 0, -0.2)) - camera.location).to_track_quat("-Z", "Y").to_euler()
    )
    camera.data.angle = 0.8
    scene = bpy.context.scene
    scene.camera = camera
    scene.cycles.max_bounces = depth - 1
    scene.render.resolution_x = scene.render.resolution_y = _SIZE
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    return item


class _Sums:
    """Mean and its standard error of repeated rows."""

    def __init__(self) -> None:
        self._rows: list[np.ndarray] = []

    def add(self, row: np.ndarray) -> None:
        self._rows.append(np.asarray(row, float))

    def mean(self) -> np.ndarray:
        return np.mean(self._rows, axis=0)

    def error(self) -> np.ndarray:
        return np.std(self._rows, axis=0, ddof=1) / np.sqrt(len(self._rows))


def _compared(title: str, found: _Sums, wanted: _Sums) -> str:
    a, b = found.mean(), wanted.mean()
    noise = found.error() ** 2 + wanted.error() ** 2
    size = np.mean(a**2)
    gap = np.mean((a - b) ** 2 - noise) / size
    z = np.abs(a - b) / np.sqrt(noise)
    share = np.sign(gap) * np.sqrt(abs(gap))
    return (
        f"| {title} | {np.sqrt(size):.2e} | {100 * share:+.1f} % | {(z < 4).sum()} of {len(z)} | "
        f"{z.max():.1f} |"
    )


def _differences(
    mean: Callable[[np.ndarray, int], float], start: np.ndarray, chosen: Sequence[int],
    step: float, seeds: int,
) -> _Sums:  # fmt: skip
    """Central ones, with equal seeds on both sides."""
    sums = _Sums()
    for seed in range(seeds):
        row = []
        for number, vertex in enumerate(chosen):
            ends = []
            for side in (-step, step):
                moved = start.copy()
                moved[vertex, number % 3] += side
                ends.append(mean(moved, seed))
            row.append((ends[1] - ends[0]) / (2 * step))
        sums.add(np.array(row))
    return sums


def examine(name: str, options: argparse.Namespace, folder: Path) -> list[str]:
    """Rows of a body."""
    item = _scene(name, options.depth)
    read = made.read()
    scene = build(read)
    start = scene.vertices("Body")
    evaluator = native.core().Evaluator(scene, depth=options.depth)
    photo = native.core().Photo("Camera", size=(_SIZE, _SIZE))
    found, chosen = _Sums(), np.zeros(0, int)
    for seed in range(options.seeds):
        _, slopes = evaluator.gradient(
            photo, "Body", "vertex_positions", options.spp, seed=100 + seed
        )
        if not len(chosen):
            seen = np.flatnonzero(np.linalg.norm(slopes, axis=1) > 0)
            chosen = np.random.default_rng(1).permutation(seen)[:_COUNT]
        found.add([slopes[vertex, number % 3] for number, vertex in enumerate(chosen)])

    def ours(moved: np.ndarray, seed: int) -> float:
        there = scene.with_vertices("Body", moved.astype(np.float32))
        other = native.core().Evaluator(there, depth=options.depth)
        return float(other.picture(photo, options.spp, seed=seed).image.mean())

    def cycles(moved: np.ndarray, seed: int) -> float:
        item.data.vertices.foreach_set("co", moved.astype(np.float32).ravel())
        item.data.update()
        set_comparison(bpy.context.scene, options.cycles_samples, seed=seed)
        bpy.context.scene.cycles.max_bounces = options.depth - 1  # it sets as many as there are
        bpy.context.scene.render.filepath = str(folder / "moved.exr")
        bpy.ops.render.render(write_still=True)
        return float(native.image().read(str(folder / "moved.exr"))[0].mean())

    rows = [
        _compared(
            f"{name}, ours, step {step:g}", found,
            _differences(ours, start, chosen, step, options.seeds),
        )
        for step in options.steps
    ]  # fmt: skip
    if options.cycles_samples:
        step = options.cycles_step
        wanted = _differences(cycles, start, chosen, step, options.cycles_seeds)
        rows.append(_compared(f"{name}, Cycles, step {step:g}", found, wanted))
    return rows


def main() -> int:
    """Prints the table."""
    asked = argparse.ArgumentParser(prog="./dev bench shape-derivatives", description=__doc__)
    asked.add_argument("bodies", nargs="*", metavar="BODY", help=f"of {', '.join(BODIES)}; all")
    asked.add_argument("--depth", type=int, default=1, help="bounces (%(default)s: direct light)")
    asked.add_argument("--spp", type=int, default=256, help="of a render (%(default)s)")
    asked.add_argument("--seeds", type=int, default=8, help="(%(default)s)")
    asked.add_argument("--steps", type=float, nargs="+", default=[0.01, 0.004])
    asked.add_argument("--cycles-samples", type=int, default=2048, help="0: without Cycles")
    asked.add_argument("--cycles-seeds", type=int, default=8, help="(%(default)s)")
    asked.add_argument("--cycles-step", type=float, default=0.0015, help="(%(default)s)")
    options = asked.parse_args()
    table = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what Blender prints
    print("| differences | size | gap | |z| < 4 | largest |\n|---|---|---|---|---|", file=table)
    with tempfile.TemporaryDirectory(prefix="selenite-shape-") as place:
        for name in options.bodies or BODIES:
            if name == "bunny" and not _BUNNY.is_file():
                print(f"{name}: skipped, {_BUNNY} is absent", file=table, flush=True)
                continue
            print("\n".join(examine(name, options, Path(place))), file=table, flush=True)
    return 0


if __name__ == "__main__":
    status = main()
    sys.stderr.flush()
    os._exit(status)  # bpy may hang in its own destructors
