# SPDX-License-Identifier: GPL-3.0-or-later
"""What a new user meets: photos, problems, folders, presets, and the result folder."""

import time
from pathlib import Path

import bmesh
import bpy
import made_scenes as made
import pytest
from drawn_panels import draw
from pressed_buttons import TIMER, Pressed
from test_interface import prepare_fit

from selenite import paths
from selenite.interface import panels, properties, state
from selenite.interface.furniture import links
from selenite.interface.furniture.preferences import Defaults, preferences
from selenite.interface.operators import presets
from selenite.interface.output_folder import DEFAULT_FOLDER, output_folder
from selenite.interface.problem_reports import thing_of
from selenite.interface.request import FIT_SETTINGS
from selenite.messages import unpacked

pytestmark = [pytest.mark.blender, pytest.mark.blender34, pytest.mark.usefixtures("addon")]


def photos(tmp_path, *names):
    folder = tmp_path / "photos"
    folder.mkdir()
    for name in names:
        made.photo(folder / f"{name}.png")
    return {"directory": str(folder), "files": [{"name": f"{name}.png"} for name in names]}


def test_loading_photos_lists_and_ticks_what_is_usual_once(tmp_path):
    made.studio()
    settings = bpy.context.scene.selenite
    chosen = photos(tmp_path, "Camera")
    bpy.ops.selenite.load_photos(**chosen)
    ticked = {row.parameter for row in settings.rows if row.enabled}
    assert ticked == {"base_color", "roughness", "transmission", "ior"}
    bpy.ops.selenite.untick()
    bpy.ops.selenite.load_photos(**chosen)
    assert not any(row.enabled for row in settings.rows)  # the user's own ticks stay
    assert len(settings.captures) == 1


def test_all_problems_stay_in_the_head_in_the_words_of_the_panel(tmp_path):
    _, settings = prepare_fit(tmp_path)
    settings.captures[0].photo = None
    settings.spp = 1_000_000_000
    with pytest.raises(RuntimeError, match="Camera 'Camera'") as error:
        bpy.ops.selenite.start()
    assert "--photo" not in str(error.value)
    drawn = " ".join(draw(panels.SELENITE_PT_head).split())
    assert "Camera 'Camera'" in drawn and "choose a photo or remove the row" in drawn
    assert "selenite.select_problem" in drawn and "--" not in drawn
    for item in bpy.context.view_layer.objects:
        item.select_set(False)
    assert bpy.ops.selenite.select_problem(kind="camera", name="Camera") == {"FINISHED"}
    assert [item.name for item in bpy.context.selected_objects] == ["Camera"]
    assert bpy.ops.selenite.clear_problems() == {"FINISHED"}
    assert "Camera 'Camera'" not in draw(panels.SELENITE_PT_head)


def test_a_body_with_a_hole_is_named_once_with_a_button_that_fills_it(tmp_path):
    made.smoke()
    scratch = bmesh.new()
    body = bpy.data.objects["Body"]
    scratch.from_mesh(body.data)
    scratch.faces.ensure_lookup_table()
    bmesh.ops.delete(scratch, geom=[scratch.faces[20]], context="FACES_ONLY")
    scratch.to_mesh(body.data)
    scratch.free()
    bpy.ops.selenite.load_photos(**photos(tmp_path, "Camera"))
    settings = bpy.context.scene.selenite
    next(row for row in settings.rows if row.parameter == "extinction").enabled = True
    with pytest.raises(RuntimeError, match="no definite inside"):
        bpy.ops.selenite.start()
    head = draw(panels.SELENITE_PT_head)
    assert head.count("selenite.close_body") == 1
    assert "no definite" not in draw(panels.SELENITE_PT_parameters).replace("\n", " ")
    assert bpy.ops.selenite.close_body(name="Body") == {"FINISHED"}
    assert "selenite.close_body" not in draw(panels.SELENITE_PT_head)
    edges = {tuple(sorted(edge)) for face in body.data.polygons for edge in face.edge_keys}
    assert len(body.data.polygons) > 120 and len(edges) == len(body.data.edges)


