# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel's stages: presets, an own list from ticks and from a file, drawn and run."""

import json

import bpy
import made_scenes as made
import pytest
from pressed_buttons import Pressed
from test_interface import FakeLayout, draw, prepare_fit

from selenite.fit.staging.request import PRESETS
from selenite.interface import panels, properties, request, stages, state
from selenite.problems import BadInput

pytestmark = [pytest.mark.blender, pytest.mark.blender34, pytest.mark.usefixtures("addon")]


def tick(settings, *names):
    """Ticks exactly these parameters."""
    for row in settings.rows:
        row.enabled = row.parameter in names


def asked():
    """(stages of the request, problems)."""
    try:
        return request.run_request(bpy.context.scene, made.read()).stages, []
    except BadInput as error:
        return (), error.problems


def test_presets_of_the_panel_are_those_of_the_command_line():
    named = [item[0] for item in properties.STAGE_ITEMS]
    assert named == [*PRESETS, "own"]
    # Files keep the numbers: a new one follows the last.
    assert [item[3] for item in properties.STAGE_ITEMS] == [6, 0, 1, 2, 5, 3]


def test_a_file_whose_stages_are_gone_has_the_usual_ones(tmp_path):
    """4 was a choice of earlier versions; Blender has no name for it."""
    _, settings = prepare_fit(tmp_path)
    tick(settings, "base_color", "ior")
    settings["stage_mode"] = 4
    assert settings.stage_mode == "" and asked() == ((), [])


def test_the_panel_begins_with_the_stages_of_the_command_line():
    """Where nobody chooses, `--stages` is "usual"."""
    assert bpy.context.scene.selenite.stage_mode == "usual"


def test_a_preset_splits_the_ticked_parameters(tmp_path):
    _, settings = prepare_fit(tmp_path, iterations=40)
    tick(settings, "base_color", "ior")
    assert asked() == ((), [])
    settings.stage_mode = "ior-last"
    found, problems = asked()
    assert not problems
    assert [item.parameters for item in found] == [
        ("Body:base_color",),
        ("Body:base_color", "Body:ior"),
    ]
    tick(settings, "base_color")
    assert "no index of refraction is fitted" in asked()[1][0].line()


def test_an_own_list_is_built_from_ticks_and_runs(tmp_path):
    _, settings = prepare_fit(tmp_path, iterations=4)
    settings.stage_mode = "own"
    assert "own list is empty" in asked()[1][0].line()
    bpy.ops.selenite.add_stage()
    tick(settings, "roughness")
    bpy.ops.selenite.add_stage()
    tick(settings, "roughness", "base_color")
    bpy.ops.selenite.take_ticked()
    tick(settings)
    with pytest.raises(RuntimeError, match="No parameter is ticked"):
        bpy.ops.selenite.add_stage()
    settings.stages[0].iterations, settings.stages[0].name = 3, "colour"
    drawn = draw(stages.SELENITE_PT_stages)
    assert "Body: Roughness" in drawn and "selenite.take_ticked" in drawn and "own_height" in drawn
    found, problems = asked()
    assert not problems
    assert [(item.name, item.iterations) for item in found] == [("colour", 3), ("stage 2", None)]
    assert bpy.ops.selenite.start() == {"FINISHED"}
    assert [row.parameter for row in settings.results] == ["base_color", "roughness"]
    assert [item.iterations for item in state.RUN.done.result.fit.stages] == [3, 4]


def test_a_stage_shows_numbers_of_its_own_only(tmp_path):
    _, settings = prepare_fit(tmp_path, iterations=40)
    settings.stage_mode = "own"
    bpy.ops.selenite.add_stage()
    (stage,) = settings.stages
    names = ("iterations", "spp", "height")
    drawn = draw(stages.SELENITE_PT_stages).splitlines()
    assert drawn.count("As in the fit") == len(names) and not set(names) & set(drawn)
    stage.own_iterations = True
    assert stage.iterations == 40 and stage.own_iterations
    drawn = draw(stages.SELENITE_PT_stages).splitlines()
    assert "iterations" in drawn and drawn.count("As in the fit") == 2
    stage.iterations = 7
    stage.own_iterations = True  # it has one: nothing changes
    assert asked()[0][0].iterations == 7
    stage.own_iterations = False
    assert asked()[0][0].iterations is None


