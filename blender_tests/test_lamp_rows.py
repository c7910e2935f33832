# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps are fitted from the panel, whose own rows point at them, and by the command line."""

import json

import bpy
import made_scenes as made
import numpy as np
import pytest

from selenite import native
from selenite.cli import main
from selenite.scene_read.build import build

pytestmark = [pytest.mark.blender, pytest.mark.blender34]

POWER = 40.0


def lit_ball(tmp_path):
    """A ball between two places of one lamp, and what its camera sees at POWER, as a photo."""
    made.studio(base_color=(0.6, 0.5, 0.4), roughness=0.6)
    bpy.context.scene.world = None
    lamp = made.light(energy=POWER)
    lamp.location = (2.0, 1.0, 3.0)
    made.add("Other", lamp.data).location = (-3.0, 0.0, 2.0)
    camera = bpy.context.scene.camera
    scene = build(made.read())
    picture = native.core().render(scene, camera.name, 32, 24, 512).image
    path = tmp_path / f"{camera.name}.exr"
    native.image().write_exr(str(path), np.ascontiguousarray(picture))
    lamp.data.energy = 4.0
    return lamp, path


def row_of(parameter):
    """The row of the lamp."""
    rows = bpy.context.scene.selenite.rows
    return next(item for item in rows if (item.owner, item.parameter) == ("Key", parameter))


@pytest.mark.usefixtures("addon")
def test_rows_fake_users_and_a_second_scene_do_not_make_a_lamp_unfit():
    made.studio()
    lamp = made.light().data
    for _ in range(2):
        bpy.ops.selenite.refresh_rows()
        assert row_of("power").light == lamp and lamp.users > 1
        assert row_of("power").reason == row_of("color").reason == ""
    lamp.use_fake_user = True
    bpy.data.scenes.new("Other").collection.objects.link(bpy.data.objects["Key"])
    bpy.ops.selenite.refresh_rows()
    assert row_of("power").reason == ""


@pytest.mark.usefixtures("addon")
def test_rows_do_not_make_materials_and_the_world_unfit():
    made.studio()
    bpy.ops.selenite.refresh_rows()
    before = {(row.owner, row.parameter): row.reason for row in bpy.context.scene.selenite.rows}
    bpy.ops.selenite.refresh_rows()
    after = {(row.owner, row.parameter): row.reason for row in bpy.context.scene.selenite.rows}
    assert after == before
    for name in (("Body", "base_color"), ("Body", "base_color_texture"), ("World", "strength")):
        assert after[name] == ""


@pytest.mark.usefixtures("addon")
def test_the_panel_fits_a_lamp_at_two_places_and_writes_it_once(tmp_path):
    lamp, path = lit_ball(tmp_path)
    settings = bpy.context.scene.selenite
    bpy.ops.selenite.refresh_rows()
    bpy.ops.selenite.refresh_rows()
    bpy.ops.selenite.add_capture()
    settings.captures[0].photo = bpy.data.images.load(str(path))
    row_of("power").enabled = True
    settings.height, settings.iterations, settings.picture_spp = 24, 20, 4
    assert bpy.ops.selenite.start() == {"FINISHED"}
    (result,) = settings.results
    assert (result.owner, result.parameter) == ("Key", "power")
    assert result.value[0] == pytest.approx(POWER, rel=0.02)
    assert lamp.data.energy == 4.0
    assert bpy.ops.selenite.apply() == {"FINISHED"}
    assert lamp.data.energy == pytest.approx(result.value[0])
    assert bpy.data.objects["Other"].data == lamp.data
    assert bpy.ops.selenite.restore() == {"FINISHED"}
    assert lamp.data.energy == 4.0


def test_the_command_line_fits_a_lamp_and_a_camera_with_odd_names(tmp_path, capsys):
    """Names with =, :, a comma, quotes and a line break, in every argument that takes one."""
    lamp, path = lit_ball(tmp_path)
    lamp.data.name = odd_lamp = 'A=1, "B": key\n2'
    bpy.context.scene.camera.name = odd_camera = 'Cam=1:"x",\ny'
    scene, fitted = made.save(tmp_path / "odd.blend"), tmp_path / "fitted.blend"
    owner, camera = json.dumps(odd_lamp), json.dumps(odd_camera)
    status = main(
        [
            "fit",
            scene,
            *("--fit", f"{owner}:power"),
            *("--photo", f"{camera}={path}"),
            *("--start", f"{owner}:power=5"),
            *("--bounds", f"{owner}:power=1,100"),
            *("--preset", "draft", "--height", "24", "--picture-spp", "4"),
            *("--out", str(tmp_path / "out"), "--save", str(fitted), "--json"),
        ]
    )
    output = capsys.readouterr()
    assert status == 0, output.err
    report = json.loads(output.out.splitlines()[-1])  # after what Blender prints
    row = report["parameters"][f"{odd_lamp}:power"]
    assert row["value"] == pytest.approx(POWER, rel=0.02)
    assert (row["initial"], row["minimum"], row["maximum"]) == (5.0, 1.0, 100.0)
    bpy.ops.wm.open_mainfile(filepath=str(fitted))
    assert bpy.data.lights[odd_lamp].energy == pytest.approx(row["value"], rel=1e-6)
    picture = tmp_path / "picture.exr"
    shot = ["render", scene, "--camera", camera, "--out", str(picture), "--spp", "1"]
    assert main([*shot, "--set", f"{owner}:power=0"]) == 0
    assert native.image().read(str(picture))[0].max() == 0
    assert main(["render", scene, "--camera", odd_camera, "--out", str(picture), "--spp", "1"]) == 0
