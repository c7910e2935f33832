# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles as the judge: its settings, the check in another process, and what it leaves behind."""

import json
import time
from pathlib import Path
from types import SimpleNamespace

import bpy
import made_scenes as made
import numpy as np
import pytest
import undo_steps
from command_line import command

from selenite import native
from selenite.capture.request import CaptureRequest
from selenite.cli import main
from selenite.cycles_check import render as cycles_render
from selenite.cycles_check import render_settings
from selenite.cycles_check.compare import Estimate, judge, misfit
from selenite.cycles_check.job import CheckJob, verdict
from selenite.fit.request import RunRequest
from selenite.fit.settings import FitSettings
from selenite.problems import BadInput
from selenite.scene_read import hosts
from selenite.scene_read.blender_process import ProcessFailed

pytestmark = [pytest.mark.blender, pytest.mark.slow]


def remarks():
    """name -> remark of the open scene."""
    scene = bpy.context.scene
    found = render_settings.remarks(scene, render_settings.contents_of(scene))
    return {item.name: item for item in found}


def snapshot(scene):
    """Every setting of the table and every number of what the scene's render has."""
    values = {}
    for setting in render_settings.SETTINGS:
        values[setting.path] = render_settings._get(scene, setting.path)
    for owner in (scene.render, scene.cycles, scene.view_settings, scene.render.image_settings):
        for name in owner.bl_rna.properties.keys():  # noqa: SIM118 - not a dict
            value = getattr(owner, name, None)
            if isinstance(value, (bool, int, float, str)):
                values[f"{owner.bl_rna.identifier}.{name}"] = value
    values["camera"] = scene.camera.name if scene.camera else None
    values["frame"] = scene.frame_current
    return values


def datablocks():
    """Names of everything in the file."""
    found = {}
    for name in dir(bpy.data):
        blocks = getattr(bpy.data, name)
        if isinstance(blocks, bpy.types.bpy_prop_collection):
            found[name] = sorted(item.name for item in blocks)
    return found


def capture(tmp_path, **settings):
    """Request of a tiny fit of the open scene."""
    photo = made.photo(tmp_path / "Camera.exr", value=0.3)
    given = {"height": 24, "picture_spp": 16} | settings
    return RunRequest("", (), (CaptureRequest("Camera", str(photo)),), FitSettings(**given))


@pytest.mark.blender34
def test_factory_settings_spoil_the_picture_and_are_set():
    made.studio(transmission=1.0)
    bpy.context.scene.render.engine = "CYCLES"
    names = {name for name, item in remarks().items() if item.spoils}
    assert {"Filter Glossy", "Clamp Indirect", "Total Bounces", "Transmission Bounces"} <= names
    assert "Volume Bounces" not in names and "Transparent Bounces" not in names
    changed = render_settings.set_for_fit(bpy.context.scene)
    assert names <= set(changed)
    assert not any(item.spoils for item in remarks().values())
    assert set(remarks()) <= {"Light Threshold", "Pixel Filter", "View Transform"}
    assert render_settings.set_for_fit(bpy.context.scene) == []


@pytest.mark.blender34
def test_settings_are_named_as_blender_shows_them():
    scene = bpy.context.scene
    own = scene.render.bl_rna.properties["engine"].enum_items[0]
    for engine, name in ((own.identifier, own.name), ("BLENDER_WORKBENCH", "Workbench")):
        scene.render.engine = engine
        found = remarks()["Render Engine"]
        assert (found.value, found.wanted) == (name, "Cycles") and "_" not in name
    found = remarks()
    assert found["Pixel Filter"].value == "Blackman-Harris"


@pytest.mark.blender34
def test_volume_bounces_matter_where_there_is_a_medium():
    material = made.studio()
    tree = material.node_tree
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    scatter = tree.nodes.new("ShaderNodeVolumePrincipled")
    tree.links.new(scatter.outputs[0], output.inputs["Volume"])
    assert remarks()["Volume Bounces"].value == "0"
    assert "Transmission Bounces" in remarks()


