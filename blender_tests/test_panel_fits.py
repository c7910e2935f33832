# SPDX-License-Identifier: GPL-3.0-or-later
"""What the panel asks the native fit for, and what becomes of its answer: Esc, Apply, Restore."""

from dataclasses import fields
from types import SimpleNamespace

import bpy
import made_scenes as made
import numpy as np
import pytest
import recording_fit
import undo_steps
from pressed_buttons import ESCAPE, TIMER, Pressed, until_over

from selenite import native
from selenite.fit.job import FitFailed, FitJob
from selenite.fit.request import read_run
from selenite.fit.settings import FitSettings
from selenite.interface import state
from selenite.interface.operators.fit import SELENITE_OT_start as Start
from selenite.problems import Problem

pytestmark = [pytest.mark.blender, pytest.mark.blender34, pytest.mark.usefixtures("addon")]

# Nothing here is a default, and no two numbers are equal.
PANEL = {
    "loss": "brightness-independent-mse",
    "optimiser": "adam",
    "iterations": 7,
    "until_converged": False,
    "spp": 6,
    "tolerance": 0.25,
    "height": 18,
    "seed": 11,
    "depth": 5,
    "threads": 2,
    "accumulate": False,
    "picture_spp": 3,
    "physical_refraction": True,
    "search": "off",
    "precision": "exact",
    "prior": "misfit",
}
#: Settings that the native fit has otherwise, or not at all.
OTHERWISE = ("height", "picture_spp", "physical_refraction", "until_converged", "precision")
NATIVE = {name: PANEL[name] for name in PANEL if name not in OTHERWISE}
COLOUR, ROUGHNESS = "Body:base_color", "Body:roughness"


def row_of(settings, parameter):
    return next(row for row in settings.rows if row.parameter == parameter)


@pytest.fixture
def settings(tmp_path):
    """A ball with two photos that count, the second masked, and one that is switched off; two
    ticked rows, each with bounds and a rate of its own. The file has a place."""
    made.studio(base_color=(0.8, 0.4, 0.2), roughness=0.5)
    made.camera("Side", distance=4.0)
    made.camera("Top", distance=6.0)
    left = np.zeros((36, 48, 3), np.float32)
    left[:, :24] = 1
    native.image().write_png(str(tmp_path / "left.png"), left)
    made.save(tmp_path / "scene.blend")
    found = bpy.context.scene.selenite
    bpy.ops.selenite.refresh_rows()
    for name, value in (("Camera", 0.25), ("Top", 0.75), ("Side", 0.5)):
        path = made.photo(tmp_path / f"{name}.exr", size=(48, 36), value=value)
        capture = found.captures.add()
        capture.camera = bpy.data.objects[name]
        capture.photo = bpy.data.images.load(str(path))
        capture.enabled = name != "Top"
        capture.mask_path = str(tmp_path / "left.png") if name == "Side" else ""
    for name, low, high, rate in (("base_color", 0.1, 0.9, 0.04), ("roughness", 0.2, 0.6, 0.08)):
        row = row_of(found, name)
        row.enabled, row.minimum, row.maximum, row.learning_rate = True, low, high, rate
    row = row_of(found, "base_color")
    row.use_start, row.start = True, (0.3, 0.5, 0.7)
    for name, value in PANEL.items():
        setattr(found, name, value)
    found.output = str(tmp_path / "fits")
    return found


def colour():
    """Of the material as it stands in the scene."""
    socket = made.socket(bpy.data.materials["Body"], "base_color")
    return list(socket.default_value)[:3]


def paint(*value):
    made.socket(bpy.data.materials["Body"], "base_color").default_value = (*value, 1.0)


def results():
    """Name -> fitted value, as the panel keeps them in the scene."""
    return {
        f"{row.owner}:{row.parameter}": list(row.value)[: row.width]
        for row in bpy.context.scene.selenite.results
    }


def assert_best(fit):
    found = results()
    assert set(found) == {COLOUR, ROUGHNESS}
    for name, value in fit.best.items():
        assert found[name] == pytest.approx(value), name


