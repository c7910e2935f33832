# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows of quads that shine, each a material of its own, for pictures without noise.

All corners of a quad have the same coordinates (and colours), so that a pixel is one look-up,
whoever takes it and wherever in the pixel. Cycles renders all rows at once, and so do we.
"""

import sys
from pathlib import Path

import bpy
import made_scenes as made
import numpy as np
import pytest

COUNT = 24


def assert_equals_cycles(result):
    """result: a case's (ours, Cycles'), (COUNT, 3) each, or why there is none."""
    if isinstance(result, str):
        pytest.skip(result)
    ours, cycles = result
    np.testing.assert_allclose(ours, cycles, rtol=1e-4, atol=2e-5)


class NotHere(Exception):
    """Why this Blender does not have a case."""


def texture(material, found, **settings):
    """An Image Texture node."""
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = found
    for name, value in settings.items():
        setattr(node, name, value)
    return node


def shine(material, output, parameter="emission_color"):
    """Links an output to an input of the Principled node."""
    material.node_tree.links.new(output, made.socket(material, parameter))


COLOURS = [
    ("ByteCorner", "BYTE_COLOR", "CORNER"),
    ("BytePoint", "BYTE_COLOR", "POINT"),
    ("FloatCorner", "FLOAT_COLOR", "CORNER"),
    ("FloatPoint", "FLOAT_COLOR", "POINT"),
]


def strip(row, material, random):
    """A row of quads, all corners of each with the same coordinates and colours."""
    x, y = np.meshgrid(np.arange(COUNT), [row], indexing="ij")
    corner = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    places = np.stack([x, y, 0 * x], -1).reshape(-1, 1, 3) + corner
    faces = np.arange(4 * COUNT).reshape(-1, 4)
    mesh = bpy.data.meshes.new("Strip")
    mesh.from_pydata(places.reshape(-1, 3).tolist(), [], faces.tolist())
    for name in ("UVMap", "Second"):
        layer = mesh.uv_layers.new(name=name)
        uvs = random.uniform(-1.7, 2.7, (COUNT, 2))
        layer.data.foreach_set("uv", np.repeat(uvs, 4, axis=0).ravel())
    for name, kind, domain in COLOURS:
        attribute = mesh.color_attributes.new(name, kind, domain)
        colors = np.repeat(random.uniform(0, 1, (COUNT, 4)), 4, axis=0)
        attribute.data.foreach_set("color", colors.ravel())
    mesh.materials.append(material)
    made.add(f"Strip {row}", mesh)
    return mesh


def shining(name):
    """Nothing but emission."""
    material = made.material(name)
    inputs = made.principled(material).inputs
    inputs["Base Color"].default_value = (0, 0, 0, 1)
    level = "Specular IOR Level" if "Specular IOR Level" in inputs else "Specular"
    inputs[level].default_value = 0
    made.socket(material, "emission_color").default_value = (1, 1, 1, 1)
    made.socket(material, "emission_strength").default_value = 1
    return material


def render_both(native, folder, size, samples):
    """(ours, Cycles'): the open scene, seen from above its corner at the origin."""
    sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "scenes"))
    from example_scene import set_comparison

    from selenite.scene_read.build import build

    scene = bpy.context.scene
    camera = made.camera(type="ORTHO", ortho_scale=size[0], sensor_fit="HORIZONTAL")
    camera.location = (size[0] / 2, size[1] / 2, 5)
    scene.render.resolution_x, scene.render.resolution_y = size
    made.world((0, 0, 0))
    set_comparison(scene, samples)
    file = scene.render.image_settings
    file.file_format, file.color_mode, file.color_depth = "OPEN_EXR", "RGB", "32"
    scene.render.filepath = str(folder / "cycles.exr")
    values = made.read()
    if values.problems:  # in short: the cases that depend on it are many
        text = "\n".join(problem.line() for problem in values.problems)
        pytest.fail(text, pytrace=False)
    ours = native.core().render(build(values), "Camera", *size, samples).image
    bpy.ops.render.render(write_still=True)
    return ours, native.image().read(scene.render.filepath)[0]


def render_strips(native, folder, cases):
    """Label of a case -> (ours, Cycles'), (COUNT, 3) each, or why there is none.

    cases: label -> (function, arguments). The function is called with the strip's material, the
    folder and the arguments; it may return what is to be done to the strip's mesh.
    """
    made.open_empty_file()
    random = np.random.default_rng(7)
    results, rows = {}, []
    for label, (function, arguments) in cases.items():
        material = shining(label)
        try:
            change = function(material, folder, *arguments)
        except NotHere as reason:
            results[label] = str(reason)
            continue
        mesh = strip(len(rows), material, random)
        if change is not None:
            change(mesh)
        rows.append(label)
    ours, cycles = render_both(native, folder, (COUNT, len(rows)), 1)
    for index, label in enumerate(rows):
        results[label] = (ours[-1 - index], cycles[-1 - index])
    return results