@pytest.mark.blender34
def test_shadow_offset_is_set_where_cycles_reads_it():
    made.studio()
    body = bpy.data.objects["Body"]
    assert remarks()["Shadow Terminator Geometry Offset"].spoils is False
    render_settings.set_for_fit(bpy.context.scene)
    assert hosts.shadow_terminator(body).shadow_terminator_geometry_offset == 0


@pytest.mark.blender34
def test_random_walk_of_blender_3_becomes_ggx():
    material = made.studio()
    node = made.principled(material)
    node.distribution = "MULTI_GGX"
    found = remarks().get("Distribution")
    assert (found is not None) == hosts.is_version_3()
    render_settings.set_for_fit(bpy.context.scene)
    assert node.distribution == ("GGX" if hosts.is_version_3() else "MULTI_GGX")


@pytest.mark.blender34
def test_comparison_settings_leave_no_remark():
    made.studio()
    render_settings.set_comparison(bpy.context.scene, 8, seed=3)
    assert remarks() == {}
    assert (bpy.context.scene.cycles.samples, bpy.context.scene.cycles.seed) == (8, 3)


@pytest.mark.blender34
def test_a_scene_without_a_layer_for_rendering_is_shown_as_it_is_read(tmp_path):
    """Blender itself ends by a signal where no view layer is used for rendering."""
    made.studio()
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    pictures = []
    for used in (True, False):
        scene.view_layers[0].use = used
        path = tmp_path / "picture.exr"
        pictures.append(cycles_render.render(scene, "Camera", (8, 8), 4, 1, path))
    assert pictures[0].mean() > 0.1
    np.testing.assert_array_equal(*pictures)


def test_check_renders_the_given_values_and_changes_nothing(tmp_path):
    material = made.studio(base_color=(0.8, 0.8, 0.8), roughness=0.5)
    scene = bpy.context.scene
    before, blocks, dirty = snapshot(scene), datablocks(), bpy.data.is_dirty
    job = CheckJob(scene, capture(tmp_path), {("Body", "base_color"): (0.1, 0.2, 0.3)})
    try:
        job.start()
        report = job.result()
        (tmp_path / "result.json").write_text('{"schema": 1}')
        page = job.keep(report, tmp_path)
    finally:
        job.close()
    assert snapshot(scene) == before and datablocks() == blocks and bpy.data.is_dirty == dirty
    assert tuple(made.socket(material, "base_color").default_value)[:3] == pytest.approx((0.8,) * 3)
    assert not job.folder.exists()
    row = report["photos"]["Camera"]
    ours = row["native_against_cycles"]
    # 6 deviations: a false alarm in 1e8 runs; the settings' own floor is 0.5 %
    assert abs(ours["relative_bias"]) < 6 * ours["relative_bias_noise"] + 0.005
    assert 0 < ours["relative_rmse_noise"] < 0.5
    stored = json.loads((tmp_path / "result.json").read_text())
    assert stored["schema"] == 1 and stored["cycles"] == report
    picture = native.image().read(str(tmp_path / "Camera_cycles.exr"))[0]
    assert picture.shape == (24, 32, 3)
    middle = picture[11:13, 15:17].mean(axis=(0, 1))
    assert middle[0] < middle[1] < middle[2] < 0.4  # the values given, not those of the scene
    assert native.image().read(str(page))[0].shape[1] > 5 * 220
    names = {path.name for path in tmp_path.iterdir()}
    assert {f"Camera_{n}.exr" for n in ("cycles", "cycles_sem", "native", "native_sem")} <= names


def test_aligned_photo_is_checked_as_it_was_fitted(tmp_path):
    """A dark triangle before a grey world: its edges show a wrong shift, roll or sign of them."""
    made.triangle(material=made.material(base_color=(0.0, 0.0, 0.0)))
    made.camera(distance=3.0)
    made.world()
    request = capture(tmp_path, picture_spp=64)
    moved = SimpleNamespace(id="Camera", gain=(1.0, 1.0, 1.0), alignment=(4.0, -3.0, 0.3))
    native_pictures, differences = [], []
    for taken in ([], [moved]):
        job = CheckJob(bpy.context.scene, request, {}, taken=taken)
        try:
            job.start()
            row = job.result()["photos"]["Camera"]["native_against_cycles"]
            path = job.folder / "out" / "Camera_native.exr"
            native_pictures.append(native.image().read(str(path))[0])
        finally:
            job.close()
        differences.append(row["relative_rmse_beyond_noise"])
    assert max(differences) < 0.03
    apart = np.sqrt(((native_pictures[1] - native_pictures[0]) ** 2).mean())
    assert apart > 0.2 * native_pictures[0].mean(), "the alignment is seen"


