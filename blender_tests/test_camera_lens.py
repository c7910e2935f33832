# SPDX-License-Identifier: GPL-3.0-or-later
"""The lens of an imported camera belongs to it, whichever photo it gets and whenever."""

import bpy
import numpy as np
import pytest
import reconstructed
from reconstructed import imported

from selenite import native
from selenite.capture.prepared import read_captures
from selenite.capture.request import CaptureRequest
from selenite.capture.scene_captures import captures_of
from selenite.scene_read.camera_lens import keep_lens, lens_of
from selenite.scene_read.lens import CameraLens, LensDistortion
from selenite.scene_read.scene import read_scene

pytestmark = [pytest.mark.blender, pytest.mark.blender34]


@pytest.mark.parametrize("source", ["command", "panel"])
def test_a_photo_that_comes_later_gets_the_lens_of_its_camera(source, tmp_path, capsys, request):
    """Of cameras that were imported without photos; what is read of a photo is the same as with."""
    _, words = reconstructed.written(tmp_path)
    bare = list(words["metashape"])
    at = bare.index("--photos")
    del bare[at : at + 2]
    rng = np.random.default_rng(5)
    picture = rng.uniform(0.1, 0.9, (*reconstructed.pebble.SIZE[::-1], 3)).astype(np.float32)
    photo = tmp_path / "photos" / "IMG_0001.exr"
    native.image().write_exr(str(photo), picture)
    imported(capsys, words["metashape"], tmp_path / "whole.blend")
    imported(capsys, bare, tmp_path / "bare.blend")
    request.getfixturevalue("addon")
    (with_photo, *_), _ = read_of(reconstructed.opened(tmp_path / "whole.blend"))
    scene = reconstructed.opened(tmp_path / "bare.blend")
    assert not captures_of(scene)
    asked = [CaptureRequest("IMG_0001", str(photo))]
    if source == "panel":
        row = scene.selenite.captures.add()
        row.camera = scene.objects["IMG_0001"]
        row.photo = bpy.data.images.load(str(photo))
        asked = captures_of(scene)
    (later,), warnings = read_of(scene, asked)
    assert np.abs(later.reference - with_photo.reference).max() < 1e-5
    assert (later.weight == with_photo.weight).all()
    assert any(text.startswith("Lens of 'IMG_0001', kept by the import") for text in warnings)
    if source == "panel":
        row.how.undistorted = True
        (plain,), _ = read_of(scene, captures_of(scene))
        assert np.abs(plain.reference - with_photo.reference).max() > 0.1


def read_of(scene, asked=None):
    problems, warnings = [], []
    found = read_captures(
        read_scene(scene), asked or captures_of(scene), 64, problems, warnings, {}
    )
    assert not problems
    return found, warnings


def test_what_is_no_lens_is_none():
    """Of a property that a user or another program has changed."""
    data = bpy.data.cameras.new("Lens")
    assert lens_of(data) is None
    found = CameraLens((640, 480), LensDistortion(500.0, 501.0, 320.0, 240.0, k1=-0.1, b2=0.5))
    keep_lens(data, found)
    assert lens_of(data) == found and lens_of(data.copy()) == found
    for key, value in (("fx", 0.0), ("width", -1), ("k1", float("nan")), ("cy", "middle")):
        keep_lens(data, found)
        data["selenite_lens"][key] = value
        assert lens_of(data) is None
    data["selenite_lens"] = 3.0
    assert lens_of(data) is None
