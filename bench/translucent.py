# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench translucent`: which model explains photos of a translucent body.

Cycles photographs a bumpy cube of 60 units, rough glass over a medium that scatters forwards: 18
cameras, 28 places of a small lamp, one on at a time, a dark background. `selenite fit` fits some of
the photos by each model, from a scene whose lamp and cameras are a little wrong, and `selenite
render` shows the others. A row for each model: relative RMSE of these inside the mask, without the
noise of photos and renders, its standard error by the noise of the renders, and the time of the
fit. With --patterned the albedo of the true medium is a marbled grid; the model `true` is that body
in the scene of the fits, which nothing is fitted of, and `auto` is `selenite fit --model auto`.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench"), str(ROOT / "blender_tests")]

import bpy  # noqa: E402
import made_scenes as made  # type: ignore[import-not-found]  # noqa: E402
from mathutils import Vector  # noqa: E402
from synthetic.in_process import report_of  # noqa: E402

from selenite import native  # noqa: E402
from selenite.capture.views import eroded  # noqa: E402
from selenite.cycles_check.render_settings import set_comparison  # noqa: E402
from selenite.scene_read.scene import read_scene  # noqa: E402
from selenite.scene_read.values import GridValues  # noqa: E402
from selenite.write_back import grids as grid_objects  # noqa: E402

_CAMERAS, _LAMPS = 18, 28
_SIZE, _CAMERA_AWAY, _LAMP_AWAY = 60.0, 363.0, 300.0  # units
_ASPECT = 436 / 291
_ROUGHNESS, _DENSITY, _COLOUR, _ANISOTROPY = 0.4, 0.12, (0.985, 0.96, 0.9), 0.6
_LAMP_FAULT, _CAMERA_FAULT = 1.12, 1.0  # factor on the power; pixels
#: What is fitted by each model, and the numbers of the scene that it starts from.
MODELS = {
    "constant": "Body:base_color",
    "opaque": "Body:base_color_texture,roughness",
    "medium": "Body:extinction,albedo,roughness",
}
_START_DENSITY = 0.05
#: The model that `selenite fit --model` finds, and the true one.
CHAIN, TRUE = "auto", "true"
#: Renders of each held-out photo, with random numbers of their own.
_REPEATS = 4
#: Voxels along a side of the pattern, and the albedo of its dark veins.
_VOXELS, _VEINS = 32, (0.93, 0.75, 0.5)


@dataclass(frozen=True)
class Capture:
    """camera, lamp: indices of places. halves: files of two photos with noise of their own."""

    id: str
    camera: int
    lamp: int
    halves: tuple[Path, Path]
    photo: Path


def _places(count: int, away: float, lowest: float) -> np.ndarray:
    """(count, 3) places spread over a sphere, down to a share of its radius below its middle."""
    k = np.arange(count) + 0.5
    z = 1 - (1 + lowest) * k / count
    turn = math.pi * (1 + math.sqrt(5)) * k
    flat = np.sqrt(1 - z * z)
    return away * np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)


def _body() -> Any:  # noqa: ANN401
    """The cube: round edges, bumps, the UVs of its faces."""
    bpy.ops.mesh.primitive_cube_add(size=2)
    item = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.subdivide(number_cuts=23)
    bpy.ops.object.mode_set(mode="OBJECT")
    mesh = item.data
    place = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", place)
    place = place.reshape(-1, 3)
    place /= (np.abs(place) ** 10).sum(1, keepdims=True) ** 0.1
    bumps = np.sin(5 * place[:, 0] + 1) * np.sin(6 * place[:, 1]) * np.sin(4 * place[:, 2] + 2)
    place *= _SIZE / 2 * (1 + 0.05 * bumps[:, None])
    mesh.vertices.foreach_set("co", place.ravel())
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    return item