def test_cancelled_check_leaves_nothing(tmp_path):
    made.studio()
    scene = bpy.context.scene
    before, blocks = snapshot(scene), datablocks()
    job = CheckJob(scene, capture(tmp_path, picture_spp=1_000_000), {})
    job.start()
    until = time.monotonic() + 60
    while not job.progress().text.startswith("Selenite") and time.monotonic() < until:
        time.sleep(0.1)
    assert job.progress().running
    job.close()
    job.close()
    assert not job.progress().running and not job.folder.exists()
    assert snapshot(scene) == before and datablocks() == blocks


def test_problems_and_errors_of_the_other_process_arrive(tmp_path):
    made.studio()
    job = CheckJob(bpy.context.scene, capture(tmp_path), {("Body", "gloss"): (1.0,)})
    job.start()
    with pytest.raises(BadInput, match="Body:gloss"):
        job.result()
    job.close()
    job = CheckJob(bpy.context.scene, capture(tmp_path), {})
    (job.folder / "request.json").write_text("no json")
    job.start()
    with pytest.raises(ProcessFailed, match="ended with status"):
        job.result()
    job.close()


def test_unsaved_pixels_are_refused(tmp_path):
    made.environment(made.world(), np.ones((4, 8, 3), np.float32))
    made.sphere(material=made.material())
    made.camera()
    with pytest.raises(BadInput, match="Image 'sky'"):
        CheckJob(bpy.context.scene, capture(tmp_path), {})


def _noisy(mean, deviation, seeds, generator):
    shape = (seeds, 32, 32, 3)
    return Estimate.of_seeds(mean + deviation * generator.standard_normal(shape))


def test_noise_is_told_from_difference():
    """Means of 20 pairs; each bound is more than five deviations away."""
    rows, passed, z = [], 0, []
    for seed in range(20):
        generator = np.random.default_rng(seed)
        first, second = (_noisy(1.0, 0.2, 8, generator) for _ in range(2))
        third = _noisy(1.03, 0.2, 8, generator)
        rows.append([misfit(other, second, np.ones((32, 32))) for other in (first, third)])
        mask = np.ones((32, 32), bool)
        passed += judge(first, second, mask).passed
        z.append(judge(first, second, mask).z_rms)
        assert not judge(third, second, mask).passed
    same = [row[0] for row in rows]
    assert passed == 20 and 0.9 < np.mean(z) < 1.1
    assert np.mean([r["relative_rmse"] for r in same]) == pytest.approx(0.1, rel=0.05)
    assert np.mean([r["relative_rmse_noise"] for r in same]) == pytest.approx(0.1, rel=0.05)
    assert max(r["relative_rmse_beyond_noise"] for r in same) < 0.03
    other = [row[1] for row in rows]
    assert np.mean([r["relative_bias"] for r in other]) == pytest.approx(0.03, rel=0.1)
    rest = np.mean([r["relative_rmse_beyond_noise"] for r in other])
    assert rest == pytest.approx(0.03, rel=0.2)


