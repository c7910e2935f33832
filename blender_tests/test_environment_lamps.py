# SPDX-License-Identifier: GPL-3.0-or-later
"""Bright spots of the world's image become Sun lamps."""

import bpy
import made_scenes as made
import numpy as np
import pytest
import undo_steps
from command_line import command

from selenite import native
from selenite.problems import BadInput
from selenite.scene_read.blend_file import open_blend
from selenite.scene_read.build import build
from selenite.write_back import suns

pytestmark = [pytest.mark.blender, pytest.mark.blender34]


def room(rotation=(0.0, 0.0, 0.0)):
    """A white matt ball in a dim room with two lamps far away."""
    made.studio(base_color=(0.8, 0.8, 0.8), roughness=1.0)
    pixels = np.full((32, 64, 3), 0.1, np.float32)
    pixels[6, 30] = (500, 400, 300)
    pixels[12, 50] = (60, 90, 160)
    made.environment(bpy.context.scene.world, pixels, rotation)
    return pixels


def picture(seed=1):
    values = made.read()
    assert not values.problems
    return native.core().render(build(values), "Camera", 32, 24, 256, seed=seed).image


@pytest.mark.parametrize("turn", [0.0, 0.8])
def test_the_scene_looks_as_before(turn):
    room((0.0, 0.0, turn))
    before, again = picture(), picture(seed=2)
    found, rest = suns.proposed(made.read(), 4)
    assert len(found) == 2 and rest.max() < 1
    suns.add(bpy.context.scene, made.read(), found, rest)
    lamps = [item for item in bpy.data.objects if item.type == "LIGHT"]
    assert len(lamps) == 2 and all(item.data.type == "SUN" for item in lamps)
    after = picture()
    ball = before.mean(axis=-1) > 0.12  # the middle of the picture
    np.testing.assert_allclose(after[ball].mean(axis=0), before[ball].mean(axis=0), rtol=0.02)
    # Pixel by pixel no further than two renders of the same.
    noise, error = (np.sqrt(np.mean((item - before)[ball] ** 2)) for item in (again, after))
    assert error < 1.1 * noise


def test_the_strength_counts():
    room()
    background = next(
        n for n in bpy.context.scene.world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground"
    )
    one, _ = suns.proposed(made.read(), 1)
    background.inputs["Strength"].default_value = 3.0
    three, _ = suns.proposed(made.read(), 1)
    assert three[0].irradiance == pytest.approx(tuple(3 * x for x in one[0].irradiance))


def test_what_has_no_spot_is_refused():
    made.studio()
    with pytest.raises(BadInput, match="no image.*fit World:environment"):
        suns.proposed(made.read(), 4)
    made.environment(bpy.context.scene.world, np.full((4, 8, 3), 0.5, np.float32))
    with pytest.raises(BadInput, match="three times as bright.*keep the image"):
        suns.proposed(made.read(), 4)


def test_the_operator_is_one_undo_step(addon):
    room()
    bpy.ops.selenite.refresh_rows()
    undo_steps.prepare()
    assert bpy.ops.selenite.lamps_from_environment("EXEC_DEFAULT", True, count=1) == {"FINISHED"}
    assert [item.name for item in bpy.data.objects if item.type == "LIGHT"] == [suns.NAME]
    assert made.read().world.image.max() < 200
    undo_steps.undo()
    assert not [item for item in bpy.data.objects if item.type == "LIGHT"]
    assert made.read().world.image.max() == pytest.approx(500)


def test_the_command_lists_and_saves(tmp_path, capsys):
    room()
    bpy.data.images["sky"].pack()
    path = made.save(tmp_path / "scene.blend")
    status, report, err = command(capsys, "lamps", path)
    assert status == 0, err
    assert len(report["suns"]) == 2 and report["saved"] is None
    assert err.count("irradiance") == 2
    saved = str(tmp_path / "lit.blend")
    status, report, err = command(capsys, "lamps", path, "--count", "1", "--save", saved)
    assert status == 0, err
    open_blend(saved)
    values = made.read()
    assert not values.problems
    (light,) = values.lights
    assert light.power == pytest.approx(max(report["suns"][0]["irradiance"]), rel=1e-5)
    assert values.world.image.max() < 200
    status, _, err = command(capsys, "lamps", path, "--result", str(tmp_path))
    assert status == 2 and "give the folder of a fit" in err


@pytest.mark.parametrize("versions", [0, 2])
def test_a_file_that_is_replaced_is_kept_whatever_blender_prefers(tmp_path, capsys, versions):
    room()
    bpy.data.images["sky"].pack()
    path = made.save(tmp_path / "room.blend")
    before = (tmp_path / "room.blend").read_bytes()
    preferences = bpy.context.preferences.filepaths
    usual, preferences.save_version = preferences.save_version, versions
    try:
        status, report, err = command(capsys, "lamps", path, "--save", path)
        assert preferences.save_version == versions
    finally:
        preferences.save_version = usual
    assert status == 0 and report["saved"] == path
    assert f"wrote {path}; the file that was there is now {path}1" in err
    assert (tmp_path / "room.blend1").read_bytes() == before
    assert len(list(bpy.data.lights)) == 2
