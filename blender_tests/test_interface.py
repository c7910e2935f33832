# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators and panels: registration, one fit from rows to Apply, undo, drawing."""

import subprocess
import sys
import time
from dataclasses import fields

import bpy
import made_scenes as made
import pytest
import undo_steps
from drawn_panels import FakeLayout, draw
from pressed_buttons import Pressed

import selenite
from selenite import native
from selenite.advice.information.job import BackgroundJob, Step
from selenite.cli import build_parser
from selenite.fit.settings import FitSettings
from selenite.interface import panels, properties, state
from selenite.interface.request import fit_settings

pytestmark = [pytest.mark.blender, pytest.mark.blender34]


def prepare_fit(tmp_path, iterations=6, lasting=False):
    """A small scene with a photo and one ticked parameter. A fit that is to last ends neither soon
    nor because its values have converged: they do that only where the loss is a sum of squares."""
    material = made.studio(roughness=0.5)
    path = made.photo(tmp_path / "Camera.png", value=0.2)
    settings = bpy.context.scene.selenite
    assert bpy.ops.selenite.refresh_rows() == {"FINISHED"}
    bpy.ops.selenite.add_capture()
    settings.captures[0].photo = bpy.data.images.load(str(path))
    row = next(item for item in settings.rows if item.parameter == "base_color")
    row.enabled = True
    settings.height, settings.iterations, settings.tolerance = 16, iterations, 0.0
    settings.picture_spp = 4
    if lasting:
        settings.iterations, settings.loss = 4000, "mae"
    return material, settings


def test_register_twice():
    for _ in range(2):
        selenite.register()
        assert hasattr(bpy.types.Scene, "selenite")
        selenite.unregister()
        assert not hasattr(bpy.types.Scene, "selenite")


@pytest.mark.usefixtures("addon")
def test_losses_of_the_panel_are_the_native_ones():
    numbers = {item[0]: item[3] for item in properties.LOSS_ITEMS}
    assert list(numbers) == [row["name"] for row in native.core().losses()]
    # What .blend files hold.
    kept = ("dual-buffer", "mse", "brightness-independent-mse", "mae", "mean-bias-error", "robust")
    assert {name: numbers[name] for name in kept} == dict(zip(kept, range(6), strict=True))
    optimisers = [item[0] for item in properties.OPTIMISER_ITEMS]
    assert sorted(optimisers) == sorted(
        ["auto", *(row["name"] for row in native.core().optimisers())]
    )


@pytest.mark.usefixtures("addon")
def test_every_setting_is_in_the_panel_and_reaches_the_fit():
    made.studio()
    settings, defaults = bpy.context.scene.selenite, FitSettings()
    changed = {
        "loss": "mse",
        "optimiser": "adam",
        "accumulate": False,
        "until_converged": False,
        "physical_refraction": True,
        "search": "off",
        "precision": "exact",
        "prior": "misfit",
    }
    drawn = draw(panels.SELENITE_PT_advanced).splitlines()
    names = [field.name for field in fields(FitSettings)]
    names.remove("learning_rate")  # that of each row
    for name in names:
        assert name in drawn
        assert getattr(settings, name) == getattr(defaults, name)
    for name in names:
        setattr(settings, name, changed.get(name, 3))
        assert getattr(fit_settings(bpy.context.scene), name) != getattr(defaults, name)


@pytest.mark.usefixtures("addon")
def test_iterations_that_are_typed_are_the_most_there_are():
    made.studio()
    settings = bpy.context.scene.selenite
    settings.iterations = 30
    assert not settings.until_converged
    settings.until_converged = True
    assert fit_settings(bpy.context.scene).native()["most_iterations"] == 90
    settings.preset = "draft"
    assert not settings.until_converged
    settings.preset = "balanced"
    assert settings.until_converged


@pytest.mark.parametrize("name", [field.name for field in fields(FitSettings)])
def test_every_setting_is_an_argument(name):
    option = "--no-accumulate" if name == "accumulate" else f"--{name.replace('_', '-')}"
    flags = ("physical_refraction", "accumulate", "until_converged")
    words = {"search": ["off"], "precision": ["draft"], "prior": ["misfit"]}
    value = words.get(name, [] if name in flags else ["3"])
    args = build_parser().parse_args(["fit", "scene.blend", option, *value])
    assert getattr(args, name) != getattr(build_parser().parse_args(["fit", "scene.blend"]), name)


@pytest.mark.usefixtures("addon")
def test_rows_keep_ticks_and_bounds_when_refreshed():
    material = made.studio()
    bpy.ops.selenite.refresh_rows()
    rows = bpy.context.scene.selenite.rows
    row = next(item for item in rows if item.parameter == "roughness")
    row.enabled, row.minimum = True, 0.25
    material.name = "Renamed"
    made.socket(material, "ior").driver_add("default_value")
    bpy.ops.selenite.refresh_rows()
    row = next(item for item in rows if item.parameter == "roughness")
    assert row.owner == "Renamed" and row.enabled and row.minimum == 0.25
    assert next(item for item in rows if item.parameter == "ior").reason.startswith("driven")
    bpy.ops.selenite.reset_rows()
    row = next(item for item in rows if item.parameter == "roughness")
    assert row.minimum == pytest.approx(0.02)


