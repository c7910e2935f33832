# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite batch`: fits in processes of their own, one that fails, one that is killed."""

import json
import os
import time
from pathlib import Path

import made_scenes as made
import pytest
from command_line import command

from selenite.cli import main
from selenite.commands.batch.entries import read_entries
from selenite.commands.batch.run import Batch, host
from selenite.fit.checkpoint import SUFFIX

pytestmark = pytest.mark.blender

COLOUR = (0.2, 0.6, 0.4)


@pytest.fixture
def home(tmp_path):
    """A folder with a scene and the photo of its true colour."""
    made.studio(base_color=(0.8, 0.4, 0.2), roughness=0.5)
    made.light("Key Light", energy=40)
    scene = made.save(tmp_path / "ball.blend")
    colour = f"Body:base_color={','.join(map(str, COLOUR))}"
    photo = str(tmp_path / "photo.exr")
    assert main(["render", scene, "--out", photo, "--spp", "256", "--set", colour]) == 0
    return tmp_path


def written(home, *fits, spp=16, iterations=6):
    text = f"""
    [defaults]
    scene = "ball.blend"
    photo = {{ Camera = "photo.exr" }}
    fit = "Body:base_color"
    height = 16
    iterations = {iterations}
    spp = {spp}
    picture_spp = 4
    threads = 1
    """
    path = home / "fits.toml"
    path.write_text(text + "".join(f"\n[[fit]]\n{fit}\n" for fit in fits), encoding="utf-8")
    return path


def test_one_table_of_what_is_done_and_what_is_not(home, capsys):
    broken = home / "broken.exr"
    broken.write_bytes((home / "photo.exr").read_bytes()[:400])
    file = written(
        home, 'name = "one"', 'name = "missing"\nscene = "nowhere.blend"',
        'name = "broken"\nphoto = { Camera = "broken.exr" }', 'name = "two"\nseed = 1',
    )  # fmt: skip
    status, report, err = command(capsys, "batch", str(file), "--jobs", "2")
    assert status == 1
    rows = {row["name"]: row for row in report["fits"]}
    assert [rows[name]["status"] for name in ("one", "missing", "broken", "two")] == [
        "done", "refused", "refused", "done",
    ]  # fmt: skip
    assert "nowhere.blend" in rows["missing"]["reasons"][0]
    assert "broken.exr" in rows["broken"]["reasons"][0]
    assert "2 of 4 fits have no result: 'missing', 'broken'" in err
    out = home / "fits-fits"
    for name in ("one", "two"):
        found = json.loads((out / rows[name]["folder"] / "result.json").read_text())
        assert found["parameters"]["Body:base_color"]["value"] == pytest.approx(COLOUR, abs=0.05)
    assert sorted(item.name for item in out.iterdir() if item.is_file()) == [
        "batch.json", "broken.log", "fits.csv", "index.html", "missing.log", "one.log", "two.log",
    ]  # fmt: skip

    # Another call tries again what has no result, and does nothing twice.
    (home / "nowhere.blend").write_bytes((home / "ball.blend").read_bytes())
    status, again, err = command(capsys, "batch", str(file))
    folders = {row["name"]: row["folder"] for row in again["fits"]}
    assert folders["one"] == rows["one"]["folder"] and folders["two"] == rows["two"]["folder"]
    assert folders["missing"] and not folders["broken"] and status == 1
    assert "2 of 4 fits have ended before" in err

    # Other words make another fit.
    file.write_text(file.read_text().replace("seed = 1", "seed = 2"))
    status, changed, _ = command(capsys, "batch", str(file))
    folders_now = {row["name"]: row["folder"] for row in changed["fits"]}
    assert folders_now["two"] != folders["two"] and folders_now["one"] == folders["one"]


def test_a_fit_that_was_killed_goes_on(home, tmp_path):
    """The same values come out, and nothing of the process stays."""
    file = written(home, 'name = "one"', spp=1024, iterations=12)
    out = tmp_path / "out"
    out.mkdir()
    batch = Batch(read_entries(file), home, out, host(), again=False)
    batch.start(None)
    (one,) = batch.running
    until = time.monotonic() + 120
    while not list(out.glob(f"one/*{SUFFIX}/run.json")):
        assert time.monotonic() < until and one.process.poll() is None
        time.sleep(0.02)
    one.process.kill()
    one.process.wait()
    batch.poll(None)
    assert batch.ended["one"].status == "failed"
    ending = "signal 9" if os.name == "posix" else "status 1"
    assert batch.ended["one"].reasons == (f"its process ended with {ending}; see one.log",)

    second = Batch(read_entries(file), home, out, host(), again=False)
    assert not second.kept
    second.start(None)
    while second.running:
        time.sleep(0.1)
        second.poll(None)
    assert second.ended["one"].status == "done", second.ended["one"].reasons
    assert "going on after" in (out / "one.log").read_text()
    assert not list(out.glob(f"one/*{SUFFIX}"))
    found = json.loads((out / second.ended["one"].folder / "result.json").read_text())
    assert found["parameters"]["Body:base_color"]["value"] == pytest.approx(COLOUR, abs=0.02)


def test_what_runs_is_ended_with_the_batch_and_stays_to_go_on(home, tmp_path):
    file = written(home, 'name = "one"', spp=4096, iterations=100)
    out = tmp_path / "out"
    out.mkdir()
    batch = Batch(read_entries(file), home, out, host(), again=False)
    batch.start(None)
    (one,) = batch.running
    until = time.monotonic() + 120
    while not list(out.glob(f"one/*{SUFFIX}/run.json")):
        assert time.monotonic() < until
        time.sleep(0.02)
    batch.close()
    assert one.process.poll() is not None and not Path(one.place.name).exists()
    assert list(out.glob(f"one/*{SUFFIX}/run.json"))
    assert [row.status for row in batch.rows()] == ["waiting"]
