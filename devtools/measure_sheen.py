# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures the sheen lobe of Cycles and writes native/model/tables/sheen_table.cpp.

    .venv/bin/python devtools/measure_sheen.py [--check]

Cycles' sheen is a linearly transformed cosine (Zeltner, Burley and Chiang 2022): with z the normal,
x in the plane of the viewer and (x, y, z) the light,

    f cos = R z / pi (a / ((a x + b z)^2 + (a y)^2 + z^2))^2,

and a, b and the albedo R are tables over the viewer's cosine and the roughness, 32 x 32, read with
bilinear interpolation. They are a published fit to simulations and follow from no formula, but
they follow from what Cycles renders: g = sqrt(z / (pi f)) is linear in three unknowns,

    g = P (1 - z^2) + Q x z + S z^2,
    P = a / sqrt R,  Q = 2 b / sqrt R,  S = (b^2 + 1) / (a sqrt R),

so a few lights give them by least squares, and then R = 1 / (P S - Q^2 / 4). Done at the nodes and
between them, this gives the tables, again by least squares: also at the nodes of cosine 0, where
nothing is seen, and at those where Cycles leaves the lobe out.

The set-up: triangles in the plane z = 0, one per roughness, black but for the sheen; an
orthographic camera; a sun of angle 0; 1 sample, box filter. A pixel is then f cos without noise.
--check writes nothing, but compares the committed table with what Cycles renders between the nodes.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
import tempfile
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parent.parent
TABLE = ROOT / "native" / "model" / "tables" / "sheen_table.cpp"
NODES = 32
# Where it is measured, in nodes: on them, but for 0, and twice between them.
AXIS = np.sort([k + f for k in range(NODES - 1) for f in (0.25, 0.75, 1)]) / (NODES - 1)
PIXELS = 4  # from triangle to triangle
LIGHTS = [  # cosine, azimuth from the plane of the viewer in degrees
    (0.95, 20),
    (0.8, 160),
    (0.7, 75),
    (0.5, 0),
    (0.5, 180),
    (0.35, 110),
    (0.2, 45),
    (0.15, 150),
    (0.6, 130),
    (0.3, 20),
]
TINT = 100.0  # lifts what Cycles would leave out as too dark

Floats = NDArray[np.float64]


def build_scene(roughnesses: Floats) -> tuple[bpy.types.Object, bpy.types.Object]:
    """Triangles of all roughnesses; the camera and the sun to be turned."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene: Any = bpy.context.scene  # there is one: the factory settings bring it
    length = 1000.0  # in pixels: also a grazing view sees nothing but triangles
    for k, roughness in enumerate(roughnesses):
        material: Any = bpy.data.materials.new(f"sheen {k}")
        material.use_nodes = True
        sockets = material.node_tree.nodes["Principled BSDF"].inputs
        sockets["Base Color"].default_value = (0, 0, 0, 1)
        sockets["Specular IOR Level"].default_value = 0
        sockets["Sheen Weight"].default_value = 1
        sockets["Sheen Roughness"].default_value = roughness
        sockets["Sheen Tint"].default_value = (TINT, TINT, TINT, 1)
        y, half = PIXELS * (k + 0.5 - len(roughnesses) / 2), PIXELS / 2
        mesh = bpy.data.meshes.new(f"triangle {k}")
        corners = [(-length, y - half, 0), (3 * length, y, 0), (-length, y + half, 0)]
        mesh.from_pydata(corners, [], [(0, 1, 2)])
        mesh.materials.append(material)
        scene.collection.objects.link(bpy.data.objects.new(f"triangle {k}", mesh))
    view = bpy.data.cameras.new("camera")
    view.type = "ORTHO"
    view.ortho_scale = PIXELS * len(roughnesses)
    view.clip_end = 1e5
    lamp = bpy.data.lights.new("sun", "SUN")
    lamp.energy, lamp.angle = 1, 0
    camera, sun = bpy.data.objects.new("camera", view), bpy.data.objects.new("sun", lamp)
    for turned in (camera, sun):
        turned.rotation_mode = "QUATERNION"
        scene.collection.objects.link(turned)
    scene.camera = camera
    scene.world = bpy.data.worlds.new("black")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = PIXELS * len(roughnesses), 4  # Blender's least
    render.resolution_percentage = 100
    render.threads_mode, render.threads = "FIXED", 1
    cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = 1, False, False
    cycles.pixel_filter_type = "BOX"
    cycles.light_sampling_threshold = 0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    settings = render.image_settings
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR", "32", "NONE"
    return camera, sun


def turn(thing: bpy.types.Object, z: Vector, x: Vector, distance: float = 0) -> Floats:
    """Puts the local z axis along `z`; returns where it points, in Blender's 32 bits."""
    y: Any = cast("Vector", z.cross(x)).normalized()
    rows: Any = (y.cross(z), y, z)
    axes: Any = Matrix(rows).transposed()
    thing.rotation_quaternion = axes.to_quaternion()
    thing.location = z * distance
    cast("Any", bpy.context.view_layer).update()
    return np.array(thing.matrix_world.col[2][:3], dtype=np.float64)