def translucent_studio():
    """The studio's ball as glass with a medium of extinction 4 in it; its material."""
    material = made.studio(transmission=1.0)
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeVolumePrincipled")
    node.inputs["Density"].default_value = 4.0
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Volume"])
    return material


@pytest.mark.usefixtures("addon")
def test_row_of_an_extinction_tells_the_mean_free_path():
    translucent_studio()
    scene = bpy.context.scene
    scene.unit_settings.system, scene.unit_settings.scale_length = "METRIC", 0.01
    bpy.ops.selenite.refresh_rows()
    settings = scene.selenite
    for index, row in enumerate(settings.rows):
        settings.active_row = index
        shown = "Mean free path 2.5 mm" in draw(panels.SELENITE_PT_parameters)
        assert shown == (row.parameter == "extinction"), row.parameter


@pytest.mark.usefixtures("addon")
def test_panel_names_an_open_body_until_it_is_closed():
    material = translucent_studio()
    bpy.ops.selenite.refresh_rows()
    assert "open edges" not in draw(panels.SELENITE_PT_parameters)
    sheet = made.triangle("Sheet", material)
    bpy.ops.selenite.refresh_rows()
    drawn = " ".join(draw(panels.SELENITE_PT_parameters).split())
    assert "Object 'Sheet'" in drawn and "3 open edges" in drawn and "Merge by Distance" in drawn
    with pytest.raises(RuntimeError, match="Object 'Sheet'"):
        bpy.ops.selenite.start()
    bpy.data.objects.remove(sheet)
    bpy.ops.selenite.refresh_rows()
    assert "open edges" not in draw(panels.SELENITE_PT_parameters)


@pytest.mark.usefixtures("addon")
def test_photo_becomes_the_background_of_its_camera(tmp_path):
    _, settings = prepare_fit(tmp_path)
    data = settings.captures[0].camera.data
    assert data.show_background_images
    assert data.background_images[0].image == settings.captures[0].photo


@pytest.mark.usefixtures("addon")
def test_photos_pair_with_cameras_by_name(tmp_path):
    for name in ("Front", "Side"):
        made.camera(name)
    for name in ("Side.png", "front.png", "other.png"):
        made.photo(tmp_path / name)
    files = [{"name": item.name} for item in sorted(tmp_path.iterdir())]
    bpy.ops.selenite.load_photos(directory=str(tmp_path), files=files)
    rows = bpy.context.scene.selenite.captures
    pairs = {row.photo.name: row.camera.name if row.camera else None for row in rows}
    assert pairs == {"Side.png": "Side", "front.png": "Front", "other.png": None}


@pytest.mark.usefixtures("addon")
def test_fit_apply_restore_and_save(tmp_path):
    material, settings = prepare_fit(tmp_path)
    before = tuple(made.socket(material, "base_color").default_value)
    assert bpy.ops.selenite.start() == {"FINISHED"}
    assert tuple(made.socket(material, "base_color").default_value) == before  # nothing yet
    assert len(settings.results) == 1 and not settings.applied
    assert bpy.ops.selenite.apply() == {"FINISHED"}
    after = tuple(made.socket(material, "base_color").default_value)
    assert after[:3] == pytest.approx(tuple(settings.results[0].value)) and after != before
    assert bpy.ops.selenite.restore() == {"FINISHED"}
    assert tuple(made.socket(material, "base_color").default_value) == pytest.approx(before)
    settings.output = str(tmp_path / "out")
    assert bpy.ops.selenite.save_result() == {"FINISHED"}
    folder = next((tmp_path / "out").iterdir())
    assert {"result.json", "run.json", "history.csv", "log.txt"} <= {
        item.name for item in folder.iterdir()
    }


@pytest.mark.usefixtures("addon")
def test_apply_is_one_undo_step(tmp_path):
    material, _ = prepare_fit(tmp_path)
    name, before = material.name, tuple(made.socket(material, "base_color").default_value)
    bpy.ops.selenite.start()
    undo_steps.prepare()
    bpy.ops.selenite.apply("EXEC_DEFAULT", True)
    assert tuple(made.socket(material, "base_color").default_value) != before
    undo_steps.undo()
    material = bpy.data.materials[name]  # pointers are stale after an undo
    assert tuple(made.socket(material, "base_color").default_value) == before
    assert not bpy.context.scene.selenite.applied
    undo_steps.redo()
    assert bpy.context.scene.selenite.applied


@pytest.mark.usefixtures("addon")
def test_problems_are_reported_and_nothing_starts(tmp_path):
    _, settings = prepare_fit(tmp_path)
    settings.captures[0].photo = None
    settings.rows[0].learning_rate = 0.5
    with pytest.raises(RuntimeError, match="Camera 'Camera'"):
        bpy.ops.selenite.start()
    assert not state.RUN.is_active