def test_every_setting_of_the_panel_reaches_the_native_fit(settings, monkeypatch):
    recorded = recording_fit.install(monkeypatch)
    assert {field.name for field in fields(FitSettings)} == {*PANEL, "learning_rate"}
    assert bpy.ops.selenite.start() == {"FINISHED"}
    fit = recorded.fit
    assert fit.settings == NATIVE | {
        "tolerance": pytest.approx(0.25),
        "most_iterations": 0,
        "precision": 0.0,
    }
    assert {item["physical_refraction"] for item in recorded.materials} == {True}
    first, second = fit.unknowns
    assert (first.owner, first.parameter) == ("Body", "base_color")
    assert first.start == pytest.approx([0.3, 0.5, 0.7])
    assert (first.minimum, first.maximum) == pytest.approx((0.1, 0.9))
    assert first.learning_rate == pytest.approx(0.04)
    assert (second.parameter, second.start) == ("roughness", pytest.approx([0.5]))
    assert second.learning_rate == pytest.approx(0.08)
    assert (second.minimum, second.maximum) == pytest.approx((0.2, 0.6))


def test_photos_that_are_switched_off_do_not_count(settings, monkeypatch):
    recorded = recording_fit.install(monkeypatch)
    bpy.ops.selenite.start()
    first, second = recorded.fit.photos
    assert (first.camera, second.camera) == ("Camera", "Side")
    assert first.reference.shape == second.reference.shape == (18, 24, 3)
    assert first.reference == pytest.approx(0.25)
    assert second.reference == pytest.approx(0.5)
    assert (first.weight == 1).all()
    # Of the mask's right half, and of the rim of the left one.
    assert (second.weight[:, :11] == 1).all() and (second.weight[:, 11:] == 0).all()


def test_the_saved_result_has_the_best_values_and_pictures_as_set(settings, monkeypatch):
    recorded = recording_fit.install(monkeypatch)
    bpy.ops.selenite.start()
    assert_best(recorded.fit)
    assert bpy.ops.selenite.save_result() == {"FINISHED"}
    assert [picture.camera for picture in recorded.pictures] == ["Camera"] * 2 + ["Side"] * 2
    assert [picture.spp for picture in recorded.pictures] == [1, 3] * 2  # of the start, the result
    for picture in recorded.pictures:
        assert (picture.seed, picture.depth, picture.threads) == (11, 5, 2)
    found = recording_fit.values_of(recorded.pictures[-1].scene, [COLOUR])[COLOUR]
    assert found == pytest.approx(recorded.fit.best[COLOUR])
    run = read_run(state.RUN.done.folder / "run.json")
    assert [item.learning_rate for item in run.unknowns] == pytest.approx([0.04, 0.08])
    assert [item.maximum for item in run.unknowns] == pytest.approx([0.9, 0.6])


def test_apply_writes_the_best_values(settings, monkeypatch):
    recorded = recording_fit.install(monkeypatch)
    bpy.ops.selenite.start()
    assert colour() == pytest.approx([0.8, 0.4, 0.2]), "a fit changes nothing before Apply"
    assert bpy.ops.selenite.apply() == {"FINISHED"}
    assert colour() == pytest.approx(recorded.fit.best[COLOUR])
    rough = made.socket(bpy.data.materials["Body"], "roughness").default_value
    assert rough == pytest.approx(recorded.fit.best[ROUGHNESS][0])
    assert row_of(settings, "base_color").value == " ".join(
        f"{value:.2f}" for value in recorded.fit.best[COLOUR]
    )


def test_restore_puts_back_what_stood_there_before_apply(settings, monkeypatch):
    """Not what stood there when the fit began."""
    recording_fit.install(monkeypatch)
    bpy.ops.selenite.start()
    paint(0.05, 0.15, 0.35)
    bpy.ops.selenite.apply()
    assert colour() != pytest.approx([0.05, 0.15, 0.35])
    assert bpy.ops.selenite.restore() == {"FINISHED"}
    assert colour() == pytest.approx([0.05, 0.15, 0.35])
    assert not settings.applied


def test_apply_and_restore_are_an_undo_step_each(settings, monkeypatch):
    recorded = recording_fit.install(monkeypatch)
    best = [pytest.approx(value) for value in recorded_best(recorded)]
    undo_steps.prepare()
    assert bpy.ops.selenite.apply("EXEC_DEFAULT", True) == {"FINISHED"}
    assert colour() == best
    undo_steps.undo()
    assert colour() == pytest.approx([0.8, 0.4, 0.2])
    assert not bpy.context.scene.selenite.applied
    undo_steps.redo()
    assert colour() == best and bpy.context.scene.selenite.applied
    undo_steps.prepare()
    assert bpy.ops.selenite.restore("EXEC_DEFAULT", True) == {"FINISHED"}
    assert colour() == pytest.approx([0.8, 0.4, 0.2])
    undo_steps.undo()
    assert colour() == best and bpy.context.scene.selenite.applied


def recorded_best(recorded):
    bpy.ops.selenite.start()
    return recorded.fit.best[COLOUR]


