# SPDX-License-Identifier: GPL-3.0-or-later
"""Seconds and errors to expect of each preset: `selenite trade --expected`, and Estimate."""

import bpy
import made_scenes as made
import numpy as np
import pytest
from command_line import command
from drawn_panels import draw
from pressed_buttons import ESCAPE, TIMER, Pressed

from selenite.advice.information.job import BackgroundJob
from selenite.advice.trade.start import estimate_of
from selenite.capture.request import CaptureRequest
from selenite.fit.request import RunRequest, UnknownRequest
from selenite.fit.settings import FitSettings
from selenite.interface import panels, state

pytestmark = pytest.mark.blender


def test_expected_errors_are_those_that_fits_tell_and_fall_with_the_preset(
    lit_ball, tmp_path, capsys
):
    photo = tmp_path / "photo.exr"
    render = ("render", lit_ball, "--camera=Camera", "--spp=1024", "--seed=9", f"--out={photo}")
    assert command(capsys, *render)[0] == 0
    words = ("--fit=Body:base_color", "--fit=Key Light:power", f"--photo=Camera={photo}")
    status, content, printed = command(capsys, "trade", lit_ball, *words, "--expected")
    assert status == 0, printed
    presets = content["presets"]
    assert list(presets) == ["draft", "balanced", "accurate"]
    seconds = [item["expected_seconds"] for item in presets.values()]
    errors = [item["expected_error"] for item in presets.values()]
    assert 0 < seconds[0] < seconds[1] < seconds[2]
    assert errors[0] > errors[1] > errors[2] > 0
    assert content["remark"] is None
    assert "Draft: about" in printed and "error" in printed and "worst: " in printed
    status, fitted, _ = command(
        capsys, "fit", lit_ball, *words, "--preset=draft", f"--out={tmp_path / 'fits'}"
    )
    assert status == 0
    fitted = {
        name: np.sqrt(np.mean(np.square(fitted["parameters"][name]["standard_error"])))
        for name in ("Body:base_color", "Key Light:power")
    }
    expected = presets["draft"]["expected_errors"]
    assert 0.4 < expected["Body:base_color"] / fitted["Body:base_color"] < 2.5
    # Of a power in logarithms, as `selenite trade` measures it.
    assert 0.4 < expected["Key Light:power"] / (fitted["Key Light:power"] / 200) < 2.5
    both = np.sqrt(np.mean(np.square(list(expected.values()))))
    assert presets["draft"]["expected_error"] == pytest.approx(both)


def test_without_photos_it_is_asked_what_photos_from_all_cameras_would_tell(
    lit_ball, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.iterdir())
    status, content, printed = command(
        capsys, "trade", lit_ball, "--fit=Body:base_color", "--expected"
    )
    assert status == 0, printed
    assert 0 < content["presets"]["balanced"]["expected_error"] < 0.02
    assert sorted(tmp_path.iterdir()) == before
    status, content, _ = command(capsys, "trade", lit_ball, "--fit=Body:base_color")
    assert status == 2
    assert content["problems"][0]["object"] == "Argument --out"


def test_what_no_photo_shows_is_named_and_does_not_count(tmp_path, capsys):
    front = made.material("Front", base_color=(0.6, 0.3, 0.2), roughness=0.8)
    made.studio()
    bpy.data.objects["Body"].data.materials[0] = front
    made.hidden_ball(roughness=0.8)
    path = made.save(tmp_path / "scene.blend")
    words = ("--fit=Front:base_color", "--fit=Hidden:base_color", "--expected")
    status, content, printed = command(capsys, "trade", path, *words)
    assert status == 0, printed
    draft = content["presets"]["draft"]
    assert draft["expected_errors"]["Hidden:base_color"] is None
    assert draft["expected_error"] == draft["expected_errors"]["Front:base_color"] < 0.05
    assert "not determined: Base Color of Hidden)" in printed
    status, content, printed = command(capsys, "trade", path, *words[1:])
    assert content["presets"]["draft"]["expected_error"] is None
    assert "s (not determined: Base Color)" in printed


def test_many_unknowns_and_grids_get_seconds_and_the_reason(lit_ball, tmp_path, capsys):
    many = "base_color,specular_tint,coat_tint,sheen_tint,roughness"
    status, content, printed = command(
        capsys, "trade", lit_ball, f"--fit=Body:{many}", "--expected"
    )
    assert status == 0, printed
    assert content["presets"]["draft"]["expected_seconds"] > 0
    assert content["presets"]["draft"]["expected_error"] is None
    assert content["presets"]["draft"]["expected_errors"] == {}
    assert "13 numbers are unknown, a fit refines up to 12" in printed
    bpy.ops.wm.read_factory_settings(use_empty=True)
    made.smoke()
    photo = made.photo(tmp_path / "photo.exr")
    request = RunRequest(
        "",
        (UnknownRequest("Smoke", "albedo_grid", grid="4"),),
        (CaptureRequest("Camera", str(photo)),),
        FitSettings(height=16),
    )
    estimate = estimate_of(made.read(), request, {})
    for _ in estimate.steps():
        pass
    assert "a grid or image has too many values" in estimate.lines()[-1]
    assert all(line.endswith((" s", " min")) for line in estimate.lines()[:3])


def estimate_in(tmp_path, value=0.2):
    """Of the open scene's base colour from a grey photo."""
    photo = made.photo(tmp_path / "photo.exr", value=value)
    unknowns = (UnknownRequest("Body", "base_color"),)
    captures = (CaptureRequest("Camera", str(photo)),)
    return estimate_of(made.read(), RunRequest("", unknowns, captures, FitSettings(height=24)), {})


def test_a_photo_far_from_the_render_is_reported(tmp_path):
    made.studio()
    estimate = estimate_in(tmp_path, value=5.0)
    for _ in estimate.steps():
        pass
    assert "estimate again after the fit" in estimate.remark


def test_a_cancelled_estimate_tells_nothing(tmp_path):
    made.studio()
    job = BackgroundJob(estimate_in(tmp_path))
    job.start()
    job.cancel()
    assert job.join() is False
    assert job.work.presets == {}


@pytest.mark.usefixtures("addon")
def test_the_panel_shows_progress_and_esc_ends_it(tmp_path):
    from test_interface import prepare_fit

    from selenite.interface.operators.time import SELENITE_OT_estimate as Estimate

    prepare_fit(tmp_path)
    estimate = Pressed(Estimate)
    assert estimate._start(bpy.context)
    assert not bpy.ops.selenite.start.poll()
    drawn = draw(panels.SELENITE_PT_fit)
    assert "selenite.cancel_estimate" in drawn and "selenite.estimate" not in drawn
    assert estimate.modal(bpy.context, ESCAPE) == {"RUNNING_MODAL"}
    state.ESTIMATE.job._thread.join()
    assert estimate.modal(bpy.context, TIMER) == {"CANCELLED"}
    assert state.ESTIMATE.job is None and not state.EXPECTED and not estimate.said
    assert "about" not in draw(panels.SELENITE_PT_fit)
    assert bpy.ops.selenite.estimate() == {"FINISHED"}
    assert "Accurate: about" in draw(panels.SELENITE_PT_fit)
    state.EXPECTED.clear()
