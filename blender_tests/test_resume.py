# SPDX-License-Identifier: GPL-3.0-or-later
"""A run that was killed goes on from what is on disk."""

import csv
import json
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import made_scenes as made
import numpy as np
import pytest
from command_line import command
from pressed_buttons import Pressed

from selenite.capture.request import CaptureRequest
from selenite.cli import main
from selenite.fit import checkpoint
from selenite.fit.job import FitJob
from selenite.fit.plan import prepare
from selenite.fit.request import RunRequest, UnknownRequest
from selenite.fit.settings import FitSettings
from selenite.fit.staging.request import StageRequest
from selenite.interface.running.recorder import BackgroundRecorder
from selenite.interface.running.work import Finishing
from selenite.problems import BadInput
from selenite.report import results

pytestmark = [pytest.mark.blender, pytest.mark.slow]

ROOT = Path(__file__).resolve().parent.parent
#: The command line, which writes its state every tenth of a second in place of every few: a fit of
#: a few seconds can then be killed between two of its iterations.
WRITES_OFTEN = """
import sys
from selenite.cli import main
from selenite.fit import checkpoint
checkpoint._EVERY = checkpoint._STATE_EVERY = 0.1
checkpoint._TIMES = 1.0
sys.exit(main(sys.argv[1:]))
"""
COLOUR = (0.2, 0.6, 0.4)


@pytest.fixture
def words(tmp_path):
    """Arguments of a fit of the colour of a ball."""
    made.studio(base_color=(0.8, 0.4, 0.2), roughness=0.5)
    made.light("Key Light", energy=40)
    path = made.save(tmp_path / "scene.blend")
    photo = str(tmp_path / "photo.exr")
    colour = f"Body:base_color={','.join(map(str, COLOUR))}"
    assert main(["render", path, "--out", photo, "--spp", "256", "--set", colour]) == 0
    return [
        "fit", path, f"--photo=Camera={photo}", "--fit=Body:base_color", "--height=16",
        f"--out={tmp_path / 'fits'}",
    ]  # fmt: skip


def iterations_in(state):
    try:
        return json.loads(state.read_text(encoding="utf-8"))["iterations"]
    except PermissionError:  # on Windows, while a newer one takes its place
        return 0


def killed(words, fits, iterations):
    """Runs a fit in a process of its own, kills it after some iterations; its folder."""
    places = [str(ROOT / "addon"), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(places)}
    with subprocess.Popen(
        [sys.executable, "-c", WRITES_OFTEN, *words, "--threads=1"],
        env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    ) as process:  # fmt: skip
        until = time.monotonic() + 120
        while time.monotonic() < until:
            states = list(fits.glob(f"*{checkpoint.SUFFIX}/state.json"))
            if states and process.poll() is None and iterations_in(states[0]) >= iterations:
                break
            assert process.poll() is None, "it was to be killed while it runs"
            time.sleep(0.02)
        process.kill()
    (folder,) = fits.iterdir()
    assert folder.name.endswith(".unfinished")
    return folder