def test_what_cannot_be_read_is_the_only_problem_where_nothing_can_be_ticked(tmp_path):
    material = made.studio()
    tree = material.node_tree
    hair = tree.nodes.new("ShaderNodeBsdfHair")
    tree.links.new(hair.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    bpy.ops.selenite.load_photos(**photos(tmp_path, "Camera"))
    settings = bpy.context.scene.selenite
    for row in settings.rows:
        row.enabled = False
    with pytest.raises(RuntimeError) as error:
        bpy.ops.selenite.start()
    assert "Body" in str(error.value) and "no parameter is ticked" not in str(error.value)


def test_the_rate_is_shown_where_adam_steps():
    made.studio()
    assert bpy.ops.selenite.refresh_rows() == {"FINISHED"}
    settings = bpy.context.scene.selenite
    settings.active_row = next(
        at for at, row in enumerate(settings.rows) if row.parameter == "roughness"
    )
    shown = {}
    for optimiser in ("auto", "gauss-newton", "adam"):
        settings.optimiser = optimiser
        shown[optimiser] = "learning_rate" in draw(panels.SELENITE_PT_parameters)
    assert shown == {"auto": False, "gauss-newton": False, "adam": True}
    settings.optimiser = "auto"
    next(row for row in settings.rows if row.parameter == "base_color_texture").enabled = True
    assert "learning_rate" in draw(panels.SELENITE_PT_parameters)


def test_a_wrong_result_offers_to_compare_and_no_apply(tmp_path):
    _, settings = prepare_fit(tmp_path)  # a grey photo of a lit ball: nothing explains it
    assert bpy.ops.selenite.start() == {"FINISHED"}
    assert settings.is_wrong and unpacked(settings.verdict)[0].startswith("Wrong camera or light?")
    head = draw(panels.SELENITE_PT_head)
    assert "selenite.compare_pictures" in head and "selenite.apply" not in head
    (row,) = settings.results
    assert row.sureness in ("WEAK", "OPEN")
    assert tuple(row.swatch) == pytest.approx(tuple(row.value))
    row.swatch = (0.9, 0.9, 0.9)  # as by its colour picker
    assert tuple(row.swatch) == pytest.approx(tuple(row.value))


def test_things_that_problems_name():
    made.studio()
    assert thing_of("material", "Body") == bpy.data.materials["Body"]
    assert thing_of("parameter", "Body:ior") == bpy.data.materials["Body"]
    assert thing_of("camera", "Camera") == bpy.data.objects["Camera"]
    assert thing_of("", "") is None and thing_of("material", "None such") is None
    assert bpy.ops.selenite.select_problem(kind="material", name="Body") == {"FINISHED"}
    assert bpy.context.view_layer.objects.active.active_material == bpy.data.materials["Body"]


def test_results_of_an_unsaved_file_go_to_the_users_folder(tmp_path, monkeypatch):
    made.studio()
    scene = bpy.context.scene
    monkeypatch.setattr(paths, "user_folder", lambda: tmp_path / "Documents")
    monkeypatch.setattr("selenite.interface.output_folder.user_folder", paths.user_folder)
    assert scene.selenite.output == DEFAULT_FOLDER and not bpy.data.filepath
    assert output_folder(scene) == tmp_path / "Documents" / "selenite-fits"
    scene.selenite.output = str(tmp_path / "own")
    assert output_folder(scene) == tmp_path / "own"
    made.save(tmp_path / "saved.blend")
    scene = bpy.context.scene
    scene.selenite.property_unset("output")
    assert output_folder(scene) == tmp_path / "selenite-fits"


def test_preferences_apply_where_the_scene_says_nothing(monkeypatch):
    from selenite.interface import request

    assert preferences() == Defaults()
    scene = bpy.context.scene
    monkeypatch.setattr(request, "preferences", lambda: Defaults(threads=3))
    assert request.fit_settings(scene).threads == 3
    scene.selenite.threads = 2
    assert request.fit_settings(scene).threads == 2


def test_presets_hold_every_setting_of_a_fit():
    kept = {text.partition(".")[2] for text in presets.SELENITE_OT_add_preset.preset_values}
    assert kept == {*FIT_SETTINGS, "stage_mode"}
    for name in kept:
        assert name in properties.SeleniteSettings.bl_rna.properties


def test_a_bug_report_names_versions():
    text = links.bug_report()
    assert "Selenite " in text and bpy.app.version_string in text


def test_photos_are_read_in_a_thread_and_cancel_leaves_nothing(tmp_path):
    from selenite.advice.information.job import BackgroundJob
    from selenite.interface.operators import fit as fit_operators
    from selenite.interface.running.run import PreparingPhase
    from selenite.scene_read.reading.render_depsgraph import at_once

    prepare_fit(tmp_path)
    start, scene = Pressed(fit_operators.SELENITE_OT_start), bpy.context.scene

    def begun():
        job = BackgroundJob(at_once(fit_operators._asking(scene, "")))
        state.RUN.begin(PreparingPhase(job, scene.name))
        return job

    begun()
    assert "Esc cancels" in draw(panels.SELENITE_PT_head)
    assert not bpy.ops.selenite.start.poll()
    assert bpy.ops.selenite.cancel() == {"FINISHED"}
    assert not state.RUN.is_active and start.modal(bpy.context, TIMER) == {"CANCELLED"}
    assert not len(bpy.context.scene.selenite.results)

    assert begun().wait(60.0)
    assert start.modal(bpy.context, TIMER) == {"PASS_THROUGH"}
    assert state.RUN.fitting is not None
    bpy.ops.selenite.cancel()
    assert start._finish(bpy.context) == {"CANCELLED"}


def test_a_result_is_saved_in_a_thread(tmp_path):
    from selenite.interface.operators.stop import SELENITE_OT_save_result as Save

    _, settings = prepare_fit(tmp_path)
    settings.output = str(tmp_path / "out")
    assert bpy.ops.selenite.start() == {"FINISHED"}
    save = Pressed(Save)
    assert save._start(bpy.context)
    assert not bpy.ops.selenite.start.poll()
    until = time.monotonic() + 60
    while save.modal(bpy.context, TIMER) == {"PASS_THROUGH"} and time.monotonic() < until:
        time.sleep(0.02)
    (folder,) = (tmp_path / "out").iterdir()
    assert (folder / "Camera_optimised.png").is_file()
    assert folder == Path(state.RUN.done.folder) and state.SAVE.job is None


def test_cancel_ends_at_once_and_brings_the_result_before_back(tmp_path):
    from selenite.interface.operators.fit import SELENITE_OT_start as Start

    _, settings = prepare_fit(tmp_path)
    settings.output = str(tmp_path / "out")
    assert bpy.ops.selenite.start() == {"FINISHED"}
    done, value = state.RUN.done, tuple(settings.results[0].value)
    settings.iterations, settings.loss = 4000, "mae"
    start = Pressed(Start)
    assert start._start(bpy.context) and state.RUN.done is None
    assert bpy.ops.selenite.cancel() == {"FINISHED"}
    assert not state.RUN.is_active and state.RUN.done is done
    assert start.modal(bpy.context, TIMER) == {"CANCELLED"}
    assert tuple(settings.results[0].value) == value
    assert "nothing was changed" in " ".join(draw(panels.SELENITE_PT_head).split())
    assert bpy.ops.selenite.save_result.poll()


def test_a_result_says_how_sure_it_is(tmp_path):
    _, settings = prepare_fit(tmp_path)
    assert bpy.ops.selenite.start() == {"FINISHED"}
    assert settings.verdict and settings.report
    (row,) = settings.results
    assert row.sureness in {"SURE", "WEAK", "OPEN", "UNKNOWN"}
    drawn = " ".join(draw(panels.SELENITE_PT_result).split())
    assert unpacked(settings.verdict)[0].split(":")[0][:20] in drawn
    assert "\u00b1" in drawn or row.sureness in {"OPEN", "UNKNOWN"}
    assert "Body: Base Color red" not in drawn  # the whole report is behind a triangle
    settings.show_report = True
    drawn = draw(panels.SELENITE_PT_result)
    assert drawn.count("Body: Base Color red") == 1 and drawn.count("\u2192") == 3


def test_another_blender_can_import_the_add_on_for_the_sample():
    from selenite.interface.furniture import sample

    assert (sample._importable() / "selenite" / "__init__.py").is_file()
