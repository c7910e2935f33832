# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures the colours of thin films in Blender 4.5 and writes native/model/tables/film_table.cpp.

    .venv/bin/python devtools/measure_thin_film.py [--check]

Cycles renders films as Belcour and Barla 2017 (native/model/thin_film.h). It keeps the Fourier
transform of the eye's sensitivity to a channel over differences between optical paths, as magnitude
and phase in 512 nodes, read with linear interpolation. A reflectance at normal incidence is a sum
of cosines of these, so many thicknesses of two films give the nodes by least squares.

The set-up: a face for each thickness, black but for its reflection; an orthographic camera and a
sun of angle 0, both above; 1 sample, box filter. A pixel is then a reflectance without noise.
--check writes nothing, but compares the committed table with what Cycles renders of another film.
"""

from __future__ import annotations

import argparse
import math
import os
import re
import sys
import tempfile
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parent.parent
TABLE = ROOT / "native" / "model" / "tables" / "film_table.cpp"
NODES = 512
STEP = 60000 / (2 * math.pi) / (NODES - 1)  # nm
ORDERS = (1, 2, 3)
FADING = 30.0  # nm
WIDTH, HEIGHT = 128, 64  # faces, and pixels
# Index below the film, and of the film: no colour of these is cut off at 0.
MEASURED, CHECKED = ((2.9, 2.5), (2.7, 2.2)), (2.5, 0.5)

Floats = NDArray[np.float64]


def reflectances(thickness: Floats, below: float, film: float) -> Floats:
    """(n, 3) of Cycles, for as many thicknesses as there are faces."""
    build(thickness, below, film)
    filmed = render()
    build(np.zeros_like(thickness), below, film)
    return filmed / render() * ((below - 1) / (below + 1)) ** 2


def build(thickness: Floats, below: float, film: float) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene: Any = bpy.context.scene  # there is one: the factory settings bring it
    material: Any = bpy.data.materials.new("film")
    material.use_nodes = True
    tree = material.node_tree
    principled = tree.nodes["Principled BSDF"]
    principled.distribution = "GGX"
    given = {"Base Color": (0, 0, 0, 1), "Roughness": 0.5, "IOR": below, "Thin Film IOR": film}
    for name, value in given.items():
        principled.inputs[name].default_value = value
    attribute = tree.nodes.new("ShaderNodeAttribute")
    attribute.attribute_name = "film"
    tree.links.new(attribute.outputs["Fac"], principled.inputs["Thin Film Thickness"])
    row = WIDTH + 1
    corners = [(x, y, 0) for y in range(HEIGHT + 1) for x in range(row)]
    faces = [
        (at, at + 1, at + row + 1, at + row)
        for at in (y * row + x for y in range(HEIGHT) for x in range(WIDTH))
    ]
    mesh: Any = bpy.data.meshes.new("faces")
    mesh.from_pydata(corners, [], faces)
    mesh.materials.append(material)
    mesh.attributes.new("film", "FLOAT", "FACE").data.foreach_set(
        "value", thickness.astype(np.float32)
    )
    view: Any = bpy.data.cameras.new("camera")
    view.type, view.ortho_scale = "ORTHO", WIDTH
    camera: Any = bpy.data.objects.new("camera", view)
    camera.location = (WIDTH / 2, HEIGHT / 2, 10)
    lamp: Any = bpy.data.lights.new("sun", "SUN")
    lamp.energy, lamp.angle = math.pi, 0
    for item in (bpy.data.objects.new("faces", mesh), camera, bpy.data.objects.new("sun", lamp)):
        scene.collection.objects.link(item)
    scene.camera = camera
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = WIDTH, HEIGHT
    render.resolution_percentage = 100
    render.threads_mode, render.threads = "FIXED", 1
    cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = 1, False, False
    cycles.pixel_filter_type = "BOX"
    cycles.light_sampling_threshold = 0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    settings = render.image_settings
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR", "32", "NONE"


def render() -> Floats:
    with tempfile.TemporaryDirectory() as folder:
        scene: Any = bpy.context.scene
        scene.render.filepath = str(Path(folder) / "faces.exr")
        bpy.ops.render.render(write_still=True)
        image: Any = bpy.data.images.load(scene.render.filepath)
        pixels = np.empty(4 * WIDTH * HEIGHT, np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
    return pixels.reshape(-1, 4)[:, :3].astype(np.float64)


def amplitudes(cosine: Floats, index: Floats) -> tuple[tuple[Floats, Floats], Floats]:
    """What an interface reflects of both polarisations, and the cosine beyond."""
    beyond = np.sqrt(index**2 - (1 - cosine**2)) / index
    across = (cosine - index * beyond) / (cosine + index * beyond)
    along = (index * cosine - beyond) / (index * cosine + beyond)
    return (across, along), beyond


def series(thickness: Floats, below: float, film: float) -> tuple[Floats, Floats, Floats]:
    """The optical path, the reflectance without interference and the factor of each order."""
    t = np.clip(thickness / FADING, 0, 1)
    index = 1.0 + (film - 1) * t * t * (3 - 2 * t)
    top, cosine = amplitudes(np.ones(len(thickness)), index)
    bottom, _ = amplitudes(cosine, below / index)
    mean = np.zeros_like(thickness)
    orders = np.zeros((len(ORDERS), len(thickness)))
    for r, beyond in zip(top, bottom, strict=True):
        through = 1 - r * r
        rest = through**2 * beyond**2 / (1 - (r * beyond) ** 2)
        mean += (r * r + rest) / 2
        orders += [(rest - through) * (-r * beyond) ** m for m in ORDERS]
    return 2 * index * thickness * cosine, mean, orders


def modelled(table: Floats, path: Floats, mean: Floats, orders: Floats) -> tuple[Floats, Floats]:
    """(n,) reflectances of a channel by magnitude and phase, (2, NODES), and their derivatives."""
    found, slopes = mean.copy(), np.zeros((len(path), 2, NODES))
    rows = np.arange(len(path))
    for m, factor in zip(ORDERS, orders, strict=True):
        x = np.clip(m * path / STEP, 0, NODES - 1)
        low = np.minimum(x.astype(int), NODES - 2)
        ends = ((low, 1 - (x - low)), (low + 1, x - low))
        magnitude, phase = sum(table[:, at] * share for at, share in ends)
        found += factor * magnitude * np.cos(phase)
        for at, share in ends:
            slopes[rows, 0, at] += factor * np.cos(phase) * share
            slopes[rows, 1, at] -= factor * magnitude * np.sin(phase) * share
    return found, slopes.reshape(len(path), 2 * NODES)


def spectrum(wanted: Floats, path: Floats, mean: Floats, orders: Floats) -> Floats:
    """The table (2, NODES) of the sensitivity, piecewise linear in the wavelength, that explains
    the reflectances best: where the search for the nodes begins."""
    waves = np.arange(360.0, 831.0)
    hats = np.clip(1 - np.abs(waves[:, None] - waves[::5]) / 5, 0, None)

    def transform(paths: Floats) -> NDArray[np.complex128]:
        reached = np.minimum(paths, STEP * (NODES - 1))
        return np.asarray(np.exp(2j * np.pi * reached[:, None] / waves) @ hats)

    terms = sum(
        factor[:, None] * transform(m * path).real for m, factor in zip(ORDERS, orders, strict=True)
    )
    # Its integral is 1.
    system = np.vstack([terms, 10 * hats.sum(axis=0), 1e-7 * np.eye(hats.shape[1])])
    values = np.concatenate([wanted - mean, [10.0], np.zeros(hats.shape[1])])
    solution, *_ = np.linalg.lstsq(system, values, rcond=None)
    found = transform(np.arange(NODES) * STEP) @ solution
    found /= found[0].real
    return np.array([np.abs(found), np.unwrap(np.angle(found))])


def nodes_of(wanted: Floats, path: Floats, mean: Floats, orders: Floats) -> tuple[Floats, float]:
    """The table (2, NODES) of a channel by damped least squares, and its largest residual."""
    table = spectrum(wanted, path, mean, orders)
    pinned = np.zeros(2 * NODES)
    pinned[[0, NODES]] = 1e6  # the transform of no path is 1
    found, slopes = modelled(table, path, mean, orders)
    error = wanted - found
    damping = 1e-3
    while damping < 1e6:
        normal = slopes.T @ slopes
        added = damping * np.diag(normal) + 1e-9 + pinned
        step = np.linalg.solve(normal + np.diag(added), slopes.T @ error)
        trial = table + step.reshape(2, NODES)
        found, trial_slopes = modelled(trial, path, mean, orders)
        gain = error @ error - (wanted - found) @ (wanted - found)
        if gain <= 0:
            damping *= 4
            continue
        table, slopes, error = trial, trial_slopes, wanted - found
        damping = max(damping / 5, 1e-9)
        if gain < 1e-3 * (error @ error):
            break
    return table, float(np.abs(error).max())


def faces(film: float) -> Floats:
    """Thicknesses up to where the table ends, in the 32 bits of an attribute."""
    paths = np.linspace(0, 1.015 * STEP * (NODES - 1), WIDTH * HEIGHT)
    return (paths / (2 * film)).astype(np.float32).astype(np.float64)


def measure() -> tuple[Floats, float]:
    """The tables (channel, 2, NODES); the largest residual."""
    parts, wanted = [], []
    for below, film in MEASURED:
        thickness = faces(film)
        parts.append(series(thickness, below, film))
        wanted.append(reflectances(thickness, below, film))
    paths, means, orders = zip(*parts, strict=True)
    seen = (np.concatenate(paths), np.concatenate(means), np.concatenate(orders, axis=1))
    fits = [nodes_of(channel, *seen) for channel in np.concatenate(wanted).T]
    return np.array([table for table, _ in fits]), max(worst for _, worst in fits)


def check(tables: Floats) -> None:
    """Differences between the table and renders of another film."""
    below, film = CHECKED
    thickness = faces(film)
    seen = reflectances(thickness, below, film)
    part = series(thickness, below, film)
    ours = np.clip([modelled(table, *part)[0] for table in tables], 0, 1).T
    spread = np.percentile(np.abs(ours - seen) / seen.max(axis=1, keepdims=True), (50, 99, 100))
    sys.stderr.write(f"relative differences, median, 99 %, largest: {spread}\n")


def source(tables: Floats, names: tuple[str, str]) -> str:
    """The C++ of the tables (channel, 2, NODES)."""
    lines = [
        "// SPDX-License-Identifier: GPL-3.0-or-later",
        "//",
        f"// Written by devtools/{Path(sys.argv[0]).name} from what Cycles renders; do not edit.",
        f"// Measured with Blender {bpy.app.version_string}.",
        '#include "model/tables/film_table.h"',
        "",
        "namespace selenite {",
        "",
        "// clang-format off",
    ]
    for name, rows in zip(names, tables.swapaxes(0, 1), strict=True):
        lines.append(f"const float {name}[3][kFilmNodes] = {{")
        for row in rows:
            numbers = ", ".join(f"{value:.7g}" for value in row)
            lines += textwrap.wrap(
                f"{{{numbers}}},", 100, initial_indent=" " * 4, subsequent_indent=" " * 5
            )
        lines.append("};")
    return "\n".join([*lines, "// clang-format on", "", "}  // namespace selenite", ""])


def committed(table: Path) -> Floats:
    """The tables in a source."""
    text = "".join(part.split("};")[0] for part in table.read_text().split("= {")[1:])
    numbers = re.findall(r"-?\d[\d.e-]*", text)
    return np.array(numbers, np.float64).reshape(2, 3, NODES).swapaxes(0, 1)


def command(
    measured: Callable[[], tuple[Floats, float]],
    checked: Callable[[Floats], None],
    table: Path,
    names: tuple[str, str],
) -> None:
    """Measures, writes the source and compares it with what Cycles renders; does not return."""
    parser = argparse.ArgumentParser(description="Measures the colours of thin films in Cycles.")
    parser.add_argument("--check", action="store_true", help="compare, do not write")
    if not parser.parse_args().check:
        tables, residual = measured()
        sys.stderr.write(f"largest residual of the model: {residual:.1e}\n")
        table.write_text(source(tables, names))
    checked(committed(table))
    sys.stderr.flush()
    os._exit(0)  # bpy can hang in its own destructors


if __name__ == "__main__":
    command(measure, check, TABLE, ("kFilmMagnitude", "kFilmPhase"))
