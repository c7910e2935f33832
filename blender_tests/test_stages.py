# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite fit --stages`: what is held, what goes on, what is written, what is refused."""

import csv
import json
import time
from pathlib import Path

import made_scenes as made
import numpy as np
import pytest
from command_line import command

from selenite import grid_files, native
from selenite.capture.request import CaptureRequest
from selenite.cli import main
from selenite.fit.job import FitJob
from selenite.fit.plan import prepare
from selenite.fit.request import RunRequest, UnknownRequest
from selenite.fit.settings import FitSettings
from selenite.fit.staging.request import StageRequest
from selenite.report.results import write_results

pytestmark = pytest.mark.blender

TRUTH = {"Body:base_color": (0.2, 0.6, 0.4), "Key Light:power": (80.0,)}
STAGES = {
    "schema": 1,
    "stages": [
        {"name": "colour", "parameters": ["Body:base_color"], "iterations": 8, "height": 12},
        {"name": "all", "parameters": ["Body:base_color", "Key Light:power"], "spp": 8},
    ],
}


@pytest.fixture
def scene(tmp_path):
    """A saved scene with a ball and a lamp, and the arguments of a fit to a picture of TRUTH."""
    made.studio(base_color=(0.8, 0.4, 0.2), roughness=0.5)
    made.light("Key Light", energy=40)
    path = made.save(tmp_path / "scene.blend")
    values = [f"{name}={','.join(map(str, value))}" for name, value in TRUTH.items()]
    words = ["--spp", "256", *(word for value in values for word in ("--set", value))]
    assert main(["render", path, "--out", str(tmp_path / "photo.exr"), *words]) == 0
    return [
        "fit", path, f"--photo=Camera={tmp_path / 'photo.exr'}", "--height=16", "--iterations=16",
        f"--out={tmp_path / 'fits'}",
    ]  # fmt: skip


def stage_file(tmp_path, data=None):
    path = tmp_path / "stages.json"
    path.write_text(json.dumps(data or STAGES), encoding="utf-8")
    return f"--stages={path}"