def test_the_list_can_be_ordered_and_emptied(tmp_path):
    _, settings = prepare_fit(tmp_path)
    bpy.ops.selenite.add_stage()
    bpy.ops.selenite.add_stage()
    bpy.ops.selenite.move_stage(direction="UP")
    bpy.ops.selenite.move_stage(direction="UP")
    assert [item.name for item in settings.stages] == ["stage 2", "stage 1"]
    bpy.ops.selenite.remove_stage()
    bpy.ops.selenite.remove_stage()
    assert not len(settings.stages) and not stages.SELENITE_OT_remove_stage.poll(bpy.context)


def test_a_file_fills_the_list_and_a_bad_one_changes_nothing(tmp_path):
    _, settings = prepare_fit(tmp_path)
    path = tmp_path / "stages.json"
    first = {"name": "colour", "parameters": ["Body:base_color"], "spp": 8}
    path.write_text(json.dumps({"stages": [first, {"parameters": ["Body:ior"]}]}))
    assert bpy.ops.selenite.load_stages(filepath=str(path)) == {"FINISHED"}
    assert settings.stage_mode == "own"
    assert [(item.name, item.spp) for item in settings.stages] == [("colour", 8), ("stage 2", 0)]
    path.write_text('{"stages": []}')
    with pytest.raises(RuntimeError, match="its list of stages is empty"):
        bpy.ops.selenite.load_stages(filepath=str(path))
    assert len(settings.stages) == 2
    settings.stages[1].parameters = "Gone:ior"
    assert "'Gone:ior' is not in the list" in asked()[1][0].line()


def test_the_panel_tells_the_stage_that_runs(tmp_path):
    from selenite.interface.operators.fit import SELENITE_OT_start as Start

    _, settings = prepare_fit(tmp_path, lasting=True)
    tick(settings, "base_color", "ior")
    settings.stage_mode = "ior-last"
    assert "stage_mode" in draw(panels.SELENITE_PT_fit)
    start = Pressed(Start)
    assert start._start(bpy.context)
    state.RUN.fitting.update()
    assert "Stage 1 of 2: without IOR" in draw(panels.SELENITE_PT_fit)
    bpy.ops.selenite.cancel()
    assert start._finish(bpy.context) == {"CANCELLED"}


def test_the_panel_tells_how_long_each_preset_will_take(tmp_path):
    _, settings = prepare_fit(tmp_path)
    assert "about" not in draw(panels.SELENITE_PT_fit)
    assert bpy.ops.selenite.estimate() == {"FINISHED"}
    drawn = draw(panels.SELENITE_PT_fit).splitlines()
    shown = [line for line in drawn if "about" in line]
    assert [line.partition(":")[0] for line in shown] == ["Draft", "Balanced", "Accurate"]
    assert all(", error 0.0" in line for line in state.EXPECTED[bpy.context.scene.name][:3])
    assert len(settings.results) == 0
    tick(settings)
    with pytest.raises(RuntimeError, match="no parameter is ticked"):
        bpy.ops.selenite.estimate()


def test_a_row_of_the_list_shows_name_and_number_of_parameters(tmp_path):
    _, settings = prepare_fit(tmp_path)
    bpy.ops.selenite.add_stage()
    layout = FakeLayout()
    row = settings.stages[0]
    stages.SELENITE_UL_stages.draw_item(None, bpy.context, layout, None, row, 0, None, "")
    assert layout.drawn == ["name", "1"]
