# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of a fit: in result folders, Image Editors, through a camera; aligned renders."""

import json
import time
from pathlib import Path

import bpy
import made_scenes as made
import numpy as np
import pytest
import recording_fit
import undo_steps
from command_line import command
from drawn_panels import draw
from pressed_buttons import Pressed

from selenite import native
from selenite.interface import state
from selenite.interface.pictures import images, panel
from selenite.interface.pictures import view as view_module
from selenite.interface.pictures.view import VIEW, LiveView
from selenite.interface.pictures.view_through import is_through
from selenite.report.pictures.comparison import OUTSIDE, SHOWN_OUTSIDE
from selenite.report.pictures.moments import RESULT, START, Moment, Moments
from selenite.scene_read import blender_process
from selenite.scene_read.build import build
from selenite.scene_read.scene import read_scene

pytestmark = pytest.mark.blender
SHIFT = (1.5, -0.75, 0.02)


def half_masked(tmp_path):
    """A photo's mask: black on the left half."""
    mask = np.ones((24, 32, 3), np.float32)
    mask[:, :16] = 0
    native.image().write_png(str(tmp_path / "mask.png"), mask)
    return tmp_path / "mask.png"


@pytest.fixture
def aligned(tmp_path, capsys, monkeypatch):
    """(what was recorded, folder) of a fit that has found a shift of its masked photo."""
    made.studio(roughness=0.5)
    photo = made.photo(tmp_path / "photo.exr", value=0.25)
    captures = {"camera": "Camera", "photo": str(photo), "mask": str(half_masked(tmp_path)),
                "align": True}  # fmt: skip
    listed = tmp_path / "captures.json"
    listed.write_text(json.dumps({"schema": 1, "captures": [captures]}))
    scene = made.save(tmp_path / "scene.blend")
    recorded = recording_fit.install(monkeypatch)
    shifted = {"Camera": {"residual_rms": 0.1, "shift": SHIFT}}
    monkeypatch.setattr(recording_fit.RecordingFit, "captures", shifted)
    status, report, printed = command(
        capsys, "fit", scene, f"--captures={listed}", "--fit=Body:roughness", "--height=24",
        "--picture-spp=4", f"--out={tmp_path / 'fits'}",
    )  # fmt: skip
    assert status == 0, printed
    return recorded, Path(report["folder"]), scene


def test_every_result_folder_has_contact_sheet_and_plots(aligned):
    _, folder, _ = aligned
    sheet = native.image().read(str(folder / "contact_sheet.png"))[0]
    assert sheet.shape[0] > 220 and sheet.shape[1] > 5 * 220
    plots = native.image().read(str(folder / "plots.png"))[0]
    assert plots.shape[1] == 800
    for picture in (sheet, plots):
        assert picture.std() > 0.05, "something is drawn"


def test_result_pictures_mark_what_does_not_count(aligned):
    _, folder, _ = aligned
    read = native.image().read
    error, photo = (read(str(folder / f"Camera_{name}.exr"))[0] for name in ("error", "reference"))
    assert not error[:, :16].any() and error[:, 18:].any()
    wanted = np.array(OUTSIDE) + SHOWN_OUTSIDE * 0.25
    for name in ("error", "reference"):
        shown = read(str(folder / f"Camera_{name}.png"))[0]
        assert shown[5, 5] == pytest.approx(wanted, abs=0.02), name
    assert not photo[:, :16].any(), "OpenEXR holds data, not marks"


def test_result_pictures_have_the_fitted_alignment(aligned):
    recorded, folder, _ = aligned
    of_results = [item for item in recorded.pictures if item.spp in (1, 4)]
    assert [item.spp for item in of_results] == [1, 4]  # of the start, of the result
    assert [item.alignment for item in of_results] == [SHIFT, SHIFT]
    stored = json.loads((folder / "result.json").read_text())["captures"]["Camera"]["shift"]
    assert stored == pytest.approx([1.5, -0.75, np.degrees(0.02)])


def test_render_of_a_capture_has_the_alignment_of_its_fit(aligned, capsys, tmp_path):
    recorded, folder, scene = aligned
    words = ["render", scene, f"--captures={folder}", "--spp=2", f"--out={tmp_path / 'r.exr'}"]
    status, report, printed = command(capsys, *words)
    assert status == 0, printed
    assert recorded.pictures[-1].alignment == pytest.approx(SHIFT)
    assert report["alignment"] == pytest.approx(SHIFT)
    assert "moved by 1.50 and -0.75 pixels" in printed
    listed = tmp_path / "captures.json"
    words[2] = f"--captures={listed}"
    _, report, _ = command(capsys, *words)
    assert report["alignment"] == [0, 0, 0], "a list of photos knows of no fit"
    _, report, _ = command(capsys, *words, f"--result={folder}")
    assert report["alignment"] == pytest.approx(SHIFT)


