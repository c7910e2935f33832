# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials that cannot be read, rendered as the nearest shader."""

from __future__ import annotations

import bpy
import made_scenes as made
import numpy as np
import pytest
from command_line import command

from selenite import native
from selenite.cycles_check.approximation import BLOCK, difference
from selenite.scene_read.build import build
from selenite.scene_read.scene import read_scene

pytestmark = [pytest.mark.blender, pytest.mark.usefixtures("addon")]


@pytest.fixture
def scene(tmp_path):
    """A saved scene with light and a camera."""
    found = bpy.context.scene
    made.camera(distance=5)
    made.world((0.1, 0.1, 0.1))
    made.light("Key", "SUN", energy=3)
    found.render.resolution_x = found.render.resolution_y = 32
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    found.selenite.approximate = True
    return found


def surface(kind):
    """A material whose surface is one shader, and that node."""
    material = made.material("Body")
    tree = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    node = tree.nodes.new(kind)
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material, node


def test_a_toon_shader_is_diffuse_of_its_colour(scene):
    material, node = surface("ShaderNodeBsdfToon")
    node.inputs["Color"].default_value = (0.6, 0.2, 0.1, 1)
    made.sphere("Body", material)
    read = read_scene(scene)
    assert not read.problems, read.problems
    (named,) = [text for text in read.warnings if "Toon" in text]
    assert "rendered as diffuse" in named
    assert "cannot be fitted" in named
    assert "approximated" in read.owners["Body"].fixed["Toon BSDF.Color"]
    (compared,) = [text for text in read.warnings if "on average" in text]
    assert compared.startswith("Scene 'Scene': approximated materials change the picture")
    mean = float(compared.partition(" by ")[2].partition(" %")[0])
    worst = float(compared.partition("average and ")[2].partition(" %")[0])
    assert 0.5 < mean < worst
    picture = native.core().render(build(read), "Camera", 32, 32, 64).image
    tint = picture[12:20, 12:20].mean(axis=(0, 1))
    assert tint[0] > 2 * tint[2]


def test_a_shader_is_rendered_without_what_is_not_modelled(scene):
    material, node = surface("ShaderNodeSubsurfaceScattering")
    node.falloff = "BURLEY"
    made.sphere("Body", material)
    read = read_scene(scene)
    assert not read.problems
    assert any("Christensen-Burley: it is rendered without that" in text for text in read.warnings)


def test_a_missing_image_is_magenta(scene):
    material = made.material("Body", roughness=1.0)
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.new("Wood", 4, 4)
    node.image.source = "FILE"
    node.image.filepath = "//missing.png"
    made.link(material, node.outputs["Color"])
    made.sphere("Body", material)
    read = read_scene(scene)
    assert not read.problems
    assert any("is magenta, as in Cycles" in text for text in read.warnings)
    (compared,) = [text for text in read.warnings if "on average" in text]
    # It is what Cycles shows, but for noise.
    assert float(compared.partition(" by ")[2].partition(" %")[0]) < 2


def test_what_nothing_stands_for_has_the_colour_of_the_viewport(scene):
    material = made.material("Body")
    made.link(material, material.node_tree.nodes.new("ShaderNodeLightFalloff").outputs[0])
    material.diffuse_color = (0.1, 0.2, 0.3, 1)
    made.sphere("Body", material)
    read = read_scene(scene)
    assert not read.problems
    np.testing.assert_allclose(read.materials[0].values["base_color"], (0.1, 0.2, 0.3), rtol=1e-6)
    assert all("approximated" in text for text in read.owners["Body"].fixed.values())


def test_the_default_stays_refusal_and_the_cure_names_the_option(scene, tmp_path, capsys):
    scene.selenite.approximate = False
    material, _ = surface("ShaderNodeBsdfToon")
    made.sphere("Body", material)
    (problem,) = read_scene(scene).problems
    assert problem.cure.endswith("--approximate")
    bpy.ops.wm.save_mainfile()
    path = str(tmp_path / "scene.blend")
    status, found, _ = command(capsys, "check", path, "--approximate")
    assert status == 0, found
    # The difference is kept: the file is the same.
    status, again, said = command(capsys, "check", path, "--approximate")
    assert "comparing" not in said
    assert again["warnings"] == found["warnings"]


def test_the_difference_is_relative_to_the_mean_of_the_picture():
    cycles = np.ones((2 * BLOCK, 2 * BLOCK, 3))
    ours = cycles.copy()
    ours[:BLOCK, :BLOCK] = 1.2
    mean, worst = difference(ours, cycles)
    assert mean == pytest.approx(0.05)
    assert worst == pytest.approx(0.2)


def _floor_twice():
    for name in ("Floor", "Twin"):
        bpy.ops.mesh.primitive_plane_add(size=4)
        bpy.context.object.name = name
    return "it is there twice at one place"


def _open_medium():
    material = made.material("Body", transmission=1.0)
    tree = material.node_tree
    volume = tree.nodes.new("ShaderNodeVolumeAbsorption")
    tree.links.new(volume.outputs[0], tree.get_output_node("CYCLES").inputs["Volume"])
    bpy.ops.mesh.primitive_plane_add(size=2)
    bpy.context.object.data.materials.append(material)
    return "has no definite inside"


def _lamp_through_an_image():
    lamp = bpy.data.lights["Key"]
    lamp.use_nodes = True
    tree = lamp.node_tree
    image = tree.nodes.new("ShaderNodeTexImage")
    tree.links.new(image.outputs[0], tree.nodes["Emission"].inputs["Color"])
    return "the Color of its Emission node is linked"


def _sheared_spot():
    lamp = made.light("Spot", "SPOT", energy=3)
    parent = made.add("Parent", None)
    parent.scale = (1, 2, 0.5)
    lamp.parent, lamp.rotation_euler = parent, (0.5, 0.4, 0.2)
    return "its parent shears it"


@pytest.mark.parametrize(
    "make", [_floor_twice, _open_medium, _lamp_through_an_image, _sheared_spot]
)
def test_what_cycles_shows_otherwise_is_rendered_if_asked_for(scene, make):
    made.sphere("Body")
    words = make()
    read = read_scene(scene)
    assert not read.problems, read.problems
    (text,) = [text for text in read.warnings if words in text]
    assert text.endswith("it is rendered nevertheless")
    picture = native.core().render(build(read), "Camera", 16, 16, 4).image
    assert np.isfinite(picture).all() and picture.mean() > 0
    scene.selenite.approximate = False
    assert [words in item.cause for item in read_scene(scene).problems] == [True]