def render(folder: Path) -> Floats:
    """f cos of each roughness."""
    file = folder / "row.exr"
    cast("Any", bpy.context.scene).render.filepath = str(file)
    bpy.ops.render.render(write_still=True)
    image: Any = bpy.data.images.load(str(file))
    pixels = np.empty(4 * image.size[0] * image.size[1], dtype=np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    row: Floats = pixels.reshape(4, -1, 4)[1, PIXELS // 2 :: PIXELS, 0] / TINT
    return row


def views(roughnesses: Floats, cosines: Floats) -> Iterator[tuple[float, Floats, Floats]]:
    """For each viewer's cosine: x, y, z of the lights in the lobe's frame, (lights, 3), and f cos,
    (lights, roughnesses)."""
    camera, sun = build_scene(roughnesses)
    with tempfile.TemporaryDirectory() as name:
        for cosine in cosines:
            turn(camera, Vector((np.sqrt(1 - cosine**2), 0, cosine)), Vector((0, 1, 0)), 1e4)
            # At exactly normal incidence Cycles' tangent is this one.
            x_axis = np.array([1, -1, 0]) / np.sqrt(2) if cosine == 1 else np.array([1, 0, 0])
            frame = np.array([x_axis, [-x_axis[1], x_axis[0], 0], [0, 0, 1]])
            lights, seen = [], []
            for z, azimuth in LIGHTS:
                s, turned = np.sqrt(1 - z * z), np.radians(azimuth)
                local = np.array([s * np.cos(turned), s * np.sin(turned), z])
                lights.append(frame @ turn(sun, Vector(local @ frame), Vector((0.6, 0.8, 0.1))))
                seen.append(render(Path(name)))
            yield cosine, np.array(lights), np.array(seen)


def measure() -> tuple[Floats, float]:
    """The tables (3, roughness, cosine) of a, b, R; the largest relative residual of the model."""
    weights, entries = [], []
    worst = 0.0
    for cosine, lights, seen in views(AXIS, AXIS):
        for roughness, f in zip(AXIS, seen.T, strict=True):
            if (f > 0).all():
                entry, residual = solve(lights, f)
                weights.append(weight_of_nodes(roughness, cosine).ravel())
                entries.append(entry)
                worst = max(worst, residual)
    table, *_ = np.linalg.lstsq(np.array(weights), np.array(entries), rcond=1e-6)
    table[np.abs(table) < 5e-6] = 0  # noise where there is nothing
    return table.T.reshape(3, NODES, NODES), worst


def weight_of_nodes(roughness: float, cosine: float) -> Floats:
    """(roughness, cosine) weights of bilinear interpolation."""
    nodes = np.arange(NODES)
    along, across = (
        np.clip(1 - np.abs(x * (NODES - 1) - nodes), 0, None) for x in (roughness, cosine)
    )
    return np.outer(along, across)


def check(table: Floats) -> None:
    """Differences between the table and renders at points between the nodes."""
    points = (np.arange(2 * NODES - 2) + 0.37) / (2 * NODES - 2)
    errors = []
    for cosine, lights, seen in views(points, points):
        x, y, z = lights.T
        for roughness, f in zip(points, seen.T, strict=True):
            a, b, albedo = (table * weight_of_nodes(roughness, cosine)).sum(axis=(1, 2))
            value = albedo * z / np.pi * (a / ((a * x + b * z) ** 2 + (a * y) ** 2 + z * z)) ** 2
            if albedo < 1e-5 or a < 1e-5:  # Cycles leaves it out
                value *= 0
            errors.append(np.abs(value - f).max() / max(f.max(), 1e-4))
    spread = np.percentile(errors, (50, 99, 100))
    sys.stderr.write(f"relative differences, median, 99 %, largest: {spread}\n")


def solve(lights: Floats, f_cos: Floats) -> tuple[Floats, float]:
    """a, b, R from f cos at several lights, and the largest relative residual."""
    x, _, z = lights.T
    terms = np.array([1 - z * z, x * z, z * z]).T
    g = np.sqrt(z / (np.pi * f_cos))
    (p, q, s), *_ = np.linalg.lstsq(terms / g[:, None], np.ones(len(g)), rcond=None)
    albedo = 1 / (p * s - q * q / 4)
    entry = np.array([p * np.sqrt(albedo), q * np.sqrt(albedo) / 2, albedo])
    return entry, float(np.abs((terms @ np.array([p, q, s]) / g) ** -2 - 1).max())


def source(table: Floats) -> str:
    lines = [
        "// SPDX-License-Identifier: GPL-3.0-or-later",
        "//",
        "// Written by devtools/measure_sheen.py from what Cycles renders; do not edit.",
        f"// Measured with Blender {bpy.app.version_string}.",
        '#include "model/tables/sheen_table.h"',
        "",
        "namespace selenite {",
        "",
        "// clang-format off",
        "const float kSheenTable[3][32][32] = {",
    ]
    for name, rows in zip(("a", "b", "albedo"), table, strict=True):
        lines.append(f"    {{  // {name}")
        for row in rows:
            numbers = ", ".join(f"{value:.6g}" for value in row)
            lines += textwrap.wrap(
                f"{{{numbers}}},", 100, initial_indent=" " * 8, subsequent_indent=" " * 9
            )
        lines.append("    },")
    return "\n".join([*lines, "};", "// clang-format on", "", "}  // namespace selenite", ""])


def committed() -> Floats:
    """The table in the source."""
    text = TABLE.read_text().split("= {")[1].split("};")[0]
    numbers = re.findall(r"-?\d[\d.e-]*", re.sub("//.*", "", text))
    return np.array(numbers, dtype=np.float64).reshape(3, NODES, NODES)


def main() -> None:
    parser = argparse.ArgumentParser(description="Measures the sheen lobe of Cycles.")
    parser.add_argument("--check", action="store_true", help="compare, do not write")
    if not parser.parse_args().check:
        table, residual = measure()
        sys.stderr.write(f"largest residual of the model: {residual:.1e}\n")
        TABLE.write_text(source(table))
    check(committed())
    sys.stderr.flush()
    os._exit(0)  # bpy can hang in its own destructors


if __name__ == "__main__":
    main()
