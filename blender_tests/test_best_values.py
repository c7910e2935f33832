# SPDX-License-Identifier: GPL-3.0-or-later
"""The best values, not the last ones, in everything that a fit leaves behind."""

import csv
import json
import re
from pathlib import Path

import bpy
import made_scenes as made
import numpy as np
import pytest
import recording_fit
from command_line import command

from selenite import native

pytestmark = pytest.mark.blender

START = {"Body:base_color": [0.8, 0.4, 0.2], "Body:extinction": [2.0, 2.0, 2.0],
         "Key Light:power": [40.0]}  # fmt: skip
BOUNDS = {"Body:base_color": (0.1, 0.9), "Body:extinction": (0.5, 8.0),
          "Key Light:power": (20.0, 90.0)}  # fmt: skip


@pytest.fixture
def done(tmp_path, capsys, monkeypatch):
    """(the recorded fit, the command's report, what was printed, the saved file)."""
    material = made.studio(base_color=(0.8, 0.4, 0.2), transmission=1.0)
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeVolumePrincipled")
    node.inputs["Density"].default_value = 2.0
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Volume"])
    made.light("Key Light", energy=40)
    units = bpy.context.scene.unit_settings
    units.system, units.scale_length = "METRIC", 0.01
    photo = made.photo(tmp_path / "photo.exr", value=0.25)
    scene, saved = made.save(tmp_path / "scene.blend"), tmp_path / "fitted.blend"
    recorded = recording_fit.install(monkeypatch)
    words = ["fit", scene, f"--photo=Camera={photo}", "--height=12", "--picture-spp=4"]
    for name, (low, high) in BOUNDS.items():
        words += [f"--fit={name}", f"--bounds={name}={low},{high}"]
    status, report, printed = command(
        capsys, *words, f"--out={tmp_path / 'fits'}", f"--save={saved}"
    )
    assert status == 0, printed
    return recorded, report, printed, saved


def test_result_json_has_the_best_values_and_their_iteration(done):
    recorded, report, _, _ = done
    stored = json.loads((Path(report["folder"]) / "result.json").read_text(encoding="utf-8"))
    for found in (report, stored):
        for name, best in recorded.fit.best.items():
            row = found["parameters"][name]
            assert np.ravel(row["value"]) == pytest.approx(best), name
            assert np.ravel(row["initial"]) == pytest.approx(START[name]), name
            assert (row["minimum"], row["maximum"]) == BOUNDS[name]
        assert found["best_iteration"] == recording_fit.BEST_ITERATION
        assert found["iterations"] == recording_fit.ITERATIONS
        assert (found["samples"], found["dropped"]) == (1234, 6)
        assert (found["seconds"], found["cpu_seconds"]) == (1.5, 2.5)
        assert found["stopped_because"] == "converged"


def test_result_json_has_the_unit_and_the_error_of_each_parameter(done):
    recorded, report, _, _ = done
    units = {name: row["unit"] for name, row in report["parameters"].items()}
    assert units == {
        "Body:base_color": "1",
        "Body:extinction": "1/Blender unit",
        "Key Light:power": "W",
    }
    colour = report["parameters"]["Body:base_color"]
    assert colour["standard_error"] == pytest.approx([0.01, 0.02, 0.03])
    best = recorded.fit.best["Body:base_color"]
    assert colour["interval_90"][2] == pytest.approx([best[2] - 0.06, best[2] + 0.03])
    assert report["misfit"]["value"] == 0.0025
    extinction = recorded.fit.best["Body:extinction"]
    path = report["parameters"]["Body:extinction"]["mean_free_path"]
    # A Blender unit is a hundredth of a metre here.
    assert path["unit"] == "mm"
    assert path["value"] == pytest.approx([10 / sigma for sigma in extinction])


def test_the_saved_scene_has_the_best_values(done):
    recorded, _, _, saved = done
    bpy.ops.wm.open_mainfile(filepath=str(saved), load_ui=False)
    owners = made.read().owners
    for name, best in recorded.fit.best.items():
        owner, parameter = name.split(":")
        assert owners[owner].values[parameter] == pytest.approx(best, rel=1e-4), name


def test_terminal_and_log_tell_the_best_values(done):
    recorded, report, printed, _ = done
    rows = {
        cells[0]: cells[1:3]
        for line in printed.splitlines()
        if len(cells := re.split(r"  +", line)) > 2
    }
    starts = zip(("red", "green", "blue"), ("0.8", "0.4", "0.2"), strict=True)
    for at, (channel, start) in enumerate(starts):
        assert rows[f"Body:base_color {channel}"][0] == start
        fitted = float(rows[f"Body:base_color {channel}"][1])
        assert fitted == pytest.approx(recorded.fit.best["Body:base_color"][at], abs=0.0005)
    power = recorded.fit.best["Key Light:power"][0]
    assert rows["Key Light:power [W]"][0] == "40"
    assert float(rows["Key Light:power [W]"][1]) == pytest.approx(power, rel=1e-3)
    log = (Path(report["folder"]) / "log.txt").read_text(encoding="utf-8")
    assert f"Best iteration: {recording_fit.BEST_ITERATION}" in log
    assert f"Key Light:power: 40.0 -> {power}" in log


def test_pictures_are_of_the_start_and_of_the_best_values(done):
    recorded, report, _, _ = done
    initial, optimised = recorded.pictures
    names = list(START)
    for picture, wanted in ((initial, START), (optimised, recorded.fit.best)):
        found = recording_fit.values_of(picture.scene, names)
        for name in names:
            assert found[name] == pytest.approx(wanted[name]), name
    folder = Path(report["folder"])
    pictures = {
        name: native.image().read(str(folder / f"Camera_{name}.exr"))[0]
        for name in ("initial", "optimised", "reference", "error")
    }
    assert pictures["reference"] == pytest.approx(0.25)
    error = np.abs(pictures["optimised"] - 0.25)
    np.testing.assert_allclose(pictures["error"], error, atol=1e-6)
    assert np.abs(pictures["initial"] - pictures["optimised"]).max() > 0.01


def test_history_has_every_iteration_and_the_bias_by_channel(done):
    recorded, report, _, _ = done
    with (Path(report["folder"]) / "history.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["iteration"]) for row in rows] == list(range(recording_fit.ITERATIONS + 1))
    bias = [float(rows[0][f"mean_bias_{c}"]) for c in "rgb"]
    assert bias == pytest.approx(recording_fit.MEAN_BIAS)
    best = rows[recording_fit.BEST_ITERATION]
    found = [float(best[f"Body:base_color.{c}"]) for c in "rgb"]
    assert found == pytest.approx(recorded.fit.best["Body:base_color"])
    assert [float(row["loss"]) for row in rows][:2] == pytest.approx([1.0, 0.85])


def test_each_parameter_by_its_own_bounds(done):
    recorded, _, _, _ = done
    found = {
        f"{item.owner}:{item.parameter}": (item.minimum, item.maximum)
        for item in recorded.fit.unknowns
    }
    assert found == BOUNDS