def test_aligned_render_is_that_of_a_camera_that_moved():
    """Six pixels to the right: what was there is six pixels to the left. Noise of 256 samples."""
    made.studio(base_color=(0.9, 0.2, 0.1))
    bpy.context.view_layer.update()
    scene = build(read_scene(bpy.context.scene))

    def picture(alignment):
        photo = native.core().Photo("Camera", size=(32, 24), alignment=alignment)
        return native.core().Evaluator(scene).picture(photo, 256, seed=3).image

    plain, moved = picture((0, 0, 0)), picture((6, 0, 0))
    assert np.abs(moved[:, :26] - plain[:, 6:]).mean() < 0.01
    assert np.abs(moved - plain).mean() > 0.03
    down = picture((0, 4, 0))
    assert np.abs(down[:20] - plain[4:]).mean() < 0.01


def prepare(tmp_path):
    """A scene with a masked photo, base colour ticked; returns its settings."""
    made.studio(base_color=(0.2, 0.5, 0.8), roughness=0.5)
    path = made.photo(tmp_path / "Camera.png", value=0.2)
    settings = bpy.context.scene.selenite
    bpy.ops.selenite.refresh_rows()
    bpy.ops.selenite.add_capture()
    settings.captures[0].photo = bpy.data.images.load(str(path))
    settings.captures[0].mask_path = str(half_masked(tmp_path))
    row = next(item for item in settings.rows if item.parameter == "base_color")
    row.enabled = True
    settings.height, settings.iterations, settings.tolerance = 24, 6, 0.0
    settings.picture_spp, settings.search = 4, "off"
    return settings


@pytest.fixture
def editor():
    """An Image Editor of the window that bpy has."""
    area = bpy.context.window_manager.windows[0].screen.areas[0]
    former = area.type
    area.type = "IMAGE_EDITOR"
    yield area
    area.type = former


def pixels(name):
    """Of one of our images, row 0 at the top."""
    image = bpy.data.images[name]
    found = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(found)
    return found.reshape(image.size[1], image.size[0], 4)[::-1, :, :3]


def drawn(seconds=60):
    """Calls the view as its timer does, until nothing is left to render."""
    until = time.monotonic() + seconds
    VIEW.update()
    while VIEW.renderer.busy and time.monotonic() < until:
        time.sleep(0.01)
        VIEW.update()
    VIEW.update()
    assert not VIEW.renderer.busy and not VIEW.renderer.trouble


@pytest.mark.usefixtures("addon")
def test_running_fit_is_shown_and_plotted(tmp_path, editor):
    from selenite.interface.operators.fit import SELENITE_OT_start as Start

    settings = prepare(tmp_path)
    settings.iterations, settings.loss = 4000, "mae"
    start = Pressed(Start)
    assert start._start(bpy.context)
    VIEW.open(editor, images.COMPARISON)
    until = time.monotonic() + 60
    while (
        state.RUN.fitting.job.preview(0) is None or state.RUN.fitting.job.progress().iteration < 3
    ):
        assert time.monotonic() < until
        time.sleep(0.01)
    state.RUN.fitting.progress = state.RUN.fitting.job.progress()
    assert VIEW.update(), "there is more to come"
    first = pixels(images.COMPARISON).copy()
    assert first.std() > 0.05 and VIEW.drawings == 1
    VIEW.update()
    assert VIEW.drawings == 1, "not at every tick"
    bpy.context.window_manager.selenite_pictures.mode = "DIFFERENCE"  # is shown at once
    VIEW.update()
    assert VIEW.drawings == 2
    assert np.abs(pixels(images.COMPARISON) - first).mean() > 0.01
    VIEW.open(editor, images.PLOTS)
    VIEW.update()
    assert pixels(images.PLOTS).std() > 0.05
    bpy.ops.selenite.cancel()
    assert start._finish(bpy.context) == {"CANCELLED"}


@pytest.mark.usefixtures("addon")
def test_fit_that_has_ended_shows_start_fit_and_each_iteration(tmp_path, editor):
    prepare(tmp_path)
    assert bpy.ops.selenite.start("EXEC_DEFAULT") == {"FINISHED"}
    chosen = bpy.context.window_manager.selenite_pictures
    chosen.mode, chosen.moment = "RENDER", "RESULT"
    VIEW.open(editor, images.COMPARISON)
    drawn()
    seen = {"RESULT": pixels(images.COMPARISON).copy()}
    for moment, place in (("START", 0.0), ("ITERATION", 0.0), ("ITERATION", 50.0)):
        chosen.moment, chosen.timeline = moment, place
        drawn()
        seen[moment, place] = pixels(images.COMPARISON).copy()
        text = draw(panel.SELENITE_PT_pictures)
        assert ("timeline" in text) == (moment == "ITERATION")
    assert "Iteration 3 of 6" in text
    assert np.abs(seen["RESULT"] - seen["START", 0.0]).mean() > 0.01
    # The values of iteration 0 are the start's; titles and random numbers differ.
    part = np.s_[60:300, 220:420]
    start, first = seen["START", 0.0][part], seen["ITERATION", 0.0][part]
    assert np.abs(start - first).mean() < 0.02
    chosen.content = "SHEET"
    drawn()
    assert pixels(images.SHEET).std() > 0.05
    chosen.content, chosen.mode = "COMPARISON", "WIPE"


