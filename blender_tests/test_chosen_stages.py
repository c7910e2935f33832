# SPDX-License-Identifier: GPL-3.0-or-later
"""`--stages auto`, and Automatic in the panel: what the photos determine at the start."""

import time
from pathlib import Path

import bpy
import made_scenes as made
import pytest
from command_line import command
from drawn_panels import draw
from pressed_buttons import TIMER, Pressed

from selenite import native
from selenite.advice.information import conditioning
from selenite.advice.information.photo_information import PhotoInformation
from selenite.capture.request import CaptureRequest
from selenite.commands import fit
from selenite.fit import checkpoint
from selenite.fit.job import FitJob
from selenite.fit.plan import prepare
from selenite.fit.request import RunRequest, UnknownRequest, read_run
from selenite.interface import panels, state

pytestmark = pytest.mark.blender

ALL = ["Front:base_color", "Hidden:base_color"]
UNKNOWN = "not determined by the photos at the values that multi-start found"


@pytest.fixture
def words(tmp_path, capsys):
    """Arguments of a fit of two colours, one of them on a ball that the camera does not see."""
    front = made.material("Front", base_color=(0.6, 0.3, 0.2), roughness=0.8)
    made.studio()
    bpy.data.objects["Body"].data.materials[0] = front
    made.hidden_ball()
    path, photo = made.save(tmp_path / "scene.blend"), tmp_path / "photo.exr"
    assert command(capsys, "render", path, f"--out={photo}")[0] == 0
    return [
        "fit", path, f"--photo=Camera={photo}", "--fit=Front:base_color", "--height=12",
        "--iterations=16", f"--out={tmp_path / 'fits'}", "--stages=auto",
    ]  # fmt: skip


def test_what_no_photo_shows_waits_and_the_run_file_keeps_the_choice(words, capsys, monkeypatch):
    status, report, printed = command(capsys, *words, "--fit=Hidden:base_color")
    assert status == 0, printed
    assert [stage["parameters"] for stage in report["stages"]] == [ALL, ALL[:1], ALL]
    assert [stage["iterations"] for stage in report["stages"]] == [1, 8, 10]
    assert report["stopped_because"] == "converged"
    why = f"Base Color of Hidden last: {UNKNOWN}"
    assert f"stages: {why}" in printed and report["staging"] == why
    folder = Path(report["folder"])
    assert f"Stages: {why}" in (folder / "log.txt").read_text(encoding="utf-8")
    request = read_run(folder / "run.json")
    lists = [list(stage.parameters) for stage in request.stages]
    assert lists == [ALL, ALL[:1], ALL] and request.stages[0].name == "search"

    def chosen_again(*_arguments):
        raise AssertionError("a run file has its stages")

    monkeypatch.setattr(fit, "StageChoice", chosen_again)
    status, again, printed = command(capsys, "fit", str(folder / "run.json"), words[6])
    assert status == 0 and f"stages: {why}" in printed
    assert again["parameters"] == report["parameters"]
    assert again["stages"][0]["values"] == report["stages"][0]["values"]


def test_where_a_fit_has_no_multi_start_the_start_itself_counts(words, capsys):
    status, report, printed = command(capsys, *words, "--fit=Hidden:base_color", "--search=off")
    assert status == 0, printed
    assert [stage["parameters"] for stage in report["stages"]] == [ALL[:1], ALL]
    assert "not determined by the photos at the start" in report["staging"]


def test_what_is_determined_is_fitted_at_once(words, capsys):
    status, report, printed = command(capsys, *words)
    assert status == 0, printed
    assert "stages" not in report
    assert "stages: All at once: the photos determine every parameter" in printed


def test_a_resumed_run_keeps_the_stages_that_were_chosen(words, tmp_path, capsys, monkeypatch):
    words[5] = "--iterations=600"
    status, report, _ = command(capsys, *words, "--fit=Hidden:base_color")
    assert status == 0
    request = read_run(Path(report["folder"]) / "run.json")
    bpy.ops.wm.open_mainfile(filepath=words[1])
    job = FitJob(prepare(made.read(), request))
    recorder = checkpoint.Recorder(tmp_path / "killed.unfinished", job.plan.request)
    job.start()
    until = time.monotonic() + 60
    state = recorder.folder / "state.json"
    while not state.exists() and time.monotonic() < until:
        recorder.update(job, now=True)
        time.sleep(0.005)
    job.cancel()
    job.join()

    def chosen_again(*_arguments):
        raise AssertionError("nothing is chosen twice")

    monkeypatch.setattr(fit, "StageChoice", chosen_again)
    status, resumed, printed = command(capsys, "fit", "--resume", str(recorder.folder))
    assert status == 0, printed
    assert "Base Color of Hidden last" in printed
    parameters = [stage["parameters"] for stage in resumed["stages"]]
    assert parameters[:2] == [ALL, ALL[:1]] and parameters[-1] == ALL


#: A dark opaque body, as a fit without any knowledge starts.
DARK = [
    "--start=Body:base_color=0.04,0.04,0.04",
    "--start=Body:transmission=0.001",
    "--start=Body:ior=1.57",
]


