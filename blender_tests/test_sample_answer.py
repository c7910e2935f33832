# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample scene's answer is right in each generation of Blender, with the photos of its own."""

import json
import sys

import bpy
import pytest
from drawn_panels import draw

from selenite.demo import LIMITS, scenes
from selenite.interface import panels, state
from selenite.messages import unpacked

pytestmark = [pytest.mark.blender, pytest.mark.blender34, pytest.mark.usefixtures("addon")]


@pytest.fixture
def sample():
    """The scene with its dark start."""
    if str(scenes()) not in sys.path:
        sys.path.insert(0, str(scenes()))
    import jade_pendant

    jade_pendant.build(jade_pendant.START)
    bpy.context.view_layer.objects.active = bpy.data.objects["Pendant"]
    return jade_pendant


def load(sample):
    """As a user who chooses all pictures of the sample."""
    files = [{"name": f"{name}.png"} for name in sample.CAMERAS]
    done = bpy.ops.selenite.load_photos(directory=str(sample.PHOTOS), files=files)
    assert done == {"FINISHED"}
    return bpy.context.scene.selenite


def test_each_generation_has_photos_of_its_own(sample):
    first = bpy.app.version < (4, 0, 0)
    assert (sample.PHOTOS.name == "blender_3") == first
    assert {path.stem for path in sample.PHOTOS.glob("*.png")} == set(sample.CAMERAS)
    newer = scenes() / "jade_pendant"
    for name in sample.CAMERAS:
        ours, other = newer / f"{name}.png", newer / "blender_3" / f"{name}.png"
        assert (ours.read_bytes() == other.read_bytes()) is False  # without their bytes in a log


def test_the_answer_is_the_material_of_the_photos(sample, tmp_path):
    settings = load(sample)
    assert [row.camera.name for row in settings.captures] == ["Front", "Side"]
    assert not state.PROBLEMS.get(bpy.context.scene.name)
    ticked = {row.parameter for row in settings.rows if row.enabled}
    assert ticked == set(sample.TRUTH)
    settings.preset, settings.output = "draft", str(tmp_path)
    settings.height = 88  # two thirds of the draft's: half its pixels
    assert bpy.ops.selenite.start() == {"FINISHED"}
    truth = json.loads((scenes() / "jade_pendant" / "truth.json").read_text())["parameters"]
    for row in settings.results:
        wanted = truth[row.parameter]
        wanted = wanted if isinstance(wanted, list) else [wanted]
        found = list(row.value[: row.width])
        assert found == pytest.approx(wanted, abs=LIMITS[row.parameter]), row.parameter
        assert row.sureness == "SURE", row.parameter
    assert unpacked(settings.verdict)[0].startswith("Good match"), settings.verdict
    assert not settings.is_wrong and "selenite.apply" in draw(panels.SELENITE_PT_head)
    assert bpy.ops.selenite.apply() == {"FINISHED"}
    assert "selenite.check_in_cycles" in draw(panels.SELENITE_PT_head)


def test_swapped_photos_are_named_at_loading_and_a_button_swaps_them(sample, tmp_path):
    names = {"Front": "Side", "Side": "Front"}
    for name, other in names.items():
        (tmp_path / f"{name}.png").write_bytes((sample.PHOTOS / f"{other}.png").read_bytes())
    assert bpy.ops.selenite.load_photos(directory=str(tmp_path)) == {"FINISHED"}
    (problem,) = state.PROBLEMS[bpy.context.scene.name]
    assert problem.object == "Photos 'Front', 'Side'"
    assert "'Front' like camera 'Side'; 'Side' like camera 'Front'" in problem.cause
    assert "selenite.pair_photos" in draw(panels.SELENITE_PT_head)
    assert bpy.ops.selenite.pair_photos() == {"FINISHED"}
    rows = bpy.context.scene.selenite.captures
    assert [(row.photo.name, row.camera.name) for row in rows] == [
        ("Front.png", "Side"),
        ("Side.png", "Front"),
    ]
    assert "selenite.pair_photos" not in draw(panels.SELENITE_PT_head)


def test_photos_of_another_shape_are_named_and_a_button_sets_the_resolution(sample):
    render = bpy.context.scene.render
    render.resolution_x = render.resolution_y = 512
    load(sample)
    (found,) = state.PROBLEMS[bpy.context.scene.name]
    assert "2 of 2 have not the shape" in found.cause and "768 x 512" in found.cause
    head = " ".join(draw(panels.SELENITE_PT_head).split())
    assert "selenite.set_resolution" in head and "press Set Resolution, or give" in head
    assert bpy.ops.selenite.set_resolution() == {"FINISHED"}
    assert (render.resolution_x, render.resolution_y) == (768, 512)
    assert not state.PROBLEMS[bpy.context.scene.name]
    render.resolution_x = 512
    load(sample)
    render.resolution_x = 768
    load(sample)  # what is right now is not a problem any more
    assert not state.PROBLEMS[bpy.context.scene.name]


def test_a_scene_without_light_is_named_at_loading(sample):
    bpy.data.objects.remove(bpy.data.objects["Key"])
    bpy.context.scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0
    load(sample)
    (problem,) = state.PROBLEMS[bpy.context.scene.name]
    assert problem.object == "Scene" and "gives light" in problem.cause
    assert "selenite.light_world" in draw(panels.SELENITE_PT_head)
    assert bpy.ops.selenite.light_world() == {"FINISHED"}
    assert not state.PROBLEMS[bpy.context.scene.name]
    inputs = bpy.context.scene.world.node_tree.nodes["Background"].inputs
    assert inputs["Strength"].default_value == 1.0
    assert tuple(inputs["Color"].default_value) == (0.5, 0.5, 0.5, 1.0)


def test_a_folder_without_such_photos_is_no_silence(sample, tmp_path):
    (tmp_path / "Other.png").write_bytes((sample.PHOTOS / "Front.png").read_bytes())
    assert bpy.ops.selenite.load_photos(directory=str(tmp_path)) == {"CANCELLED"}
    assert not len(bpy.context.scene.selenite.captures)


def test_another_file_begins_without_what_was_said_of_the_one_before(sample, tmp_path):
    bpy.data.objects.remove(bpy.data.objects["Key"])
    bpy.context.scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0
    load(sample)
    state.CHECK.message, state.RUN.message = "Cycles agrees with the fit", "Done"
    assert "gives light" in draw(panels.SELENITE_PT_head).replace("\n", " ")
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    assert not state.PROBLEMS and not state.SHAPES and not state.CHECK.message
    drawn = draw(panels.SELENITE_PT_head)
    assert "light" not in drawn and "Done" not in drawn


def test_another_job_keeps_the_sample_scene_closed_and_is_named(monkeypatch):
    monkeypatch.setattr(state.SAVE, "job", object())
    with pytest.raises(RuntimeError, match="A fit or a check is running"):
        bpy.ops.selenite.open_sample()
    assert "Pendant" not in bpy.data.objects
