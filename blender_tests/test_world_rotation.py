# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite rotate-world` finds how a known panorama stood while the photos were taken."""

import math

import bpy
import made_scenes as made
import numpy as np
import pytest
import undo_steps
from command_line import command

from selenite import native
from selenite.environments import sphere
from selenite.scene_read.blend_file import open_blend
from selenite.scene_read.build import build

pytestmark = pytest.mark.blender

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
    """How it was."""
    scene(TURN, STRENGTH)
    film = native.core().render(build(made.read()), "Camera", 48, 36, 512, seed=77)
    path = str(tmp_path / "photo.exr")
    native.image().write_exr(path, film.image)
    return f"Camera={path}"


def test_rotation_and_strength_are_found_and_saved(photo, tmp_path, capsys):
    scene(20.0, 1.0)
    path, saved = made.save(tmp_path / "scene.blend"), tmp_path / "saved.blend"
    status, report, err = command(
        capsys, "rotate-world", path, "--photo", photo, "--height", "36", "--spp", "64",
        "--threads", "1", "--save", str(saved),
    )  # fmt: skip
    assert status == 0, err
    assert report["degrees"] == pytest.approx(TURN - 20, abs=3)
    assert report["strength"] == pytest.approx(STRENGTH, rel=0.03)
    assert report["misfit"] < 0.02 and report["other_degrees"] is None
    open_blend(str(saved))
    values = made.read()
    assert not values.problems
    assert values.world.strength == pytest.approx(report["strength"], rel=1e-5)
    scene(TURN, STRENGTH)
    wanted = made.read().world.to_map
    np.testing.assert_allclose(values.world.to_map, wanted, atol=math.radians(3))


@pytest.mark.usefixtures("addon")
def test_the_button_sets_them_in_one_undo_step(photo):
    from test_interface import draw

    from selenite.interface import environment_panel, state

    scene(20.0, 1.0)
    settings = bpy.context.scene.selenite
    row = settings.captures.add()
    row.camera = bpy.context.scene.camera
    row.photo = bpy.data.images.load(photo.partition("=")[2])
    assert "selenite.rotate_environment" in draw(environment_panel.SELENITE_PT_environment)
    undo_steps.prepare()
    assert bpy.ops.selenite.rotate_environment("EXEC_DEFAULT", True) == {"FINISHED"}
    strength = made.read().world.strength
    assert strength == pytest.approx(STRENGTH, rel=0.03)
    assert any("degrees about Z" in line for line in state.ROTATION.lines)
    undo_steps.undo()
    assert made.read().world.strength == pytest.approx(1.0)
    for node in list(bpy.context.scene.world.node_tree.nodes):
        if node.type == "TEX_ENVIRONMENT":
            bpy.context.scene.world.node_tree.nodes.remove(node)
    with pytest.raises(RuntimeError, match="Environment Texture with a panorama"):
        bpy.ops.selenite.rotate_environment()
    assert state.ROTATION.job is None


def test_what_cannot_be_rotated_is_refused(photo, tmp_path, capsys):
    scene(0.0, 1.0)
    made.world()
    path = made.save(tmp_path / "plain.blend")
    status, _, err = command(capsys, "rotate-world", path, "--photo", photo)
    assert status == 2 and "give it an Environment Texture with a panorama" in err