def test_a_fit_is_an_undo_step(settings, monkeypatch):
    recording_fit.install(monkeypatch)
    undo_steps.prepare()
    assert bpy.ops.selenite.start("EXEC_DEFAULT", True) == {"FINISHED"}
    assert results()
    undo_steps.undo()
    assert not results()


def begun(monkeypatch, empty=True):
    """(the operator, its fit): of a fit that runs until somebody ends it. empty: no result is there
    yet."""
    recorded = recording_fit.install(monkeypatch, polls=None)
    start = Pressed(Start)
    assert start._start(bpy.context)
    assert start.modal(bpy.context, TIMER) == {"PASS_THROUGH"}
    assert state.RUN.fitting.progress.running and bool(results()) != empty
    return start, recorded.fit


def test_esc_stops_the_fit_and_keeps_its_best_values(settings, monkeypatch):
    start, fit = begun(monkeypatch)
    assert start.modal(bpy.context, ESCAPE) == {"RUNNING_MODAL"}
    assert fit.calls.count("cancel") == 1
    assert until_over(start, bpy.context) == {"FINISHED"}
    assert_best(fit)
    assert "best values so far are kept" in state.RUN.message and not state.RUN.is_active


def test_other_keys_go_on_to_blender(settings, monkeypatch):
    start, fit = begun(monkeypatch)
    for kind, value in (("ESC", "RELEASE"), ("A", "PRESS"), ("MOUSEMOVE", "NOTHING")):
        event = SimpleNamespace(type=kind, value=value)
        assert start.modal(bpy.context, event) == {"PASS_THROUGH"}
    assert "cancel" not in fit.calls and state.RUN.fitting is not None
    bpy.ops.selenite.cancel()
    start.modal(bpy.context, TIMER)


@pytest.mark.parametrize("keep", [True, False])
def test_stop_keeps_and_cancel_forgets(settings, monkeypatch, keep):
    start, fit = begun(monkeypatch)
    assert (bpy.ops.selenite.stop if keep else bpy.ops.selenite.cancel)() == {"FINISHED"}
    assert "cancel" in fit.calls
    ended = until_over(start, bpy.context)
    assert ended == ({"FINISHED"} if keep else {"CANCELLED"})
    assert bool(results()) == keep
    assert colour() == pytest.approx([0.8, 0.4, 0.2]) and not state.RUN.is_active


def test_a_fit_that_fails_is_named_and_leaves_the_result_before_it(settings, monkeypatch):
    recording_fit.install(monkeypatch)
    assert bpy.ops.selenite.start() == {"FINISHED"}
    done, kept = state.RUN.done, results()
    start, fit = begun(monkeypatch, empty=False)
    fit.cancel()  # the thread has ended
    problem = Problem("Iteration 3", "no memory is left", "lower the height")

    def failing(_job):
        raise FitFailed([problem])

    monkeypatch.setattr(FitJob, "progress", failing)
    assert start.modal(bpy.context, TIMER) == {"CANCELLED"}
    assert state.PROBLEMS[bpy.context.scene.name] == [problem]
    assert any("no memory is left; lower the height" in text for _, text in start.said)
    assert state.RUN.done is done and results() == kept
    state.PROBLEMS.clear()


def test_a_second_fit_takes_the_place_of_the_first(settings, monkeypatch):
    recorded = recording_fit.install(monkeypatch)
    bpy.ops.selenite.start()
    bpy.ops.selenite.apply()
    row_of(settings, "base_color").maximum = 0.7
    bpy.ops.selenite.start()
    assert not settings.applied
    assert results()[COLOUR] == pytest.approx(recorded.fits[1].best[COLOUR])
    assert recorded.fits[1].best != recorded.fits[0].best


def test_stages_of_an_own_list_have_their_own_numbers(settings, monkeypatch):
    recorded = recording_fit.install(monkeypatch)
    bpy.ops.selenite.add_stage()
    bpy.ops.selenite.add_stage()
    settings.stage_mode = "own"
    stage = settings.stages[0]
    stage.iterations, stage.spp, stage.height = 9, 8, 12
    assert bpy.ops.selenite.start() == {"FINISHED"}
    first, second = recorded.fit.stages
    assert (first.settings["iterations"], first.settings["spp"]) == (9, 8)
    assert (second.settings["iterations"], second.settings["spp"]) == (7, 6)
    assert {photo.reference.shape for photo in first.photos} == {(12, 16, 3)}
    assert {photo.reference.shape for photo in second.photos} == {(18, 24, 3)}
