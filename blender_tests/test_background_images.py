# SPDX-License-Identifier: GPL-3.0-or-later
"""Background images as photos: one that its camera shows otherwise than as the file is, is refused;
so is a file that computes in another colour space."""

import bpy
import made_scenes as made
import numpy as np
import pytest
from command_line import command

from selenite.capture.scene_captures import captures_of, misplaced_backgrounds
from selenite.scene_read import working_space

pytestmark = pytest.mark.blender


def _scene(tmp_path):
    made.studio()
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 32, 24
    data = scene.camera.data
    data.show_background_images = True
    background = data.background_images.new()
    background.image = bpy.data.images.load(str(made.photo(tmp_path / "photo.png")))
    return background


def _colour_space(background):
    background.image.colorspace_settings.name = "Non-Color"


def _cropped(background):
    bpy.context.scene.render.resolution_y = 32
    background.frame_method = "CROP"


CASES = {
    "flipped": lambda item: setattr(item, "use_flip_y", True),
    "turned": lambda item: setattr(item, "rotation", 0.1),
    "scaled": lambda item: setattr(item, "scale", 0.5),
    "moved": lambda item: setattr(item, "offset", (0, 0.1)),
    "cropped or stretched": _cropped,
    "shown in the colour space Non-Color": _colour_space,
}


@pytest.mark.parametrize("how", CASES)
def test_what_the_camera_shows_otherwise_is_named(tmp_path, how):
    background = _scene(tmp_path)
    assert misplaced_backgrounds(bpy.context.scene) == []
    assert len(captures_of(bpy.context.scene)) == 1
    CASES[how](background)
    (problem,) = misplaced_backgrounds(bpy.context.scene)
    assert problem.object == "Camera 'Camera'"
    assert problem.cause == f"its background image 'photo.png' is {how} in the camera"


def test_a_fit_refuses_it_unless_the_photo_is_named(tmp_path, capsys):
    _scene(tmp_path).use_flip_x = True
    path = made.save(tmp_path / "scene.blend")
    status, report, _ = command(capsys, "check", path)
    assert status == 2
    assert [item["object"] for item in report["problems"]] == ["Camera 'Camera'"]
    photo = f"Camera={tmp_path / 'photo.png'}"
    assert command(capsys, "check", path, "--photo", photo)[0] == 0


def test_another_working_space_is_refused(monkeypatch):
    made.studio()
    assert not made.read().problems
    acescg = np.array([(0.613, 0.07, 0.021), (0.34, 0.917, 0.107), (0.047, 0.013, 0.872)])
    monkeypatch.setattr(working_space, "_from_rec709", lambda: acescg)
    (problem,) = made.read().problems
    assert problem.cause == "its colours are computed in another space than linear Rec. 709"
