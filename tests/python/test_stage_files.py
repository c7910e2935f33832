# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of stages, and the stages that are known by name."""

import json

import pytest

from selenite.capture.request import CaptureRequest
from selenite.fit.staging.request import PRESETS, StageRequest, read_stages, stages_by_name
from selenite.problems import BadInput


def write(tmp_path, data):
    path = tmp_path / "stages.json"
    path.write_text(data if isinstance(data, str) else json.dumps(data), encoding="utf-8")
    return path


def test_a_file_gives_names_parameters_and_settings(tmp_path):
    first = {"name": "colour", "parameters": ["Body:base_color"], "iterations": 30, "spp": 8}
    path = write(
        tmp_path, {"schema": 1, "stages": [first, {"parameters": ["Body:ior", "W:color"]}]}
    )
    stages = read_stages(path)
    assert stages == (
        StageRequest("colour", ("Body:base_color",), 30, 8, None),
        StageRequest("stage 2", ("Body:ior", "W:color")),
    )
    again = write(tmp_path, {"stages": [stage.as_json() for stage in stages]})
    assert read_stages(again) == stages


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ("{", ["cannot be read"]),
        ([], ["no list of stages"]),
        ({"stages": []}, ["is empty"]),
        ({"stages": [3]}, ["stage 1: 3 is no object"]),
        ({"stages": [{"parameters": ["A:b"]}], "shema": 1}, ["key 'shema'"]),
        ({"stages": [{"parameters": ["A:b"]}], "schema": 2}, ["schema is 2"]),
        (
            {"stages": [{"parameters": 0}, {"parameters": ["A:b"] * 2, "spp": 2.5, "eta": 1}]},
            ["its parameters are 0", "2, 'A:b': given twice", "'spp': it is 2.5", "key 'eta'"],
        ),
        ({"stages": [{"parameters": ["A:b"], "name": " ", "height": True}]},
         ["its name is ' '", "key 'height': it is True"]),
    ],
)  # fmt: skip
def test_every_fault_of_a_file_is_one_line(tmp_path, data, words):
    with pytest.raises(BadInput) as caught:
        read_stages(write(tmp_path, data))
    lines = [problem.line() for problem in caught.value.problems]
    assert len(lines) == len(words)
    for word in words:
        assert any(word in line for line in lines), (word, lines)
    assert all("stages.json" in line and ";" in line for line in lines)


def test_ior_last_fits_everything_in_the_end():
    names = ["Body:base_color", "Body:roughness", "Body:ior", "Body:coat_ior"]
    problems = []
    first, last = stages_by_name("ior-last", names, 40, problems)
    assert first.parameters == ("Body:base_color", "Body:roughness")
    assert (first.iterations, last.iterations) == (20, 40)
    assert last.parameters == tuple(names)
    assert not problems


def test_colours_first_leaves_an_albedo_to_the_stage_before_its_grid():
    names = ["Jade:albedo", "Jade:extinction", "Jade:albedo_grid", "Key:color", "Key:power"]
    problems = []
    first, last = stages_by_name("colours-first", names, 40, problems)
    assert first.parameters == ("Jade:albedo", "Key:color")
    assert last.parameters == ("Jade:extinction", "Jade:albedo_grid", "Key:color", "Key:power")


def test_light_first_leaves_the_light_as_it_was_found_beside_one_colour():
    names = ["Head:base_color", "Head:roughness", "Head:base_color_texture", "Key:power"]
    problems = []
    first, last = stages_by_name("light-first", [*names, "World:environment"], 40, problems)
    assert first.parameters == ("Head:base_color", "Key:power", "World:environment")
    assert last.parameters == ("Head:roughness", "Head:base_color_texture", "Key:power")
    assert (first.iterations, last.iterations) == (20, 40)
    assert not problems


@pytest.mark.parametrize(
    ("others", "gains", "light_first"),
    [
        (["Head:base_color_texture", "Head:base_color", "Head:roughness"], ("", ""), True),
        (["Head:base_color_texture", "Head:base_color", "Key:power"], ("", "none"), True),
        # Of a colour that is not known the light would take what it is off by.
        (["Head:base_color_texture", "Head:roughness"], ("rgb", "rgb"), True),
        (["Head:base_color_texture", "Head:roughness"], ("rgb", "none"), False),
        (["Head:base_color_texture", "Head:roughness", "Key:color"], ("", ""), False),
        (["Head:base_color_texture", "Ground:base_color"], ("", ""), False),
        (["Head:base_color", "Head:roughness"], ("rgb", "rgb"), False),
        (["Head:base_color_texture", "Head:transmission"], ("rgb", "rgb"), False),
        (["Head:base_color_texture", "Jade:albedo_grid"], ("rgb", "rgb"), False),
    ],
)
def test_light_comes_first_by_itself_where_an_image_would_take_up_its_errors(
    others, gains, light_first
):
    names, problems = [*others, "World:environment"], []
    captures = [CaptureRequest("Camera", "photo.png", gain=gain) for gain in gains]
    wanted = stages_by_name("light-first", names, 40, problems) if light_first else ()
    assert stages_by_name("usual", names, 40, problems, captures) == wanted
    assert stages_by_name("usual", others, 40, problems, captures) == ()
    assert stages_by_name("none", names, 40, problems) == ()
    assert not problems


@pytest.mark.parametrize(
    ("text", "names", "cause"),
    [
        ("ior-last", ["Body:roughness"], "no index of refraction is fitted"),
        ("ior-last", ["Body:ior"], "only indices of refraction are fitted"),
        ("colours-first", ["Body:ior"], "no colour is fitted"),
        ("colours-first", ["Body:base_color"], "only colours are fitted"),
        ("light-first", ["Body:base_color_texture"], "World:environment is not fitted"),
        ("light-first", ["Body:ior", "World:environment"], "no image or grid is fitted"),
        ("ior-first", ["Body:ior"], "not known"),
    ],
)
def test_stages_that_split_nothing_are_refused(text, names, cause):
    problems = []
    assert stages_by_name(text, names, 40, problems) == ()
    assert cause in problems[0].line()
    assert set(PRESETS) == {"usual", "none", "ior-last", "colours-first", "light-first"}