def rows(report):
    with (Path(report["folder"]) / "history.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_stages_run_one_after_another_and_hold_the_rest(scene, tmp_path, capsys):
    status, report, _ = command(capsys, *scene, stage_file(tmp_path))
    assert status == 0, report
    found = {name: row["value"] for name, row in report["parameters"].items()}
    assert found["Body:base_color"] == pytest.approx(TRUTH["Body:base_color"], abs=0.03)
    # The photo is 32 x 24, so that most of its pixels lie in two or four of the 21 x 16 that are
    # compared: a render that does not know ends at 70, five standard errors away.
    assert found["Key Light:power"] == pytest.approx(80.0, rel=0.05)
    shown = [(s["name"], s["spp"], s["height"]) for s in report["stages"]]
    assert shown == [("colour", 4, 12), ("all", 8, 16)]
    assert [s["iterations"] for s in report["stages"]] == [8, 11]
    assert report["stages"][1]["stopped_because"] == "converged"
    assert report["iterations"] == 19 and report["best_iteration"] > 8
    assert report["samples"] == sum(stage["samples"] for stage in report["stages"])
    history = rows(report)
    first = [row for row in history if row["stage"] == "1"]
    second = [row for row in history if row["stage"] == "2"]
    assert {row["Key Light:power"] for row in first} == {"40.0"}
    assert [int(row["iteration"]) for row in first] == list(range(9))
    # the last one twice: what the iterations found, and what its refinement made of it
    assert [int(row["iteration"]) for row in second] == [*range(8, 20), 19]
    # the second stage begins at the best values of the first
    best = report["stages"][0]["values"]["Body:base_color"]
    assert [float(second[0][f"Body:base_color.{c}"]) for c in "rgb"] == best
    log = (Path(report["folder"]) / "log.txt").read_text(encoding="utf-8")
    assert "Stage 2 'all': Body:base_color, Key Light:power; 11 iterations" in log


def test_run_json_repeats_the_stages_with_the_same_bytes(scene, tmp_path, capsys):
    words = ("--fit=Body:base_color,ior", "--stages=ior-last", "--threads=1")
    status, first, _ = command(capsys, *scene, *words)
    assert status == 0, first
    assert [stage["parameters"] for stage in first["stages"]] == [
        ["Body:base_color"],
        ["Body:base_color", "Body:ior"],
    ]
    run = Path(first["folder"]) / "run.json"
    status, second, _ = command(
        capsys, "fit", str(run), "--threads=2", f"--out={tmp_path / 'again'}"
    )
    assert status == 0, second
    assert second["parameters"] == first["parameters"]
    histories = [(Path(r["folder"]) / "history.csv").read_bytes() for r in (first, second)]
    assert histories[0] == histories[1]


@pytest.mark.parametrize(
    ("stages", "words", "texts"),
    [
        ([{"parameters": ["Body:rough"]}], (), ["no parameter 'rough'"]),
        (
            [{"name": "a", "parameters": ["Body:ior"], "spp": 1, "height": 0}],
            ("--fit=Body:base_color",),
            ["Stage 1 'a': 'Body:ior' is not fitted", "Stage 1 'a', setting 'height': 0 lies",
             "Stage 1 'a', setting 'spp': loss 'robust' needs 2",
             "Parameter 'Body:base_color': it is in no stage"],
        ),
        (
            [{"name": "a", "parameters": ["Body:ior"]}, {"name": "a", "parameters": ["roughness"]}],
            (),
            ["another stage has its name", "'roughness' is not of the form"],
        ),
    ],
)  # fmt: skip
def test_bad_stages_are_named_and_nothing_is_written(scene, tmp_path, capsys, stages, words, texts):
    status, report, _ = command(capsys, *scene, stage_file(tmp_path, {"stages": stages}), *words)
    assert status == 2
    lines = [f"{p['object']}: {p['cause']}; {p['cure']}" for p in report["problems"]]
    for text in texts:
        assert any(text in line for line in lines), (text, lines)
    assert not (tmp_path / "fits").exists()
    status, report, _ = command(capsys, *scene, f"--stages={tmp_path / 'nowhere.json'}")
    assert status == 2
    assert "nowhere.json" in report["problems"][0]["object"]


def plan_of(tmp_path, iterations, optimiser="auto"):
    """Two stages for a dark photo of the studio."""
    made.studio(roughness=0.5)
    photo = made.photo(tmp_path / "photo.png", value=0.2)
    names = [("Body", "base_color"), ("Body", "roughness")]
    request = RunRequest(
        "",
        tuple(UnknownRequest(*name) for name in names),
        (CaptureRequest("Camera", str(photo)),),
        FitSettings(height=12, picture_spp=4, optimiser=optimiser),
        (
            StageRequest("colour", ("Body:base_color",), iterations[0]),
            StageRequest("all", ("Body:base_color", "Body:roughness"), iterations[1]),
        ),
    )
    return prepare(made.read(), request)


@pytest.mark.parametrize(("iterations", "wanted"), [((100_000, 5), 1), ((6, 100_000), 2)])
def test_cancel_keeps_the_best_so_far_in_any_stage(tmp_path, iterations, wanted):
    job = FitJob(plan_of(tmp_path, iterations, "adam"))  # which does not converge
    job.start()
    # The best values are chosen at validations: at the beginning, and after every fifth iteration.
    begin, until = iterations[0] if wanted == 2 else 0, time.monotonic() + 60
    while (state := job.progress()).iteration < begin + 6 and time.monotonic() < until:
        time.sleep(0.01)
    assert state.stage.startswith(f"{wanted} of 2")
    assert state.iterations == sum(iterations) and 0 < state.fraction < 1
    assert set(state.values) == {"Body:base_color", "Body:roughness"}
    assert job.preview(0).shape == (12, 16, 3)
    job.cancel()
    job.join()
    state = job.progress()
    assert not state.running and state.stopped_because == "cancelled"
    result = job.result()
    assert len(result["stages"]) == wanted
    assert result["values_best"]["Body:base_color"] != [0.8, 0.8, 0.8]  # darker than the start
    assert (result["values_best"]["Body:roughness"] == [0.5]) == (wanted == 1)
    folder = write_results(job.plan, result, tmp_path / "out", "4.5", pictures=False)
    assert (folder / "result.json").is_file()


def test_a_run_that_is_stopped_at_once_can_be_written(tmp_path):
    job = FitJob(plan_of(tmp_path, (4, 5)))
    job.start()
    job.cancel()
    job.join()
    result = job.result()
    assert result["stopped_because"] == "cancelled"
    folder = write_results(job.plan, result, tmp_path / "out", "4.5", pictures=False)
    assert (folder / "history.csv").read_text(encoding="utf-8").startswith("stage,iteration,")


def test_join_runs_through_all_stages_without_anyone_polling(tmp_path):
    job = FitJob(plan_of(tmp_path, (4, 5)))
    job.start()
    job.join()
    result = job.result()
    first, last = result["stages"]
    assert result["iterations"] == first["iterations"] + last["iterations"] == 9
    assert result["best_iteration"] == first["iterations"] + last["best_iteration"]
    assert {name: result["values_best"][name] for name in last["values"]} == last["values"]
    history = result["history"]
    assert list(history["stage"]) == [1] * 5 + [2] * 7  # the last row is the refined state
    assert list(history["iteration"]) == [*range(5), *range(4, 10), 9]
    begun = {name: list(history["values"][name][5]) for name in first["values"]}
    assert begun == {name: pytest.approx(value) for name, value in first["values"].items()}
    assert job.progress().fraction == 1


def test_a_grid_starts_at_the_albedo_that_was_fitted_before_it(tmp_path, capsys):
    material = made.material("Smoke")
    tree = material.node_tree
    tree.nodes.remove(made.principled(material))
    node = tree.nodes.new("ShaderNodeVolumePrincipled")
    node.inputs["Density"].default_value = 2.0
    node.inputs["Color"].default_value = (0.3, 0.3, 0.3, 1.0)
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Volume"])
    made.sphere(material=material)
    made.camera()
    made.world(strength=0.5)
    made.light(energy=60)
    path = made.save(tmp_path / "scene.blend")
    photo = tmp_path / "photo.exr"
    words = ("--set", "Smoke:albedo=.8", "--spp", "256", "--out", str(photo))
    assert main(["render", path, *words]) == 0
    fit = (
        "fit", path, "--fit", "Smoke:albedo,albedo_grid", "--photo", f"Camera={photo}",
        "--height", "12", "--grid", "Smoke:albedo_grid=2", "--out", str(tmp_path / "out"),
    )  # fmt: skip
    status, report, _ = command(capsys, *fit, "--iterations", "12", "--stages", "colours-first")
    assert status == 0, report
    albedo = report["stages"][0]["values"]["Smoke:albedo"]
    assert albedo == pytest.approx([0.8] * 3, abs=0.05)
    history = rows(report)
    start = next(row for row in history if row["stage"] == "2")
    assert [float(start[f"Smoke:albedo_grid mean.{c}"]) for c in "rgb"] == pytest.approx(albedo)
    grid = grid_files.read(str(Path(report["folder"]) / "Smoke_albedo.npy"))
    assert grid.shape == (2, 2, 2, 3) and np.ptp(grid) > 0
    assert native.image().read(str(Path(report["folder"]) / "Camera_optimised.exr"))[0].mean() > 0
    status, report, _ = command(capsys, *fit, "--start", "Smoke:albedo_grid=0.4", "--stages",
                             "colours-first")  # fmt: skip
    assert status == 2 and "give no other start" in report["problems"][0]["cure"]