@pytest.fixture
def glass(tmp_path, capsys):
    """Arguments of a fit of a transmitting ball, before two coloured ones, from a dark start."""
    made.studio(base_color=(0.6, 0.5, 0.4), roughness=0.3, ior=1.3, transmission=0.9)
    red = made.sphere("Red", made.material("Red", base_color=(0.8, 0.2, 0.1), roughness=0.9))
    red.location = (0.7, 0.3, -2.5)
    blue = made.sphere("Blue", made.material("Blue", base_color=(0.1, 0.2, 0.8), roughness=0.9))
    blue.location = (-1.2, -0.6, -3.0)
    made.light(energy=150).location = (1.5, 1.0, 4.0)
    path, photo = made.save(tmp_path / "glass.blend"), tmp_path / "photo.exr"
    assert command(capsys, "render", path, f"--out={photo}", "--spp=512")[0] == 0
    return [
        "fit", path, f"--photo=Camera={photo}", "--fit=Body:base_color,transmission,ior", *DARK,
        "--height=32", "--iterations=20", "--seed=1", f"--out={tmp_path / 'fits'}", "--stages=auto",
    ]  # fmt: skip


def test_from_a_dark_start_the_choice_is_made_where_the_search_ended(glass, capsys, monkeypatch):
    """The start itself led to transmission .50 and IOR 1.45: an opaque look-alike."""
    at_values = {}

    def photo_information(plan, scene):
        at_values.update({item.name: list(item.start) for item in plan.unknowns})
        return PhotoInformation(plan, scene)

    monkeypatch.setattr(conditioning, "PhotoInformation", photo_information)
    status, report, printed = command(capsys, *glass)
    assert status == 0, printed
    assert at_values["Body:transmission"][0] > 0.5
    assert "the values that multi-start found" in report["staging"]
    for stage in report.get("stages", ())[:1]:  # none where all is determined there
        assert stage["parameters"] == list(at_values)
        for name, value in stage["values"].items():
            assert value == pytest.approx(at_values[name], abs=0.01)
    assert report["parameters"]["Body:transmission"]["value"] == pytest.approx(0.9, abs=0.1)
    assert report["parameters"]["Body:ior"]["value"] == pytest.approx(1.3, abs=0.05)


def test_cancelling_ends_the_search_and_so_does_asking_no_further(glass):
    bpy.ops.wm.open_mainfile(filepath=glass[1])
    photo = glass[2].partition("=Camera=")[2]
    unknowns = tuple(UnknownRequest("Body", name) for name in ("transmission", "ior"))
    request = RunRequest("", unknowns, (CaptureRequest("Camera", photo),))
    plan = prepare(made.read(), request)
    choice = conditioning.StageChoice(plan, lambda _: plan)
    steps = choice.steps()
    assert next(steps).text == "multi-start"
    choice.cancel()
    with pytest.raises(native.core().Cancelled):
        list(steps)
    choice = conditioning.StageChoice(plan, lambda _: plan)
    steps = choice.steps()
    next(steps)
    steps.close()
    assert not choice._search.progress().running


def panel_fit(tmp_path):
    """The panel set to fit the two colours of `words` in automatic stages."""
    from test_interface import prepare_fit

    _, settings = prepare_fit(tmp_path)
    made.hidden_ball()
    bpy.context.view_layer.update()
    bpy.ops.selenite.refresh_rows()
    for row in settings.rows:
        row.enabled = row.parameter == "base_color"
    settings.stage_mode = "auto"
    return settings


@pytest.mark.usefixtures("addon")
def test_the_panel_chooses_says_why_and_fits(tmp_path):
    panel_fit(tmp_path)
    assert bpy.ops.selenite.start() == {"FINISHED"}
    names = [stage["parameters"] for stage in state.RUN.result["stages"]]
    both = ["Body:base_color", "Hidden:base_color"]
    assert names == [both, both[:1], both]
    drawn = " ".join(draw(panels.SELENITE_PT_fit).split())
    assert "Stages: Base Color of Hidden last: not determined" in drawn


@pytest.mark.usefixtures("addon")
def test_the_panel_stays_usable_while_it_looks_and_cancel_ends_it(tmp_path):
    from selenite.interface.operators.fit import SELENITE_OT_start as Start

    panel_fit(tmp_path)
    start = Pressed(Start)
    assert start._start(bpy.context)
    assert state.RUN.job is None and not bpy.ops.selenite.start.poll()
    assert "Choosing stages" in draw(panels.SELENITE_PT_fit)
    assert bpy.ops.selenite.cancel() == {"FINISHED"}
    state.STAGES.job._thread.join()
    assert start.modal(bpy.context, TIMER) == {"CANCELLED"}
    assert state.STAGES.job is None and state.RUN.job is None
    assert "nothing was changed" in " ".join(draw(panels.SELENITE_PT_head).split())
    assert start._start(bpy.context)
    state.STAGES.job._thread.join()
    assert start.modal(bpy.context, TIMER) == {"PASS_THROUGH"}
    assert "Stage 1 of 3: search" in f"Stage {state.RUN.job.progress().stage}"
    bpy.ops.selenite.cancel()
    assert start._finish(bpy.context) == {"CANCELLED"}