@pytest.mark.parametrize(
    ("bias", "rmse", "noise", "sentence"),
    [
        (0.0, 0.0, 0.001, "Cycles agrees with the fit"),
        (-0.0099, 0.049, 0.001, "Cycles agrees with the fit"),
        (-0.04, 0.0, 0.001, "Cycles differs from the fit by 4.0 % in 'Side': see its pictures"),
        (0.011, 0.2, 0.001, "Cycles differs from the fit by 20.0 % in 'Side': see its pictures"),
        (0.011, 0.2, 0.19, "Cycles differs from the fit by 20.0 % in 'Side': see its pictures"),
        (0.011, 0.06, 0.065, "Cycles agrees with the fit"),  # of four samples
    ],
)
def test_the_answer_of_a_check_is_one_sentence(bias, rmse, noise, sentence):
    def row(share):
        parts = {"relative_bias": bias, "relative_rmse": rmse}
        found = {f"{name}_beyond_noise": share * value for name, value in parts.items()}
        return {"native_against_cycles": found | {f"{name}_noise": noise for name in parts}}

    assert verdict({"photos": {"Front": row(0.1), "Side": row(1.0)}}) == sentence


@pytest.mark.blender34
@pytest.mark.usefixtures("addon")
def test_operator_writes_into_the_result_folder(tmp_path):
    from test_interface import draw, prepare_fit

    from selenite.interface import panels, state

    material, settings = prepare_fit(tmp_path)
    settings.output = str(tmp_path / "out")
    bpy.ops.selenite.start()
    before, blocks = snapshot(bpy.context.scene), datablocks()
    assert "selenite.check_in_cycles" in draw(panels.SELENITE_PT_cycles)
    assert bpy.ops.selenite.check_in_cycles() == {"FINISHED"}
    assert snapshot(bpy.context.scene) == before and datablocks() == blocks
    folder = state.RUN.done.folder
    report = json.loads((folder / "result.json").read_text())
    assert report["parameters"]["Body:base_color"] and report["cycles"]["photos"]["Camera"]
    assert state.CHECK.sheet == folder / "cycles_check.png" and state.CHECK.sheet.is_file()
    drawn = draw(panels.SELENITE_PT_cycles)
    assert "Selenite against" in drawn and "Filter Glossy: 1" in drawn
    assert "Cycles agrees" in draw(panels.SELENITE_PT_head)
    bpy.ops.selenite.set_cycles()
    assert "Filter Glossy" not in draw(panels.SELENITE_PT_cycles)
    state.RUN.last = None  # as after loading the file again: the rows alone are left
    settings.output = str(tmp_path / "again")
    assert bpy.ops.selenite.check_in_cycles() == {"FINISHED"}
    assert (next(Path(settings.output).iterdir()) / "cycles_check.png").is_file()
    assert material


@pytest.mark.blender34
@pytest.mark.usefixtures("addon")
def test_set_cycles_is_one_undo_step():
    made.studio()
    undo_steps.prepare()
    before = snapshot(bpy.context.scene)
    bpy.ops.selenite.set_cycles("EXEC_DEFAULT", True)
    assert snapshot(bpy.context.scene) != before
    undo_steps.undo()
    assert snapshot(bpy.context.scene) == before


def test_fit_checks_and_sets_cycles_from_the_command_line(tmp_path, capsys):
    made.studio(base_color=(0.8, 0.4, 0.2), transmission=0.5)
    scene = made.save(tmp_path / "scene.blend")
    photo = made.photo(tmp_path / "photo.png")
    words = ["fit", scene, f"--photo=Camera={photo}", "--fit=Body:base_color", "--preset=draft"]
    words += ["--iterations=3", "--height=12", f"--out={tmp_path / 'out'}"]
    assert main([*words, "--set-cycles"]) == 2
    assert "add --save OUT.blend" in capsys.readouterr().err
    saved = tmp_path / "fitted.blend"
    words += [f"--save={saved}", "--set-cycles", "--check-in-cycles"]
    status, report, printed = command(capsys, *words)
    assert status == 0, printed
    assert "Filter Glossy" in report["set_for_cycles"]
    assert "Camera: Cycles against photo: bias" in printed and "wrote" in printed
    stored = json.loads((Path(report["folder"]) / "result.json").read_text())
    assert stored["cycles"] == report["cycles"] and stored["parameters"] == report["parameters"]
    assert not any(item["spoils"] for item in report["cycles"]["render_settings"])
    for path, spoiled in ((scene, True), (saved, False)):
        status, found, _ = command(capsys, "check", str(path))
        assert status == 0
        assert any(item["spoils"] for item in found["render_settings"]) == spoiled
