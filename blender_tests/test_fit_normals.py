# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits of what turns a normal: derivatives through Normal Map and Bump."""

import sys
from pathlib import Path

import bpy
import made_scenes as made
import numpy as np
import pytest
from command_line import command

from selenite import native

pytestmark = [pytest.mark.blender, pytest.mark.slow]

SIZE = 32


def normals(path):
    """(16, 16, 3) colours of a tangent normal map with smooth hills."""
    x, y = np.meshgrid(np.arange(16) / 16, np.arange(16) / 16)
    across = 0.45 * np.sin(2 * np.pi * (2 * x + y))
    along = 0.45 * np.cos(2 * np.pi * (x - 2 * y))
    up = np.sqrt(1 - across**2 - along**2)
    colours = 0.5 + 0.5 * np.stack([across, along, up], axis=-1).astype(np.float32)
    native.image().write_png(str(path), colours, bit_depth=16)
    return str(path)


def board(tmp_path, make):
    """A board under two lamps, diffuse and glossy, whose normal is what `make` gives."""
    material = bpy.data.materials.new("Body")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    normal = make(tree, normals(tmp_path / "normals.png"))
    diffuse, glossy = (
        tree.nodes.new(f"ShaderNodeBsdf{kind}") for kind in ("Diffuse", "Anisotropic")
    )
    diffuse.inputs["Color"].default_value = (0.6, 0.5, 0.4, 1)
    glossy.inputs["Color"].default_value = (0.8, 0.8, 0.8, 1)
    glossy.inputs["Roughness"].default_value = 0.5
    mix = tree.nodes.new("ShaderNodeMixShader")
    mix.inputs[0].default_value = 0.4
    for node, number in ((diffuse, 1), (glossy, 2)):
        tree.links.new(normal, node.inputs["Normal"])
        tree.links.new(node.outputs[0], mix.inputs[number])
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    mesh = bpy.data.meshes.new("Board")
    mesh.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
    layer = mesh.uv_layers.new(name="UVMap")
    layer.data.foreach_set("uv", [0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0])
    mesh.materials.append(material)
    made.add("Board", mesh)
    made.world((0.2, 0.2, 0.2))
    for turn in ((0.8, 0.2, 0.0), (-0.3, -0.9, 0.5)):
        made.light("Sun", "SUN", energy=1.5, angle=0.1).rotation_euler = turn
    camera = made.camera(distance=4.0)
    camera.data.type, camera.data.ortho_scale = "ORTHO", 1.8
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    return tree


def normal_map(tree, path):
    image = tree.nodes.new("ShaderNodeTexImage")
    image.image = bpy.data.images.load(path)
    image.image.colorspace_settings.name = "Non-Color"
    node = tree.nodes.new("ShaderNodeNormalMap")
    node.uv_map = "UVMap"
    tree.links.new(image.outputs["Color"], node.inputs["Color"])
    return node.outputs[0]


def bump(tree, _):
    wave = tree.nodes.new("ShaderNodeTexNoise")
    wave.inputs["Scale"].default_value = 2.0
    wave.inputs["Detail"].default_value = 0.0
    node = tree.nodes.new("ShaderNodeBump")
    node.inputs["Distance"].default_value = 0.3
    tree.links.new(wave.outputs[0], node.inputs["Height"])
    return node.outputs[0]


def photo_by_cycles(path):
    sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "scenes"))
    from example_scene import set_comparison

    scene = bpy.context.scene
    set_comparison(scene, 256)
    file = scene.render.image_settings
    file.file_format, file.color_mode, file.color_depth = "OPEN_EXR", "RGB", "32"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return str(path)


@pytest.mark.parametrize(
    ("make", "node", "truth", "start"),
    [(normal_map, "Normal Map", 0.8, 0.3), (bump, "Bump", 0.7, 0.25)],
    ids=["normal map", "bump"],
)
def test_strength_is_found_in_a_photo_by_cycles(
    empty_scene, tmp_path, capsys, make, node, truth, start
):
    """Within 2 %, and within the interval of 90 % that the fit reports."""
    # Nothing of Blender is held, as the command opens another file.
    board(tmp_path, make).nodes[node].inputs["Strength"].default_value = truth
    photo = photo_by_cycles(tmp_path / "photo.exr")
    tree = bpy.data.materials["Body"].node_tree
    tree.nodes[node].inputs["Strength"].default_value = start
    del tree
    scene = made.save(tmp_path / "scene.blend")
    name = f"Body:{node}.Strength"
    status, report, _ = command(
        capsys, "fit", scene, "--fit", name, "--photo", f"Camera={photo}", "--height", str(SIZE),
        "--threads", "1", "--out", str(tmp_path / "out"), "--spp", "64", "--iterations", "40",
    )  # fmt: skip
    assert status == 0, report
    row = report["parameters"][name]
    assert row["value"] == pytest.approx(truth, rel=0.02), row
    low, high = row["interval_90"]
    assert low <= truth <= high, row
    assert high - low < 0.1, row