def report_rows(report):
    with (Path(report["folder"]) / "history.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_a_killed_run_gives_what_it_would_have_given(words, tmp_path, capsys):
    """Killed while it steps or refines, after its last state on disk; the same bits come out."""
    # Long enough that a fast machine is not done before the killer has looked twice.
    words = [*words, "--iterations=12", "--spp=1024", "--seed=3"]
    folder = killed(words, tmp_path / "fits", 5)
    # The one before it may not be removed yet.
    state = folder / json.loads((folder / "state.json").read_text(encoding="utf-8"))["file"]
    assert state.stat().st_size > 1000
    status, report, _ = command(capsys, "fit", "--resume", str(folder), "--threads=1")
    assert status == 0, report
    assert not folder.exists()
    assert Path(report["folder"]).parent == folder.parent
    status, whole, _ = command(capsys, *words)
    assert status == 0
    assert report["parameters"] == whole["parameters"]
    assert report["samples"] == whole["samples"] and "stages" not in report
    histories = [(Path(r["folder"]) / "history.csv").read_bytes() for r in (report, whole)]
    assert histories[0] == histories[1]


def test_without_its_state_a_run_begins_anew(words, tmp_path, capsys):
    words = [*words, "--iterations=12", "--spp=1024", "--seed=3"]
    folder = killed(words, tmp_path / "fits", 5)
    for path in (folder / "state.json", *folder.glob("*.state")):
        path.unlink()
    status, report, _ = command(capsys, "fit", "--resume", str(folder))
    assert status == 0, report
    status, whole, _ = command(capsys, *words)
    assert report["parameters"] == whole["parameters"]
    assert report["samples"] == whole["samples"]


def test_who_stops_a_fit_does_not_wait_for_a_busy_disk(tmp_path, monkeypatch):
    made.studio()
    photo = made.photo(tmp_path / "photo.exr", value=0.3)
    unknowns = (UnknownRequest("Body", "base_color"),)
    captures = (CaptureRequest("Camera", str(photo)),)
    job = FitJob(
        prepare(made.read(), RunRequest("", unknowns, captures, FitSettings(height=12, spp=2)))
    )
    written = threading.Event()
    monkeypatch.setattr(checkpoint.Recorder, "_update", lambda *_: written.wait(60.0))
    recorder = BackgroundRecorder(tmp_path / "run", job.plan.request, None)
    job.start()
    recorder.update(job)
    job.cancel()
    job.join()
    work = Finishing(job, tmp_path, "", recorder)
    list(work.steps())
    assert work.open_record is recorder and recorder.folder.is_dir()
    assert work.result.fit.values_best, "the result is there while the disk works"
    written.set()
    assert recorder.close() == () and not recorder.folder.exists()


def test_a_stage_of_a_grid_goes_on_to_the_same_bits(tmp_path):
    made.smoke()
    photo = made.photo(tmp_path / "photo.exr", value=0.3)
    names = ("Smoke:albedo", "Smoke:albedo_grid")
    request = RunRequest(
        "",
        (UnknownRequest("Smoke", "albedo"), UnknownRequest("Smoke", "albedo_grid", grid="3")),
        (CaptureRequest("Camera", str(photo)),),
        FitSettings(height=12, iterations=20_000, threads=1),
        (StageRequest("one", names[:1], 4), StageRequest("many", names[1:])),
    )
    job = FitJob(prepare(made.read(), request))
    recorder = checkpoint.Recorder(tmp_path / "run", job.plan.request)
    job.start()
    while not in_second_stage(recorder, job):
        time.sleep(0.01)
    run = checkpoint.load(recorder.folder)
    assert run.request.stages == job.plan.request.stages
    again = FitJob(prepare(made.read(), run.request), run.state)
    done = again.progress().iteration
    assert done > 4
    again.start()
    for item in (job, again):
        while item.progress().iteration < done + 4:
            time.sleep(0.01)
        item.cancel()
        item.join()
    first, second = (item.so_far().history for item in (job, again))
    rows = min(len(first.loss), len(second.loss))
    np.testing.assert_array_equal(first.loss[:rows], second.loss[:rows])
    name = "Smoke:albedo_grid"
    both = [item.field_means[name][:rows] for item in (first, second)]
    np.testing.assert_array_equal(*both)
    assert rows > done + 3


def test_a_state_of_another_photo_is_refused(tmp_path):
    plan = plan_of(tmp_path, (3, 100_000), "adam")  # which does not converge
    run = interrupted(plan, tmp_path / "run")
    made.photo(tmp_path / "photo.png", value=0.21)  # of the same name and size
    with pytest.raises(
        BadInput, match=r"of other settings, unknowns or photos.*start the run anew"
    ):
        FitJob(prepare(made.read(), run.request), run.state)


def test_a_damaged_state_is_reported_with_what_to_do(tmp_path):
    plan = plan_of(tmp_path, (3, 100_000), "adam")  # which does not converge
    folder = tmp_path / "run"
    interrupted(plan, folder)
    (path,) = folder.glob("*.state")
    path.write_bytes(path.read_bytes()[:-9])
    run = checkpoint.load(folder)
    with pytest.raises(BadInput, match=r"[.]state': The saved state is damaged.*delete it"):
        FitJob(prepare(made.read(), run.request), run.state)


def in_second_stage(recorder, job):
    """Whether a state of the second stage is on disk."""
    recorder.update(job, now=True)
    state = recorder.folder / "state.json"
    done = iterations_in(state) if state.exists() else 0
    return done > job.plan.stages[0].settings.iterations + 1


def interrupted(plan, folder):
    """The run of a plan of two stages that ended in the second one, with its whole state."""
    job = FitJob(plan)
    recorder = checkpoint.Recorder(folder, plan.request)
    job.start()
    while not in_second_stage(recorder, job):
        time.sleep(0.01)
    job.cancel()
    job.join()
    return checkpoint.load(folder)


def plan_of(tmp_path, iterations=(4, 5), optimiser="auto"):
    made.studio(roughness=0.5)
    photo = made.photo(tmp_path / "photo.png", value=0.2)
    request = RunRequest(
        "",
        (UnknownRequest("Body", "base_color"), UnknownRequest("Body", "roughness")),
        (CaptureRequest("Camera", str(photo)),),
        FitSettings(height=12, optimiser=optimiser),
        (
            StageRequest("colour", ("Body:base_color",), iterations[0]),
            StageRequest("all", ("Body:base_color", "Body:roughness"), iterations[1]),
        ),
    )
    return prepare(made.read(), request)


def finished(plan, state=None):
    job = FitJob(plan, state)
    job.start()
    job.join()
    return job


def test_a_run_stopped_while_its_pictures_were_written_is_not_run_again(tmp_path):
    plan = plan_of(tmp_path)
    whole = finished(plan)
    recorder = checkpoint.Recorder(tmp_path / "run", plan.request)
    recorder.update(whole, now=True)
    run = checkpoint.load(tmp_path / "run")
    job = finished(prepare(made.read(), run.request), run.state)
    assert not job.progress().running
    before, after = whole.result(), job.result()
    for key in ("values_best", "iterations", "samples", "stopped"):
        assert getattr(after, key) == getattr(before, key), key
    assert [item.values for item in after.stages] == [item.values for item in before.stages]
    np.testing.assert_array_equal(after.history.loss, before.history.loss)


def test_a_failed_write_leaves_a_run_that_can_be_resumed(words, tmp_path, capsys, monkeypatch):
    def full(*_arguments):
        raise OSError("no space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(results, "_write_pictures", full)
        assert main([*words, "--iterations=10"]) == 1
    assert "no space left" in capsys.readouterr().err
    (folder,) = (tmp_path / "fits").iterdir()
    status, report, _ = command(capsys, "fit", "--resume", str(folder))
    assert status == 0, report
    assert report["parameters"]["Body:base_color"]["value"] == pytest.approx(COLOUR, abs=0.03)
    assert report["iterations"] == 10
    assert (Path(report["folder"]) / "Camera_optimised.exr").is_file()


def test_what_cannot_be_resumed_is_named(words, tmp_path, capsys):
    status, report, _ = command(capsys, *words, "--iterations=2")
    assert status == 0
    cases = {
        report["folder"]: "this run is finished",
        str(tmp_path / "nowhere"): "it does not exist",
        str(tmp_path): "cannot be read",
        str(tmp_path / "photo.exr"): "it is a file",
    }
    for folder, text in cases.items():
        status, found, _ = command(capsys, "fit", "--resume", folder)
        assert status == 2
        assert text in found["problems"][0]["cause"], folder
    status, found, _ = command(capsys, "fit")
    assert status == 2 and "--resume DIR" in found["problems"][0]["cure"]


def test_other_arguments_do_not_go_with_it_and_a_broken_state_is_told(tmp_path, capsys):
    plan = plan_of(tmp_path)
    path = made.save(tmp_path / "scene.blend")
    recorder = checkpoint.Recorder(tmp_path / "run", plan.request)
    recorder.update(finished(plan), now=True)
    status, report, _ = command(
        capsys, "fit", path, "--resume", str(recorder.folder), "--spp=8", "--fit=Body:ior"
    )
    assert status == 2
    assert [p["object"] for p in report["problems"]] == ["Argument --fit", "Argument --spp"]
    (recorder.folder / "state.json").write_text('{"schema": 2, "file": 1}')
    with pytest.raises(BadInput, match="state cannot be read"):
        checkpoint.load(recorder.folder)


@pytest.mark.usefixtures("addon")
def test_a_run_in_blender_is_kept_and_goes_on(tmp_path, monkeypatch):
    import bpy
    from test_interface import prepare_fit

    from selenite.interface import state
    from selenite.interface.operators.fit import SELENITE_OT_start as Start

    _, settings = prepare_fit(tmp_path, lasting=True)
    settings.output = str(tmp_path / "fits")

    start = Pressed(Start)
    assert start._start(bpy.context)
    until = time.monotonic() + 60
    folder = state.RUN.fitting.recorder.folder
    monkeypatch.setattr(checkpoint, "_EVERY", 0.0)
    while not (folder / "state.json").is_file() and time.monotonic() < until:
        state.RUN.fitting.recorder.update(state.RUN.fitting.job)
        state.RUN.fitting.recorder.wait()
    assert checkpoint.load(folder).state is not None
    for path in (folder / "state.json", *folder.glob("*.state")):  # the run is made shorter below
        path.unlink()
    state.RUN.fitting.recorder = None  # as if Blender had ended here
    bpy.ops.selenite.cancel()
    assert start._finish(bpy.context) == {"CANCELLED"}
    run = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    run["settings"]["iterations"] = 12
    (folder / "run.json").write_text(json.dumps(run), encoding="utf-8")
    assert bpy.ops.selenite.resume(directory=str(folder)) == {"FINISHED"}
    assert state.RUN.done.result.fit.iterations == 12
    assert len(settings.results) == 1
    assert not folder.exists()
    with pytest.raises(RuntimeError, match="does not exist"):
        bpy.ops.selenite.resume(directory=str(folder))
