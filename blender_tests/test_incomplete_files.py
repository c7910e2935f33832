# SPDX-License-Identifier: GPL-3.0-or-later
"""Files as authors publish them: output to a video, photos, images and cameras that are gone."""

import ctypes

import bpy
import made_scenes as made
import pytest
from command_line import command

from selenite.cli import main

pytestmark = pytest.mark.blender
#: The format's number in files of Blender 2.7, the first byte of ImageFormatData.
RAW_AVI = 15


def saved(folder):
    path = folder / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return str(path)


def gone(name="Gone", folder="//"):
    """An image whose file is not there."""
    image = bpy.data.images.new(name, 4, 4)
    image.source = "FILE"
    image.filepath = f"{folder}{name}.png"
    return image


@pytest.mark.parametrize("simulated", [False, True], ids=["copied", "rendered itself"])
def test_an_output_to_a_video_is_read_and_left_as_it_is(tmp_path, capsys, simulated) -> None:
    made.studio()
    output = bpy.context.scene.render.image_settings
    output.file_format, output.color_mode = "FFMPEG", "BW"
    if simulated:  # such a scene is not copied
        bpy.ops.rigidbody.world_add()
    scene = saved(tmp_path)
    assert command(capsys, "check", scene)[0] == 0
    output = bpy.context.scene.render.image_settings
    assert (output.file_format, output.color_mode) == ("FFMPEG", "BW")
    out = tmp_path / "out.exr"
    assert main(["render", scene, "--spp", "1", "--out", str(out)]) == 0
    assert out.is_file()


@pytest.mark.parametrize("simulated", [False, True], ids=["copied", "rendered itself"])
def test_a_format_that_blender_no_longer_has_is_no_matter(tmp_path, capsys, simulated) -> None:
    """Files of Blender 2.7 have Raw AVI, for example, which reads as no format at all."""
    made.studio()
    output = bpy.context.scene.render.image_settings
    ctypes.c_byte.from_address(output.as_pointer()).value = RAW_AVI
    assert output.file_format == ""
    if simulated:  # such a scene is not copied
        bpy.ops.rigidbody.world_add()
    scene = saved(tmp_path)
    assert command(capsys, "check", scene)[0] == 0
    assert main(["render", scene, "--spp", "1", "--out", str(tmp_path / "out.exr")]) == 0


def test_a_photo_of_the_scene_that_is_gone_stops_a_fit_alone(tmp_path, capsys) -> None:
    made.studio()
    background = bpy.context.scene.camera.data.background_images.new()
    background.image = gone("Reference")
    scene = saved(tmp_path)
    status, report, said = command(capsys, "check", scene)
    assert (status, report["problems"]) == (0, [])
    assert [item["cause"] for item in report["photo_problems"]] == ["the file does not exist"]
    assert "Reference.png': the file does not exist" in said
    assert report["captures"][0]["camera"] == "Camera"
    assert main(["render", scene, "--spp", "1", "--out", str(tmp_path / "out.exr")]) == 0
    assert main(["fit", scene, "--out", str(tmp_path / "fits")]) == 2
    # A photo that was asked for is another matter.
    status, report, _ = command(capsys, "check", scene, "--photo", "Camera=/nowhere.png")
    assert (status, report["photo_problems"]) == (2, [])


def test_what_else_is_wrong_is_reported_beside_a_camera_that_is_missing(tmp_path, capsys) -> None:
    made.sphere(material=made.material())
    mesh = bpy.data.meshes.new("Line")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [], [(0, 1, 2)])
    made.add("Line", mesh)
    bpy.context.scene.camera = None
    status, report, _ = command(capsys, "check", saved(tmp_path))
    assert status == 2
    assert [(item["object"], item["cause"]) for item in report["problems"]] == [
        ("Scene 'Scene'", "it has no camera"),
        ("Mesh 'Line'", "none of its 1 triangles has an area"),
    ]


def test_images_that_are_gone_are_named_at_once_with_their_materials(tmp_path, capsys) -> None:
    made.studio()
    for name in ("Left", "Right"):
        item = made.sphere(name, made.material(name))
        item.location.x = 3 + 3 * (name == "Right")
        texture = item.active_material.node_tree.nodes.new("ShaderNodeTexImage")
        texture.image = gone(name)
        made.link(item.active_material, texture.outputs["Color"])
    # Below a node that is refused, in a group; what is linked to nothing does not count.
    mixed = made.material("Mixed")
    made.sphere("Third", mixed).location.x = -3
    tree = mixed.node_tree
    group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    inside = group.nodes.new("ShaderNodeTexImage")
    inside.image = gone("Inside")
    diffuse = group.nodes.new("ShaderNodeBsdfDiffuse")
    group.links.new(inside.outputs[0], diffuse.inputs[0])
    group.nodes.new("ShaderNodeTexImage").image = gone("Unused")
    tree.nodes.new("ShaderNodeGroup").node_tree = group
    mix = tree.nodes.new("ShaderNodeMixShader")
    tree.links.new(made.principled(mixed).outputs[0], mix.inputs[1])
    tree.links.new(tree.nodes.new("ShaderNodeBsdfToon").outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    status, report, _ = command(capsys, "check", saved(tmp_path))
    assert status == 2
    causes = {item["object"]: item["cause"] for item in report["problems"]}
    assert set(causes) == {"Image 'Left'", "Image 'Right'", "Image 'Inside'", "Material 'Mixed'"}
    for name, place in (
        ("Left", "for input 'Base Color' of Material 'Left'"),
        ("Right", "for input 'Base Color' of Material 'Right'"),
        ("Inside", "for Material 'Mixed'"),
    ):
        cause = causes[f"Image '{name}'"]
        assert f"{name}.png' cannot be read, so that Cycles shows magenta ({place})" in cause
