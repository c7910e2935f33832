# SPDX-License-Identifier: GPL-3.0-or-later
"""Outputs of nodes that are not read, baked into images by Cycles."""

from __future__ import annotations

from pathlib import Path

import bpy
import made_scenes as made
import numpy as np
import pytest
from command_line import command

from selenite import native
from selenite.cycles_check import render as cycles_render
from selenite.cycles_check.approximation import difference
from selenite.scene_read import blender_process
from selenite.scene_read.baking import dependence
from selenite.scene_read.baking import size as sizes
from selenite.scene_read.build import build
from selenite.scene_read.reading import process_run
from selenite.scene_read.reading.job import ReadingJob
from selenite.scene_read.reading.render_depsgraph import Stopped
from selenite.scene_read.scene import read_scene, reading
from selenite.scene_read.values import SceneValues

pytestmark = [pytest.mark.blender, pytest.mark.slow, pytest.mark.usefixtures("addon")]

SIDE = 48


@pytest.fixture
def scene(tmp_path: Path) -> bpy.types.Scene:
    """A saved scene with light and a camera."""
    found = bpy.context.scene
    made.camera(distance=5)
    made.world()
    made.light("Key", "AREA", energy=200)
    found.render.resolution_x = found.render.resolution_y = SIDE
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    found.selenite.bake = True
    return found


def pattern(material: bpy.types.Material, **inputs: float) -> bpy.types.Node:
    """A texture that is not read, in the base colour."""
    # 4.2 has neither of the first two; of Noise only that of 4.3 to 4.5 is read.
    kinds = ("Gabor", "Musgrave", "Noise")
    kind = next(kind for kind in kinds if hasattr(bpy.types, f"ShaderNodeTex{kind}"))
    node = material.node_tree.nodes.new(f"ShaderNodeTex{kind}")
    node.inputs["Scale"].default_value = 3
    for name, value in inputs.items():
        node.inputs[name].default_value = value
    made.link(material, node.outputs[0])
    return node


def check_against_cycles(read: SceneValues, tmp_path: Path) -> None:
    """Within 1 % on average and 5 % in the worst block of the mean of the picture."""
    assert not read.problems, read.problems
    film = native.core().render(build(read), "Camera", SIDE, SIDE, 256)
    size = (SIDE, SIDE)
    cycles = cycles_render.render(
        bpy.context.scene, "Camera", size, 256, 1, tmp_path / "cycles.exr"
    )
    mean, worst = difference(film.image, cycles)
    assert mean < 0.01
    assert worst < 0.05


@pytest.mark.blender34
def test_an_unread_texture_is_baked_as_cycles_shows_it(scene, tmp_path):
    material = made.material("Body", roughness=0.6)
    pattern(material)
    made.sphere("Body", material, 32)
    counts = [len(getattr(bpy.data, name)) for name in ("images", "materials", "scenes", "meshes")]
    read = read_scene(scene)
    assert counts == [
        len(getattr(bpy.data, name)) for name in ("images", "materials", "scenes", "meshes")
    ]
    said = next(text for text in read.warnings if "is baked to" in text)
    assert "output 'Value'" in said or "output 'Height'" in said or "output 'Fac'" in said
    assert "256 x 256 pixels" in said
    error = float(said.partition("off by ")[2].partition(" %")[0])
    assert 0 < error < 2
    check_against_cycles(read, tmp_path)


def test_a_baked_image_is_read_again_until_the_graph_changes(scene, monkeypatch):
    material = made.material("Body")
    node = pattern(material)
    made.sphere("Body", material)
    first = read_scene(scene)
    started = []
    real = blender_process.BlenderProcess.start

    def start(self):
        started.append(self)
        real(self)

    monkeypatch.setattr(blender_process.BlenderProcess, "start", start)
    again = read_scene(scene)
    assert not started
    textures = [item.materials[0].shader.textures[0].pixels for item in (first, again)]
    np.testing.assert_array_equal(*textures)
    made.socket(material, "roughness").default_value = 0.1  # nothing that is baked
    read_scene(scene)
    assert not started
    node.inputs["Scale"].default_value = 5
    changed = read_scene(scene)
    assert len(started) == 1
    assert np.abs(changed.materials[0].shader.textures[0].pixels - textures[0]).max() > 0.1


