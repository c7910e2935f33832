# SPDX-License-Identifier: GPL-3.0-or-later
"""All captured objects from the panel: a fit for each material, and its page."""

import json
import time
import tomllib
from pathlib import Path

import bpy
import drawn_panels
import made_scenes as made
import pytest

from selenite.capture.captures_file import write_captures_file
from selenite.capture.request import with_ids
from selenite.capture.scene_captures import captures_of
from selenite.cli import main
from selenite.interface import panels, state
from selenite.interface.operators import batch
from selenite.interface.running.command import command_job

pytestmark = [pytest.mark.blender, pytest.mark.usefixtures("addon")]

COLOURS = {"Body": (0.6, 0.3, 0.2), "Second": (0.2, 0.3, 0.7)}


def two_balls(tmp_path):
    """Two balls of colours of their own in a photo; in the scene both are grey."""
    made.studio()
    other = made.sphere("Other", made.material("Second"))
    bpy.data.objects["Body"].location.x, other.location.x = -1.1, 1.1
    bpy.context.scene.camera.location.y *= 1.8
    scene = made.save(tmp_path / "scene.blend")
    words = [f"--set={name}:base_color={','.join(map(str, c))}" for name, c in COLOURS.items()]
    photo = tmp_path / "photo.exr"
    assert (
        main(["render", scene, "--out", str(photo), "--height", "32", "--spp", "512", *words]) == 0
    )
    bpy.ops.wm.open_mainfile(filepath=scene)
    settings = bpy.context.scene.selenite
    row = settings.captures.add()
    row.camera, row.photo = bpy.context.scene.camera, bpy.data.images.load(str(photo))
    assert bpy.ops.selenite.refresh_rows() == {"FINISHED"}
    for item in settings.rows:
        item.enabled = item.kind == "material" and item.parameter == "base_color"
    settings.height, settings.iterations, settings.spp = 32, 15, 16
    settings.picture_spp, settings.output = 16, str(tmp_path / "fits")
    return settings


def test_each_material_has_a_fit_of_its_own(tmp_path):
    two_balls(tmp_path)
    assert bpy.ops.selenite.fit_objects() == {"FINISHED"}
    (folder,) = (tmp_path / "fits").glob("*.objects")
    fits = {f["name"]: f for f in tomllib.loads((folder / "objects.toml").read_text())["fit"]}
    assert {name: fit["fit"] for name, fit in fits.items()} == {
        name: f'"{name}":base_color' for name in COLOURS
    }
    rows = {fit["name"]: fit for fit in json.loads((folder / "batch.json").read_text())["fits"]}
    for name, colour in COLOURS.items():
        found = json.loads((folder / rows[name]["folder"] / "result.json").read_text())
        value = found["parameters"][f"{name}:base_color"]["value"]
        assert value == pytest.approx(colour, abs=0.05)
        assert (folder / f"{name}.blend").is_file()
    assert (folder / "index.html").is_file()
    assert "2 of 2 objects are fitted" in state.BATCH.lines[0]
    assert "2 of 2 objects are fitted" in drawn_panels.draw(panels.SELENITE_PT_advanced)
    assert Path(bpy.data.filepath) == tmp_path / "scene.blend"


def test_what_is_missing_is_said_at_once(tmp_path):
    settings = two_balls(tmp_path)
    settings.stage_mode = "own"
    with pytest.raises(RuntimeError, match="an own list names the parameters of one fit"):
        bpy.ops.selenite.fit_objects()
    for row in settings.rows:
        row.enabled = False
    with pytest.raises(RuntimeError, match="no parameter of a material is ticked"):
        bpy.ops.selenite.fit_objects()
    assert not (tmp_path / "fits").exists()


def test_a_batch_that_is_stopped_reports_what_it_has(tmp_path):
    settings = two_balls(tmp_path)
    settings.preset, settings.iterations = "accurate", 5000
    text = batch._toml(bpy.context.scene, list(batch._tables(bpy.context.scene)))
    made.save(tmp_path / "scene.blend")
    captures = with_ids(captures_of(bpy.context.scene), ["Camera"])
    write_captures_file(tmp_path / "captures.json", captures)
    (tmp_path / "objects.toml").write_text(text)
    job = command_job("selenite-test-")
    try:
        job.ask({"words": ["batch", str(tmp_path / "objects.toml"), f"--out={tmp_path / 'out'}"]})
        job.start()
        while "Body" not in job.progress().text:
            assert job.progress().running
            time.sleep(0.1)
        job.ask_to_stop()
        report = job.result()["command"]
    finally:
        job.close()
    assert report["error"] == "interrupted"
    assert {fit["status"] for fit in report["fits"]} == {"waiting"}
    assert (tmp_path / "out" / "index.html").is_file()