@pytest.mark.usefixtures("addon")
def test_moments_have_the_values_of_their_iteration(tmp_path):
    prepare(tmp_path)
    assert bpy.ops.selenite.start("EXEC_DEFAULT") == {"FINISHED"}
    moments = Moments(state.RUN.plan, state.RUN.done.result)
    history = state.RUN.done.result.fit.history.values["Body:base_color"]
    for row in range(len(history)):
        found = moments.scene(row).get("Body", "base_color")
        assert found == pytest.approx(history[row], abs=1e-6)
    assert moments.scene(START).get("Body", "base_color") == pytest.approx((0.2, 0.5, 0.8))
    best = state.RUN.done.result.fit.values_best["Body:base_color"]
    assert moments.scene(RESULT).get("Body", "base_color") == pytest.approx(np.ravel(best))
    picture = moments.render(Moment(0, 1))
    assert picture.shape == (24, 32, 3)
    assert moments.kept(Moment(0, 1)) is picture


@pytest.mark.usefixtures("addon")
def test_drawn_images_stay_out_of_files_and_out_of_the_check(tmp_path, editor):
    prepare(tmp_path)
    assert bpy.ops.selenite.start("EXEC_DEFAULT") == {"FINISHED"}
    VIEW.open(editor, images.COMPARISON)
    drawn()
    image = bpy.data.images[images.COMPARISON]
    assert image.is_dirty and image.users > 0
    assert not [item for item in blender_process._unsaved_pictures() if "Selenite" in item.title]
    path = tmp_path / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    with bpy.data.libraries.load(str(path)) as (there, _):
        assert not set(there.images) & set(images.NAMES.values())
    drawn()
    assert images.image_of(editor).name == images.COMPARISON
    editor.spaces.active.image = bpy.data.images["Camera.png"]
    VIEW.update()
    assert not VIEW.areas, "the user's choice stays"


@pytest.mark.usefixtures("addon")
def test_view_through_a_camera_is_undone_by_a_second_click_and_by_undo(tmp_path):
    prepare(tmp_path)
    other = made.camera("Other")
    scene = bpy.context.scene
    scene.camera = other
    background = bpy.data.objects["Camera"].data.background_images[0]
    background.alpha = 0.9
    before = (background.alpha, background.display_depth, background.frame_method)
    assert not is_through(scene)
    assert bpy.ops.selenite.view_through() == {"FINISHED"}
    assert scene.camera.name == "Camera"
    assert (background.alpha, background.display_depth) == (0.5, "FRONT")
    assert is_through(scene) and "view_through" in draw(panel.SELENITE_PT_pictures)
    assert bpy.ops.selenite.view_through() == {"FINISHED"}
    assert scene.camera == other
    assert (background.alpha, background.display_depth, background.frame_method) == before

    undo_steps.prepare()
    bpy.ops.selenite.view_through("EXEC_DEFAULT", True)
    undo_steps.undo()
    background = bpy.data.objects["Camera"].data.background_images[0]
    assert (background.alpha, background.display_depth, background.frame_method) == before
    assert bpy.context.scene.camera.name == "Other"
    assert not is_through(bpy.context.scene)


@pytest.mark.usefixtures("addon")
def test_new_fit_ends_the_render_of_the_last_one(tmp_path, editor):
    settings = prepare(tmp_path)
    assert bpy.ops.selenite.start("EXEC_DEFAULT") == {"FINISHED"}
    settings.picture_spp = 1_000_000
    VIEW.open(editor, images.COMPARISON)
    plan = state.RUN.plan
    object.__setattr__(plan.request.settings, "picture_spp", 1_000_000)
    VIEW.update()
    assert VIEW.renderer.busy
    settings.picture_spp = 4
    assert bpy.ops.selenite.start("EXEC_DEFAULT") == {"FINISHED"}
    assert not VIEW.renderer.busy


def test_a_slow_display_gets_fewer_pictures(monkeypatch):
    """A tick that comes 2 s late after a picture puts the next one off by 20 times as long."""
    view = LiveView()
    view._drawn = {images.PLOTS: 100.0}
    monkeypatch.setattr(view_module.time, "monotonic", lambda: 102.0 + view_module.TICK)
    view._count_redraw()
    assert view._due[images.PLOTS] == pytest.approx(102.0 + view_module.TICK + 40.0)
    assert not view._is_due(images.PLOTS) and not view._drawn
    assert view._is_due(images.COMPARISON)