def test_the_key_of_an_image_changes_with_each_colour_of_a_ramp(scene):
    material = made.material("Body")
    node = pattern(material)
    ramp = material.node_tree.nodes.new("ShaderNodeValToRGB")
    material.node_tree.links.new(ramp.outputs["Color"], node.inputs["Scale"])
    keys = [dependence.fingerprint(node, node.outputs[0], ())]
    for stop in ramp.color_ramp.elements:
        stop.color = (0.9, 0.2, 0.1, 1.0)
        keys.append(dependence.fingerprint(node, node.outputs[0], ()))
    ramp.label, ramp.color = "Odd", (1, 0, 0)  # of the editor
    assert dependence.fingerprint(node, node.outputs[0], ()) == keys[-1]
    assert len(set(keys)) == 3


@pytest.mark.blender34
def test_a_normal_of_nodes_that_are_not_read_is_baked(scene, tmp_path):
    material = made.material("Body", roughness=1.0)
    # Blender 3 does not keep reflections above the surface where a normal is tilted.
    inputs = made.principled(material).inputs
    next(x for x in inputs if x.name in {"Specular", "Specular IOR Level"}).default_value = 0.0
    tree = material.node_tree
    bump = tree.nodes.new("ShaderNodeBump")
    bump.inputs["Distance"].default_value = 0.2
    bump.inputs["Strength"].default_value = 0.6
    node = pattern(material)
    tree.links.remove(made.socket(material, "base_color").links[0])
    tree.links.new(node.outputs[0], bump.inputs["Height"])
    mixed = tree.nodes.new("ShaderNodeVectorMath")
    mixed.operation = "NORMALIZE"
    tree.links.new(bump.outputs["Normal"], mixed.inputs[0])
    # A tangent is not read, so that the sum is baked.
    tangent = tree.nodes.new("ShaderNodeTangent")
    tangent.axis = "Z"
    total = tree.nodes.new("ShaderNodeVectorMath")
    total.operation = "MULTIPLY_ADD"
    tree.links.new(tangent.outputs[0], total.inputs[0])
    total.inputs[1].default_value = (0.1, 0.1, 0.1)
    geometry = tree.nodes.new("ShaderNodeNewGeometry")
    tree.links.new(geometry.outputs["Normal"], total.inputs[2])
    tree.links.new(total.outputs[0], made.principled(material).inputs["Normal"])
    made.sphere("Body", material, 64)
    check_against_cycles(read_scene(scene), tmp_path)


def test_objects_with_one_material_have_tiles_of_one_image(scene, tmp_path):
    material = made.material("Body", roughness=0.6)
    node = pattern(material)
    info = material.node_tree.nodes.new("ShaderNodeObjectInfo")
    coordinates = material.node_tree.nodes.new("ShaderNodeVectorMath")
    coordinates.operation = "ADD"
    texture = material.node_tree.nodes.new("ShaderNodeTexCoord")
    links = material.node_tree.links
    links.new(texture.outputs["Object"], coordinates.inputs[0])
    links.new(info.outputs["Location"], coordinates.inputs[1])
    links.new(coordinates.outputs[0], node.inputs["Vector"])
    body = made.sphere("Body", material, 32)
    body.location.x = -1
    other = body.copy()  # with the same mesh
    other.location = (1, 0.3, 0)
    other.scale = (0.6, 0.6, 0.6)
    scene.collection.objects.link(other)
    smooth = other.modifiers.new("Smooth", "SUBSURF")
    smooth.render_levels = smooth.levels = 1
    read = read_scene(scene)
    assert len({item.mesh for item in read.objects}) == 2
    assert len([item for item in read.materials if item.shader is not None]) == 1
    maps = [dict(read.meshes[item.mesh].uv_maps)[".baked Body"] for item in read.objects]
    assert maps[0].max() <= 0.5 or maps[1].max(axis=0)[0] > 0.5  # one tile is left of the other
    check_against_cycles(read, tmp_path)


