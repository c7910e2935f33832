# SPDX-License-Identifier: GPL-3.0-or-later
"""Two photos of one camera: by the command line, in the panel, in result files and in Cycles."""

import json
import re

import bpy
import made_scenes as made
import numpy as np
import pytest
from command_line import command
from drawn_panels import FakeLayout

from selenite import native
from selenite.capture.request import CaptureRequest
from selenite.capture.scene_captures import captures_of, ids_of, pair_by_name
from selenite.commands.terminal import Bar
from selenite.fit.cost import phase_paths
from selenite.fit.plan import prepare
from selenite.fit.request import RunRequest, UnknownRequest
from selenite.interface import panels

pytestmark = pytest.mark.blender

IDS = ("Camera", "Camera#2")
PICTURES = ("initial", "optimised", "reference", "error")


@pytest.fixture
def photos(tmp_path):
    """A dark and a bright one, which no value explains both."""
    made.studio(base_color=(0.5, 0.5, 0.5), roughness=0.5)
    levels = zip(("Camera.png", "Camera#2.png"), (0.2, 0.7), strict=True)
    return [made.photo(tmp_path / name, value=level) for name, level in levels]


def written(folder):
    return {item.name for item in folder.iterdir()}


def test_a_fit_by_the_command_line_compares_with_both(photos, tmp_path, capsys):
    scene = made.save(tmp_path / "scene.blend")
    mask = np.ones((24, 32, 3), np.float32)
    mask[:, :16] = 0
    native.image().write_png(str(tmp_path / "mask.png"), mask)
    words = [
        "fit", scene, "--fit=World:strength", "--iterations=2", "--height=24", "--search=off",
        "--picture-spp=4", "--seed=3", f"--out={tmp_path / 'fits'}", "--check-in-cycles",
        *(f"--photo=Camera={path}" for path in photos), f"--mask=Camera#2={tmp_path / 'mask.png'}",
    ]  # fmt: skip
    status, report, printed = command(capsys, *words)
    assert status == 0, printed
    (folder,) = (tmp_path / "fits").iterdir()
    pictures = {
        f"{name}_{kind}.{end}" for name in IDS for kind in PICTURES for end in ("png", "exr")
    }
    assert pictures <= written(folder)
    assert list(report["cycles"]["photos"]) == list(IDS)
    assert {f"{name}_cycles.png" for name in IDS} <= written(folder)
    log = (folder / "log.txt").read_text()
    assert f"Photo Camera: {photos[0]}" in log and f"Photo Camera#2: {photos[1]}" in log
    asked = json.loads((folder / "run.json").read_text())["captures"]
    assert [item["id"] for item in asked] == list(IDS)
    assert [bool(item.get("mask")) for item in asked] == [False, True]
    error = native.image().read(str(folder / "Camera#2_error.exr"))[0]
    assert not error[:, :16].any() and error[:, 16:].any(), "only the second one is masked"
    assert native.image().read(str(folder / "Camera_error.exr"))[0][:, :16].any()
    # the run again, by its file
    again = ["fit", str(folder / "run.json"), f"--out={tmp_path / 'again'}"]
    status, second, printed = command(capsys, *again)
    assert status == 0, printed
    assert second["parameters"] == report["parameters"]


def test_what_a_fit_will_render_is_known(photos):
    captures = tuple(
        CaptureRequest("Camera", str(path), id=name, gain="scalar")
        for name, path in zip(IDS, photos, strict=True)
    )
    request = RunRequest("", (UnknownRequest("Body", "base_color"),), captures)
    paths = phase_paths(request.settings, prepare(made.read(), request))
    assert min(paths[name] for name in ("multi-start", "descent", "refinement")) > 0


@pytest.mark.parametrize("slow", [True, False])
def test_after_ctrl_c_nobody_waits_for_pictures(photos, tmp_path, capsys, monkeypatch, slow):
    scene = made.save(tmp_path / "scene.blend")
    shown = Bar.update

    def interrupt(self, fraction, *more, note=""):
        shown(self, fraction, *more, note=note)
        if self._title == "fitting" and re.match("iteration [1-9]", note):  # iterations are done
            raise KeyboardInterrupt

    monkeypatch.setattr(Bar, "update", interrupt)
    status, report, printed = command(
        capsys, "fit", scene, "--fit=Body:base_color", "--search=off", "--spp=16",
        "--iterations=100000", f"--picture-spp={1 << 20 if slow else 1}",
        f"--out={tmp_path / 'fits'}", *(f"--photo=Camera={path}" for path in photos),
    )  # fmt: skip
    assert status == 0, printed
    assert report["stopped_because"] == "cancelled" and report["iterations"] > 0
    assert ("pictures are left out" in printed) == slow
    (folder,) = (tmp_path / "fits").iterdir()
    assert {"result.json", "history.csv"} <= written(folder)
    assert ("Camera_optimised.png" in written(folder)) != slow


@pytest.mark.usefixtures("addon")
def test_a_fit_in_the_panel_compares_with_both(photos, tmp_path):
    settings = bpy.context.scene.selenite
    files = [{"name": path.name} for path in photos]
    bpy.ops.selenite.load_photos(directory=str(tmp_path), files=files)
    assert [row.camera.name for row in settings.captures] == ["Camera", "Camera"]
    shown = []
    for index, row in enumerate(settings.captures):
        layout = FakeLayout()
        panels.SELENITE_UL_captures.draw_item(
            None, bpy.context, layout, settings, row, 0, settings, "active_capture", index
        )
        shown.append(layout.drawn[1])
    assert shown == list(IDS)
    bpy.ops.selenite.refresh_rows()
    for row in settings.rows:
        row.enabled = (row.owner, row.parameter) == ("World", "strength")
    settings.iterations, settings.height, settings.search = 2, 24, "off"
    settings.picture_spp, settings.output = 4, str(tmp_path / "out")
    assert bpy.ops.selenite.start() == {"FINISHED"}
    assert bpy.ops.selenite.save_result() == {"FINISHED"}
    (folder,) = (tmp_path / "out").iterdir()
    assert {f"{name}_{kind}.png" for name in IDS for kind in PICTURES} <= written(folder)


@pytest.mark.usefixtures("addon")
def test_a_row_that_is_off_has_no_id(photos):
    made.camera("Camera#2")  # so that the second photo is not called so
    settings = bpy.context.scene.selenite
    for path in photos:
        row = settings.captures.add()
        row.camera, row.photo = bpy.data.objects["Camera"], bpy.data.images.load(str(path))
    assert ids_of(bpy.context.scene) == ["Camera", "Camera#3"]
    settings.captures[0].enabled = False
    assert ids_of(bpy.context.scene) == ["", "Camera"]
    assert [item.camera for item in captures_of(bpy.context.scene)] == ["Camera"]


def test_files_pair_with_cameras_by_the_ids_of_their_photos():
    files = ["front.png", "Front#2.png", "Side#x.png", "Side#2.png", "Front#2.exr"]
    pairs, rest = pair_by_name(["Front", "Side#2"], files)
    assert pairs == [
        CaptureRequest("Front", "front.png", id="Front"),
        CaptureRequest("Front", "Front#2.png", id="Front#2"),
        CaptureRequest("Side#2", "Side#2.png", id="Side#2"),
    ]
    assert rest == ["Side#x.png", "Front#2.exr"]
