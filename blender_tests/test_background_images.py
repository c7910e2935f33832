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


def _linear(background):
    """As Blender calls it in this version, which an OpenEXR file has."""
    name = bpy.data.images.new("Float", 1, 1, float_buffer=True).colorspace_settings.name
    background.image.colorspace_settings.name = name


def _painted(background):
    background.image.pixels[0] = 0.5


CASES = {
    "flipped": lambda item: setattr(item, "use_flip_y", True),
    "turned": lambda item: setattr(item, "rotation", 0.1),
    "scaled": lambda item: setattr(item, "scale", 0.5),
    "moved": lambda item: setattr(item, "offset", (0, 0.1)),
    "cropped or stretched": _cropped,
    "shown in the colour space Non-Color": _colour_space,
    "shown in the colour space Linear": _linear,
    "one of several": lambda item: setattr(item.image, "source", "SEQUENCE"),
    "changed and not saved": _painted,
}


@pytest.mark.parametrize("how", CASES)
def test_what_the_camera_shows_otherwise_is_named(tmp_path, how):
    background = _scene(tmp_path)
    assert misplaced_backgrounds(bpy.context.scene) == []
    assert len(captures_of(bpy.context.scene)) == 1
    CASES[how](background)
    (problem,) = misplaced_backgrounds(bpy.context.scene)
    assert problem.object == "Camera 'Camera'"
    cause = problem.cause.replace("Linear Rec.709", "Linear")
    assert cause == f"its background image 'photo.png' is {how} in the camera"


def test_an_image_that_the_camera_shows_goes_before_one_that_it_hides(tmp_path):
    hidden = _scene(tmp_path)
    hidden.use_flip_x = True
    hidden.show_background_image = False
    assert misplaced_backgrounds(bpy.context.scene)  # there is no other
    clip = bpy.context.scene.camera.data.background_images.new()
    clip.image, clip.source = hidden.image, "MOVIE_CLIP"
    shown = bpy.context.scene.camera.data.background_images.new()
    shown.image = bpy.data.images.load(str(made.photo(tmp_path / "other.png")))
    assert misplaced_backgrounds(bpy.context.scene) == []
    (capture,) = captures_of(bpy.context.scene)
    assert capture.photo == str(tmp_path / "other.png")


def test_a_photo_of_linear_light_is_shown_in_a_linear_space(tmp_path):
    background = _scene(tmp_path)
    image = bpy.data.images.new("Light", 32, 24, float_buffer=True)
    image.filepath_raw, image.file_format = str(tmp_path / "light.exr"), "OPEN_EXR"
    image.save()
    background.image = bpy.data.images.load(str(tmp_path / "light.exr"))
    assert misplaced_backgrounds(bpy.context.scene) == []
    background.image.colorspace_settings.name = "sRGB"
    (problem,) = misplaced_backgrounds(bpy.context.scene)
    assert "shown in the colour space sRGB" in problem.cause


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
