# SPDX-License-Identifier: GPL-3.0-or-later
"""What the reader says of a photo and its mask reaches `check`, `fit`, log.txt and result.json."""

import json
from pathlib import Path

import bpy
import made_scenes as made
import numpy as np
import pytest
from command_line import command

from selenite import native

pytestmark = pytest.mark.blender


@pytest.fixture
def photo(tmp_path):
    """32 x 24: five pixels are NaN, three below 0."""
    pixels = np.full((24, 32, 3), 0.4, np.float32)
    pixels += np.linspace(0, 0.1, 32, dtype=np.float32)[None, :, None]
    pixels[0, :5] = np.nan
    pixels[1, :3, 1] = -0.1
    native.image().write_exr(str(tmp_path / "photo.exr"), pixels)
    return str(tmp_path / "photo.exr")


def expected(path):
    return [
        f"Photo '{path}': 5 of its pixels are not finite (NaN or infinite) and left out",
        f"Photo '{path}': 3 of its pixels are below 0 and left out",
    ]


def scene_with(photo, path):
    made.studio(base_color=(0.8, 0.4, 0.2), roughness=0.5)
    camera = bpy.data.objects["Camera"].data
    camera.background_images.new().image = bpy.data.images.load(photo)
    return made.save(path)


def test_check_reads_the_photos_of_the_scene(photo, tmp_path, capsys):
    status, report, _ = command(capsys, "check", scene_with(photo, tmp_path / "scene.blend"))
    assert status == 0
    assert [text for text in report["warnings"] if text.startswith("Photo")] == expected(photo)
    assert report["captures"][0]["warnings"] == expected(photo)


def test_check_says_that_a_photo_cannot_be_used(photo, tmp_path, capsys):
    scene = scene_with(photo, tmp_path / "scene.blend")
    native.image().write_exr(photo, np.full((24, 32, 3), np.nan, np.float32))
    status, report, _ = command(capsys, "check", scene)
    assert status == 2
    (problem,) = report["problems"]
    assert problem["object"] == f"Photo '{photo}'"
    assert problem["cause"] == "no pixel of it can be used (100% not finite)"


def test_a_fit_writes_them_down(photo, tmp_path, capsys):
    made.studio(base_color=(0.8, 0.4, 0.2), roughness=0.5)
    scene = made.save(tmp_path / "scene.blend")
    words = ["fit", scene, "--fit=Body:base_color", f"--photo=Camera={photo}", "--iterations=1"]
    words += ["--search=off", "--height=12", f"--out={tmp_path / 'fits'}"]
    status, report, printed = command(capsys, *words)
    assert status == 0
    assert [text for text in report["warnings"] if text.startswith("Photo")] == expected(photo)
    folder = Path(report["folder"])
    stored = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    log = (folder / "log.txt").read_text(encoding="utf-8")
    for text in expected(photo):
        assert text in stored["warnings"]
        assert f"Warning: {text}" in log
        assert f"warning: {text}" in printed
