# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite fit --fit World:rotation`: how a known panorama stood, with the materials."""

import math

import bpy
import made_scenes as made
import numpy as np
import pytest
import undo_steps
from command_line import command

from selenite import native, write_back
from selenite.environments import sphere
from selenite.problems import BadInput
from selenite.scene_read.blend_file import open_blend
from selenite.scene_read.build import build

pytestmark = pytest.mark.blender

NAME = ("World", "rotation")
TURN, STRENGTH = 100.0, 2.5


def windows():
    """A dim room with two windows of other colours and heights."""
    d = sphere.directions(64, 128)
    pixels = np.full((64, 128, 3), 0.1, np.float32)
    azimuth, elevation = (
        np.degrees(np.arctan2(d[..., 1], d[..., 0])),
        np.degrees(np.arcsin(d[..., 2])),
    )
    pixels[(np.abs(azimuth - 30) < 25) & (np.abs(elevation - 35) < 20)] = (3, 2, 1)
    pixels[(np.abs(azimuth + 70) < 15) & (np.abs(elevation - 10) < 20)] = (0.5, 1, 2)
    return pixels


def scene(turn, strength):
    """A ball under the room, turned about its axis by degrees, the camera at its side."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    made.studio(base_color=(0.7, 0.6, 0.5), roughness=0.4)
    camera = bpy.context.scene.camera
    camera.location, camera.rotation_euler = (0.0, -5.0, 0.0), (math.pi / 2, 0.0, 0.0)
    world = made.world(strength=strength)
    made.environment(world, windows(), (0.0, 0.0, math.radians(turn)))
    bpy.data.images["sky"].pack()


@pytest.fixture
def photo(tmp_path):
    """Of a ball whose colour is not that of the scene that is fitted."""
    scene(TURN, STRENGTH)
    film = native.core().render(build(made.read()), "Camera", 48, 36, 1024, seed=77)
    path = str(tmp_path / "photo.exr")
    native.image().write_exr(path, film.image)
    return f"Camera={path}"


def nodes(kind):
    return [node for node in bpy.context.scene.world.node_tree.nodes if node.type == kind]


def test_a_fit_finds_the_rotation_and_the_saved_scene_has_it(photo, tmp_path, capsys):
    scene(20.0, 1.0)
    path, saved = made.save(tmp_path / "scene.blend"), tmp_path / "saved.blend"
    status, report, err = command(
        capsys, "fit", path, "--photo", photo, "--fit", "World:rotation,strength", "--height",
        "36", "--spp", "16", "--iterations", "24", "--threads", "1", "--picture-spp", "16",
        "--out", str(tmp_path / "out"), "--save", str(saved),
    )  # fmt: skip
    assert status == 0, err
    found = report["parameters"]
    assert found["World:rotation"]["initial"] == pytest.approx(math.radians(20), abs=1e-5)
    assert found["World:rotation"]["value"] == pytest.approx(math.radians(TURN), abs=0.0175)
    assert found["World:rotation"]["determined"] and found["World:rotation"]["unit"] == "rad"
    assert found["World:strength"]["value"] == pytest.approx(STRENGTH, rel=0.03)
    open_blend(str(saved))
    (mapping,) = nodes("MAPPING")
    angle = mapping.inputs["Rotation"].default_value[2]
    assert angle == pytest.approx(found["World:rotation"]["value"], abs=1e-5)


def test_it_is_the_angle_of_the_mapping_before_the_image():
    scene(20.0, 1.0)
    values = made.read()
    assert values.owners["World"].values["rotation"] == pytest.approx((math.radians(20),))
    before = native.core().render(build(values), "Camera", 16, 12, 16, seed=1).image
    (mapping,) = nodes("MAPPING")
    mapping.inputs["Rotation"].default_value = (0.4, 0.3, math.radians(20) + 2 * math.pi)
    tilted = made.read()
    assert tilted.world.rotation == pytest.approx(math.radians(20), abs=1e-5)
    write_back.write(bpy.context.scene, tilted.owners, {NAME: (1.0,)})
    assert tuple(mapping.inputs["Rotation"].default_value) == pytest.approx((0.4, 0.3, 1.0))
    # What the module renders with another rotation is the scene in which it has been written.
    of_module = build(tilted).with_values({NAME: (1.0,)})
    of_scene = build(made.read())
    pictures = [
        native.core().render(item, "Camera", 16, 12, 64, seed=1).image
        for item in (of_module, of_scene)
    ]
    np.testing.assert_allclose(*pictures, rtol=0.02, atol=0.02)
    assert not np.allclose(pictures[0], before, rtol=0.1)


def test_without_a_mapping_one_is_added_in_one_undo_step():
    scene(0.0, 1.0)
    (mapping,) = nodes("MAPPING")
    bpy.context.scene.world.node_tree.nodes.remove(mapping)
    values = made.read()
    assert values.world.rotation == 0
    undo_steps.prepare()
    before = write_back.write(bpy.context.scene, values.owners, {NAME: (0.0,)})
    assert not nodes("MAPPING") and before[NAME] == (0.0,)
    write_back.write(bpy.context.scene, values.owners, {NAME: (0.7,)})
    bpy.ops.ed.undo_push(message="Apply")
    assert len(nodes("MAPPING")) == 1
    assert made.read().world.rotation == pytest.approx(0.7)
    undo_steps.undo()
    assert not nodes("MAPPING") and made.read().world.rotation == 0


def test_a_mapping_that_cannot_be_written_is_left_alone():
    scene(20.0, 1.0)
    (mapping,) = nodes("MAPPING")
    mapping.inputs["Rotation"].keyframe_insert("default_value")
    values = made.read()
    assert values.world.rotation == 0 and "rotation" not in values.owners["World"].fixed
    write_back.write(bpy.context.scene, values.owners, {NAME: (0.7,)})
    assert len(nodes("MAPPING")) == 2
    wanted = math.radians(20) + 0.7
    turned = np.array(
        [
            [math.cos(wanted), -math.sin(wanted), 0],
            [math.sin(wanted), math.cos(wanted), 0],
            [0, 0, 1],
        ]
    )
    np.testing.assert_allclose(made.read().world.to_map, turned, atol=1e-5)


def test_what_cannot_be_rotated_is_locked_and_refused(photo, tmp_path, capsys):
    scene(0.0, 1.0)
    both = made.save(tmp_path / "both.blend")
    made.world()
    plain = made.read()
    assert "the world has no image" in plain.owners["World"].fixed["rotation"]
    with pytest.raises(BadInput, match="the world has no image"):
        write_back.write(bpy.context.scene, plain.owners, {NAME: (0.1,)})
    path = made.save(tmp_path / "plain.blend")
    for file, names, said in (
        (path, "World:rotation", "give it an Environment Texture with a panorama"),
        (both, "World:rotation,environment", "fit one of the two"),
    ):
        status, _, err = command(capsys, "fit", file, "--photo", photo, "--fit", names)
        assert status == 2 and said in err