@pytest.mark.blender34
def test_an_output_inside_a_group_is_baked(scene, tmp_path):
    group = bpy.data.node_groups.new("Inside", "ShaderNodeTree")
    from selenite.scene_read import hosts

    hosts.add_group_output(group, "Result", "NodeSocketFloat")
    material = made.material("Body", roughness=0.6)
    kind = pattern(material).bl_idname
    inner = group.nodes.new(kind)
    inner.inputs["Scale"].default_value = 2
    end = group.nodes.new("NodeGroupOutput")
    group.links.new(inner.outputs[0], end.inputs[0])
    node = material.node_tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    made.link(material, node.outputs[0])
    made.sphere("Body", material, 32)
    check_against_cycles(read_scene(scene), tmp_path)


def test_a_uv_map_with_overlaps_is_replaced(scene, tmp_path):
    material = made.material("Body", roughness=0.6)
    pattern(material)
    body = made.sphere("Body", material, 32)
    uv = body.data.uv_layers[0].data
    for item in uv:
        item.uv = item.uv[0] * 2 % 1, item.uv[1]
    check_against_cycles(read_scene(scene), tmp_path)


def test_what_depends_on_the_view_stays_refused(scene):
    material = made.material("Body")
    node = pattern(material)
    weight = material.node_tree.nodes.new("ShaderNodeLayerWeight")
    material.node_tree.links.new(weight.outputs["Facing"], node.inputs["Scale"])
    made.sphere("Body", material)
    (problem,) = read_scene(scene).problems
    assert node.name in problem.cause
    assert "--bake" not in problem.cure


def test_the_cure_names_the_option(scene):
    scene.selenite.bake = False
    material = made.material("Body")
    pattern(material)
    made.sphere("Body", material)
    (problem,) = read_scene(scene).problems
    assert problem.cure.endswith("or let Cycles bake it: --bake")


def test_constants_before_a_baked_output_are_no_parameters(scene):
    material = made.material("Body")
    pattern(material)
    made.sphere("Body", material)
    owner = read_scene(scene).owners["Body"]
    assert not [name for name in owner.parameters if name.startswith(("Gabor", "Musgrave"))]
    assert any("Roughness" in name for name in owner.parameters)


@pytest.mark.blender34
def test_a_bake_that_is_cancelled_leaves_nothing(scene, tmp_path, monkeypatch):
    material = made.material("Body")
    pattern(material)
    made.sphere("Body", material)
    real = process_run.ProcessRun.start

    def start(self, *, waits, note=None):  # as in a window
        del waits
        real(self, waits=False, note=note)

    monkeypatch.setattr(process_run.ProcessRun, "start", start)
    job = ReadingJob(reading(scene))
    while not isinstance(job._render, process_run.ProcessRun):
        assert job.step()
    folder = job._render._process.folder
    assert job.step()
    assert folder.is_dir()
    assert job.text()
    job.cancel()
    with pytest.raises(Stopped):
        while job.step():
            pass
    assert not folder.exists()
    assert not list((tmp_path / "selenite-fits").glob("baked/*/report.json"))


def test_the_size_follows_the_photos(scene):
    material = made.material("Body")
    # Whose pixels cost less than those of a texture.
    node = material.node_tree.nodes.new("ShaderNodeWireframe")
    made.link(material, node.outputs[0])
    made.sphere("Body", material)
    scene.selenite.bake = True
    assert "256 x 256" in "".join(read_scene(scene).warnings)
    scene.render.resolution_x = scene.render.resolution_y = 300
    # The sphere takes about half of the frame: 2 x 170 pixels.
    assert "512 x 512" in "".join(read_scene(scene).warnings)
    assert sizes.longest_photo(scene) == 0


def test_the_command_line_bakes(scene, tmp_path, capsys):
    material = made.material("Body")
    pattern(material)
    made.sphere("Body", material)
    scene.selenite.bake = False
    bpy.ops.wm.save_mainfile()
    path = str(tmp_path / "scene.blend")
    status, found, _ = command(capsys, "check", path)
    assert status == 2
    assert "--bake" in found["problems"][0]["cure"]
    status, found, said = command(capsys, "check", path, "--bake")
    assert status == 0, found
    assert any("is baked to" in text for text in found["warnings"])
    assert "baking 1 of" in said
    out = tmp_path / "picture.png"
    words = ("--out", str(out), "--bake", "--width", "16", "--spp", "1")
    status, found, said = command(capsys, "render", path, *words)
    assert status == 0, found
    assert "baking 1 of" not in said  # the images are kept