def _scene(width: int) -> Any:  # noqa: ANN401
    """Body, lamp, cameras; the body is opaque and grey."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.image_settings.color_mode = "RGBA"
    scene.render.film_transparent = True
    _body().data.materials.append(made.material("Body", base_color=(0.5, 0.5, 0.5), roughness=0.5))
    lamp = made.light("Lamp", "POINT", energy=5e6, shadow_soft_size=2.0)
    lamp.visible_camera = False
    for index, place in enumerate(_places(_CAMERAS, _CAMERA_AWAY, 0.3)):
        item = made.camera(f"Camera {index}", clip_end=1000)
        item.location = place
        item.rotation_euler = (-Vector(place)).to_track_quat("-Z", "Y").to_euler()
    # made.camera sets a size of its own.
    scene.render.resolution_x, scene.render.resolution_y = width, round(width / _ASPECT)
    return scene


def _fill(roughness: float, density: float, colour: Sequence[float], anisotropy: float) -> None:
    """Makes the body glass over a medium."""
    body = bpy.data.materials["Body"]
    for parameter, value in (("transmission", 1), ("roughness", roughness), ("ior", 1.45)):
        made.socket(body, parameter).default_value = value
    made.socket(body, "base_color").default_value = (1, 1, 1, 1)
    node = body.node_tree.nodes.new("ShaderNodeVolumePrincipled")
    node.inputs["Density"].default_value = density
    node.inputs["Color"].default_value = (*colour, 1)
    node.inputs["Anisotropy"].default_value = anisotropy
    body.node_tree.links.new(node.outputs[0], body.node_tree.get_output_node("ALL").inputs[1])


def _true_body(folder: Path, *, patterned: bool) -> None:
    """Makes the body what the photos show."""
    _fill(_ROUGHNESS, _DENSITY, _COLOUR, _ANISOTROPY)
    if not patterned:
        return
    at = np.linspace(-1, 1, _VOXELS)
    z, y, x = np.meshgrid(at, at, at, indexing="ij")
    bent = x + 0.4 * np.sin(4 * y + 1) + 0.3 * np.sin(5 * z)
    veins = (0.5 + 0.5 * np.sin(6 * bent))[..., None] ** 2
    albedo = (np.array(_COLOUR) * (1 - veins) + np.array(_VEINS) * veins).astype(np.float32)
    values = read_scene(bpy.context.scene)
    corners = np.array([bpy.data.objects["Cube"].matrix_world @ Vector(c) for c in _corners()])
    low, high = corners.min(0), corners.max(0)
    to_unit = np.eye(4)
    to_unit[:3, :3], to_unit[:3, 3] = np.diag(1 / (high - low)), -low / (high - low)
    grid = GridValues("pattern", albedo, to_unit)
    grid_objects.show(bpy.context.scene, values, "Body", {"albedo": grid}, folder)


def _corners() -> Any:  # noqa: ANN401
    return bpy.data.objects["Cube"].bound_box


def photograph(
    folder: Path, count: int, width: int, samples: int, *, patterned: bool
) -> list[Capture]:
    """Photos of the true body; cameras stand beside where the scenes of the fits have them."""
    scene = _scene(width)
    _true_body(folder, patterned=patterned)
    draw = np.random.default_rng(1)
    lamps = _places(_LAMPS, _LAMP_AWAY, 1.0)
    captures = []
    for index in range(count):
        camera, lamp = index % _CAMERAS, 11 * index % _LAMPS
        item = bpy.data.objects[f"Camera {camera}"]
        scene.camera = item
        item.data.shift_x, item.data.shift_y = draw.normal(0, _CAMERA_FAULT / width, 2)
        bpy.data.objects["Lamp"].location = lamps[lamp]
        halves = (folder / f"{index}a.exr", folder / f"{index}b.exr")
        photo = folder / f"{index}.exr"
        captures.append(Capture(f"photo{index}", camera, lamp, halves, photo))
        if photo.exists():  # of an earlier run
            continue
        for half, path in enumerate(halves):
            set_comparison(scene, samples // 2, seed=2 * index + half)
            # Its noise is far beyond a camera's: the lamp is small, and found through the glass.
            scene.cycles.use_denoising = True
            scene.render.filepath = str(path)
            bpy.ops.render.render(write_still=True)
        seen = [native.image().read(str(path)) for path in halves]
        mean = np.dstack([(seen[0][0] + seen[1][0]) / 2, seen[0][1]])
        native.image().write_exr(str(photo), np.ascontiguousarray(mean, np.float32))
    return captures


def list_captures(path: Path, captures: Sequence[Capture]) -> Path:
    """Writes the file of captures."""
    lamps = _places(_LAMPS, _LAMP_AWAY, 1.0)
    rows = [
        {
            "id": item.id, "camera": f"Camera {item.camera}", "photo": str(item.photo),
            "response": "linear", "transforms": {"Lamp": lamps[item.lamp].tolist()},
        }
        for item in captures
    ]  # fmt: skip
    path.write_text(json.dumps({"schema": 1, "captures": rows}), encoding="utf-8")
    return path


def error_of_unseen(
    scene: Path, unseen: Sequence[Capture], samples: int, folder: Path
) -> tuple[float, float]:
    """The error, and its standard error by the noise of the renders. Products of differences with
    noise of their own have no bias by it."""
    captures = list_captures(folder / "unseen.json", unseen)
    left, light = np.zeros(_REPEATS), 0.0
    for item in unseen:
        photos = [native.image().read(str(path)) for path in item.halves]
        inside = eroded(np.minimum(photos[0][1], photos[1][1]) > 0.99, 2)
        light += float((photos[0][0] * photos[1][0])[inside].sum())
        for repeat in range(_REPEATS):
            differences = []
            for half, (seen, _, _) in enumerate(photos):
                out = folder / f"unseen{half}.exr"
                report_of(
                    "render", str(scene), "--captures", str(captures), "--capture", item.id,
                    "--spp", str(samples // 2), "--seed", str(2 * repeat + half + 1),
                    "--out", str(out),
                )  # fmt: skip
                shown = native.image().read(str(out))[0]
                differences.append((shown - seen)[inside].astype(float))
            left[repeat] += float((differences[0] * differences[1]).sum())
    squares = left / light
    error = math.copysign(math.sqrt(abs(squares.mean())), squares.mean())
    return error, float(squares.std(ddof=1) / math.sqrt(_REPEATS) / (2 * abs(error)))


def examine(
    model: str, captures: Sequence[Capture], options: argparse.Namespace, more: Sequence[str],
    folder: Path, table: TextIO,
) -> None:  # fmt: skip
    """Writes the row of a model."""
    scene = _scene(options.width)
    bpy.data.lights["Lamp"].energy *= _LAMP_FAULT
    if model.startswith("medium"):
        _fill(0.3, _START_DENSITY, (0.9, 0.9, 0.9), _ANISOTROPY)
    if model == TRUE:
        _true_body(folder, patterned=options.patterned)
    scene.camera = bpy.data.objects["Camera 0"]
    start, fitted = folder / f"{model}.blend", folder / f"{model}_fitted.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(start))
    unseen = list(captures)[options.fit :]
    listed = list_captures(folder / "fit.json", list(captures)[: options.fit])
    if model == TRUE:
        error, sure = error_of_unseen(start, unseen, options.samples, folder)
        print(f"| {model} | {error:.3f} ± {sure:.3f} | | | |", file=table, flush=True)
        return
    begin, cpu = time.monotonic(), time.process_time()
    what = ("--model", f"Body:{model}") if model == CHAIN else ("--fit", MODELS[model])
    result = report_of(
        "fit", str(start), *what, "--captures", str(listed), "--out",
        str(folder / "fits"), "--save", str(fitted), "--height", str(options.height), *more,
    )  # fmt: skip
    seconds, cpu = time.monotonic() - begin, time.process_time() - cpu
    error, sure = error_of_unseen(fitted, unseen, options.samples, folder)
    numbers = "; ".join(
        f"{name.partition(':')[2]} {np.round(entry['value'], 4).tolist()}"
        for name, entry in result["parameters"].items()
    )
    print(
        f"| {model} | {error:.3f} ± {sure:.3f} | {seconds:.0f} | {cpu:.0f} | {numbers} |",
        file=table, flush=True,
    )  # fmt: skip
    for row in result.get("models", ()):
        off = "hidden by noise" if row["held_out"] is None else f"{row['held_out']:.3f}"
        end = "kept" if row["kept"] else "left"
        print(f"  {row['model']}: {off}, {row['cpu_seconds']:.0f} s, {end}", file=table, flush=True)
    for line in result["warnings"]:
        print(f"  {line}", file=table, flush=True)


def main() -> int:
    """Prints the table."""
    asked = argparse.ArgumentParser(prog="./dev bench translucent", description=__doc__)
    asked.add_argument("--photos", type=int, default=16, help="(%(default)s; the whole set: 51)")
    asked.add_argument("--fit", type=int, default=12, help="of them, the rest judges (%(default)s)")
    asked.add_argument("--width", type=int, default=109, help="of the photos (%(default)s)")
    asked.add_argument("--samples", type=int, default=256, help="of photos, renders (%(default)s)")
    asked.add_argument("--height", type=int, default=72, help="of the fits (%(default)s)")
    asked.add_argument(
        "--models", nargs="+", default=["constant", "opaque", "medium"],
        choices=[*MODELS, CHAIN, TRUE],
    )  # fmt: skip
    asked.add_argument("--patterned", action="store_true", help="the medium's albedo is marbled")
    asked.add_argument(
        "--folder", help="kept; a run with the same size and samples takes its photos"
    )
    options, more = asked.parse_known_args()  # the rest goes to the fits
    table = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what Blender prints
    with tempfile.TemporaryDirectory(prefix="selenite-translucent-") as place:
        folder = Path(options.folder or place)
        folder.mkdir(exist_ok=True)
        begin = time.monotonic()
        captures = photograph(
            folder, options.photos, options.width, options.samples, patterned=options.patterned
        )
        print(f"{len(captures)} photos in {time.monotonic() - begin:.0f} s\n", file=table)
        print(
            "| model | held out | seconds | CPU seconds | found |\n|---|---|---|---|---|",
            file=table,
        )
        for model in options.models:
            examine(model, captures, options, more, folder, table)
    return 0


if __name__ == "__main__":
    status = main()
    sys.stderr.flush()
    os._exit(status)  # bpy may hang in its own destructors