@pytest.mark.usefixtures("addon")
def test_panels_draw_before_during_and_after_a_fit(tmp_path):
    _, settings = prepare_fit(tmp_path, lasting=True)
    assert "captures" in draw(panels.SELENITE_PT_captures)
    for index in range(len(settings.rows)):
        settings.active_row = index
        settings.rows[index].use_start = True
        assert "rows" in draw(panels.SELENITE_PT_parameters)
    assert "selenite.start" not in draw(panels.SELENITE_PT_fit)  # it is in the head
    head = draw(panels.SELENITE_PT_head)
    assert head.count("selenite.start") == 1 and "preset" in head
    assert "tolerance" in draw(panels.SELENITE_PT_advanced)

    from selenite.interface.operators.fit import SELENITE_OT_start as Start

    start = Pressed(Start)
    assert start._start(bpy.context)
    assert "Starting" in draw(panels.SELENITE_PT_fit)
    assert "Esc stops and keeps" in " ".join(draw(panels.SELENITE_PT_head).split())
    until = time.monotonic() + 30
    while time.monotonic() < until:
        if state.RUN.fitting.update().iteration > 0:
            break
        time.sleep(0.02)
    drawn = draw(panels.SELENITE_PT_fit)
    assert "of 4000" in drawn and "Body: Base Color" in drawn and "nan" not in drawn
    head = draw(panels.SELENITE_PT_head)
    assert "selenite.stop" in head and "selenite.cancel" in head and "%, descent" in head
    bpy.ops.selenite.stop()
    assert start._finish(bpy.context) == {"FINISHED"}
    settings.show_report = True
    assert "Body: Base Color red" in draw(panels.SELENITE_PT_result)
    for panel, row, more in (
        (panels.SELENITE_UL_rows, settings.rows[0], ()),
        (panels.SELENITE_UL_captures, settings.captures[0], (0,)),
    ):
        layout = FakeLayout()
        panel.draw_item(None, bpy.context, layout, None, row, 0, None, "", *more)
        assert layout.drawn


@pytest.mark.usefixtures("addon")
def test_cancel_keeps_nothing(tmp_path):
    from selenite.interface.operators.fit import SELENITE_OT_start as Start

    _, settings = prepare_fit(tmp_path, lasting=True)
    start = Pressed(Start)
    assert start._start(bpy.context)
    bpy.ops.selenite.cancel()
    assert start._finish(bpy.context) == {"CANCELLED"}
    assert len(settings.results) == 0 and not state.RUN.is_active


@pytest.mark.usefixtures("addon")
@pytest.mark.parametrize(
    "number",
    [k for k, one in enumerate(state.JOBS) if type(one) in (state.Background, state.Measurement)],
)
def test_one_cancel_ends_whatever_runs(number):
    class Waiting:
        cancelled = False

        def steps(self):
            while not self.cancelled:
                yield Step(0.0, "waiting")
                time.sleep(0.001)

        def cancel(self):
            self.cancelled = True

    background = state.JOBS[number]
    assert not bpy.ops.selenite.cancel.poll()
    job = BackgroundJob(Waiting())
    background.start(job, "Scene")
    try:
        assert bpy.ops.selenite.cancel.poll()
        assert bpy.ops.selenite.stop.poll() == (background is state.TRADE)
        assert bpy.ops.selenite.cancel() == {"FINISHED"}
        assert job.work.cancelled
    finally:
        background.stop()
        job.join()
    assert not bpy.ops.selenite.cancel.poll()


@pytest.mark.usefixtures("addon")
def test_panel_shows_why_the_native_module_is_missing(monkeypatch):
    monkeypatch.setattr(state, "why_native_is_missing", lambda: "The native module does not load")
    drawn = " ".join(draw(panels.SELENITE_PT_captures).split())
    assert "The native module does not load" in drawn and "captures" not in drawn


def test_unregister_stops_a_running_fit(tmp_path):
    from selenite.interface.operators.fit import SELENITE_OT_start as Start

    selenite.register()
    prepare_fit(tmp_path, lasting=True)
    Pressed(Start)._start(bpy.context)
    selenite.unregister()
    assert not state.RUN.is_active


_USED_AND_SWITCHED_OFF = """
import sys, bpy, selenite
selenite.register()
for _ in range(2):
    bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1])
    bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
selenite.unregister()
"""


@pytest.mark.skipif(not bpy.app.version >= (4, 5), reason="older ones crash or need no test")
def test_blender_as_a_module_ends_once_the_addon_was_switched_off(tmp_path):
    """bpy ends in its own way only if nothing of ours holds it any more."""
    command = [sys.executable, "-c", _USED_AND_SWITCHED_OFF, str(tmp_path / "a.blend")]
    done = subprocess.run(command, capture_output=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr.decode()
