# SPDX-License-Identifier: GPL-3.0-or-later
"""Which lights were on in a photo: from JSON and tables to what the native scene takes."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from selenite.capture.captures_file import read_captures_file
from selenite.capture.light_states import (
    AS_IN_SCENE,
    described,
    is_as_in_scene,
    key_of,
    light_state,
    most_common,
)
from selenite.capture.request import CaptureRequest
from selenite.problems import BadInput, Problem
from selenite.scene_read.lamps import places as lamp_places
from selenite.scene_read.values import LampFrame, LightValues, SceneValues


def matrix(x: float = 0, y: float = 0, z: float = 0, scale: float = 1) -> np.ndarray:
    found = np.diag([scale, scale, scale, 1.0])
    found[:3, 3] = (x, y, z)
    return found


def lamp(name: str, place: str = "", kind: str = "AREA", **more: Any) -> LightValues:  # noqa: ANN401
    shape: dict[str, Any] = {
        "AREA": {"shape": "SQUARE", "size_x": 2.0, "size_y": 2.0, "spread": math.pi},
        "POINT": {"radius": 0.1, "soft_falloff": True},
        "SUN": {"angle": 0.01},
    }[kind]
    usual = {"matrix": matrix(1, 2, 3), "radiance_scale": 1.0, "object": place or name}
    return LightValues(
        name=name, kind=kind, power=10.0, color=(1.0, 1.0, 1.0), light_units="v4", shape=shape,
        **(usual | more),
    )  # fmt: skip


def scene(*lights: LightValues, frames: dict[int, LampFrame] | None = None) -> SceneValues:
    return SceneValues(lights=list(lights), lamp_frames=frames or {})


def state(values: SceneValues, **asked: Any) -> dict[str, Any]:  # noqa: ANN401
    problems: list[Problem] = []
    found = light_state(values, CaptureRequest("Front", "a.png", id="one", **asked), problems)
    assert not problems, problems
    return found


def troubles(values: SceneValues, **asked: Any) -> list[str]:  # noqa: ANN401
    problems: list[Problem] = []
    light_state(values, CaptureRequest("Front", "a.png", id="one", **asked), problems)
    return [problem.line() for problem in problems]


ROWS = [[1.0, 0.0, 0.0, 4.0], [0.0, 1.0, 0.0, 5.0], [0.0, 0.0, 1.0, 6.0], [0.0, 0.0, 0.0, 1.0]]
FLAT = tuple(number for row in ROWS for number in row)


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"lights": []},
        {"lights": ["Key", "Fill"], "world": False},
        {"transforms": {"Key": ROWS, "Fill": [1.0, 2.0, 3.0]}},
        {"transforms": {"Key": [1.0, 2.0, 3.0, 0.5, 0.5, 0.5, 0.5]}, "frame": -7},
    ],
)
def test_json_says_the_same_after_a_round_trip(more: dict[str, Any]) -> None:
    data = {"camera": "Front", "photo": "a.png", **more}
    request = CaptureRequest.from_json(data)
    assert request.as_json() == data
    assert CaptureRequest.from_json(json.loads(json.dumps(request.as_json()))) == request


def test_a_matrix_may_be_one_list() -> None:
    base = {"camera": "Front", "photo": "a.png"}
    flat = CaptureRequest.from_json(base | {"transforms": {"Key": list(FLAT)}})
    assert flat == CaptureRequest.from_json(base | {"transforms": {"Key": ROWS}})


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"lights": "Key"}, "'lights' are 'Key', not a list"),
        ({"world": 1}, "'world' is 1, not true or false"),
        ({"frame": 1.5}, "'frame' is 1.5, not a whole number"),
        ({"frame": True}, "'frame' is True, not a whole number"),
        ({"transforms": {"Key": [1, 2]}}, "is [1, 2], not 3, 7 or 16 numbers or 4 rows of 4"),
        ({"transforms": {"Key": ROWS[:3]}}, "not 3, 7 or 16 numbers or 4 rows of 4"),
        ({"transforms": {"Key": "matrix"}}, "is 'matrix', not 3, 7 or 16 numbers"),
        ({"transforms": {"Key": [1, 2, 3, 0, 0, 0, 0]}}, "quaternion 0, 0, 0, 0"),
        ({"transforms": {"Key": [*ROWS[:3], [0, 0, 1, 1]]}}, "last row"),
    ],
)
def test_what_is_no_light_state_is_refused(more: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said.replace("[", r"\[")):
        CaptureRequest.from_json({"camera": "Front", "photo": "a.png", **more})


def test_nothing_asked_is_the_scene_itself() -> None:
    found = state(scene(lamp("Key")))
    assert found == AS_IN_SCENE and is_as_in_scene(found)
    assert not is_as_in_scene(state(scene(lamp("Key")), world=False))


def test_lamps_are_called_by_their_objects_or_else_all_of_their_places() -> None:
    values = scene(lamp("Bulb", "Left"), lamp("Bulb", "Right"), lamp("Key"))
    assert state(values, lights=("Right",))["lamps"] == ["Right"]
    assert state(values, lights=("Key", "Bulb"))["lamps"] == ["Left", "Right", "Key"]
    assert state(values, lights=())["lamps"] == []
    assert troubles(values, lights=("Rim", "Key")) == [
        "Photo 'one': lamp 'Rim': it is not in the scene, or hidden from renders; "
        "use one of 'Left', 'Right', 'Key'"
    ]


def test_a_place_keeps_rotation_and_scale() -> None:
    turned = matrix(1, 2, 3, scale=2)
    turned[:3, :2] = turned[:3, [1, 0]] * (1, -1)
    values = scene(lamp("Key", matrix=turned))
    there, scale = state(values, transforms=(("Key", (7.0, 8.0, 9.0)),))["places"]["Key"]
    expected = turned.copy()
    expected[:3, 3] = (7, 8, 9)
    np.testing.assert_array_equal(there, expected)
    assert scale == 1.0
    # A quarter turn about z takes x to y; the lamp's size stays.
    half = math.sqrt(0.5)
    quarter = (0.0, 0.0, 0.0, half, 0.0, 0.0, half)
    there, _ = state(values, transforms=(("Key", quarter),))["places"]["Key"]
    np.testing.assert_allclose(there[:3, 0], (0, 2, 0), atol=1e-12)
    np.testing.assert_allclose(there[:3, 1], (-2, 0, 0), atol=1e-12)


def test_a_lamp_of_fixed_radiance_gives_more_light_where_it_is_larger() -> None:
    """Of 2 x 2 units and radiance scale 8 its area counts 4 of these; at scale 3 the area is 36."""
    fixed = scene(lamp("Key", matrix=matrix(), radiance_scale=8.0, normalized=False))
    larger = tuple(matrix(scale=3).ravel())
    assert state(fixed, transforms=(("Key", larger),))["places"]["Key"][1] == pytest.approx(72)
    usual = scene(lamp("Key", matrix=matrix(), radiance_scale=8.0))
    assert state(usual, transforms=(("Key", larger),))["places"]["Key"][1] == 8.0


def test_what_cannot_stand_so_is_named() -> None:
    twice = scene(lamp("Bulb", "Left"), lamp("Bulb", "Right"))
    assert troubles(twice, transforms=(("Bulb", (1.0, 2.0, 3.0)),)) == [
        "Photo 'one': lamp 'Bulb': it stands at 2 places, so one matrix cannot move it; "
        "name one of its objects, or make its instances real"
    ]
    sun = scene(lamp("Sun", kind="SUN"))
    assert troubles(sun, transforms=(("Sun", (1.0, 2.0, 3.0)),)) == [
        "Photo 'one': lamp 'Sun': it is a sun, of which a place says nothing; "
        "give a rotation too, or a matrix"
    ]
    sheared = matrix()
    sheared[0, 1] = 0.5
    found = troubles(scene(lamp("Key")), transforms=(("Key", tuple(sheared.ravel())),))
    assert len(found) == 1 and "shears" in found[0]
    flat = tuple(np.diag([1.0, 1.0, 0.0, 1.0]).ravel())
    found = troubles(scene(lamp("Key")), transforms=(("Key", flat),))
    assert len(found) == 1 and "flattens" in found[0]


def test_a_frame_moves_lamps_and_switches_off_what_is_hidden_there() -> None:
    there = matrix(9, 9, 9)
    values = scene(
        lamp("Key"), lamp("Fill"), lamp("Rim"),
        frames={5: LampFrame({"Key": there, "Rim": lamp("Rim").matrix})},
    )  # fmt: skip
    found = state(values, frame=5)
    assert found["lamps"] == ["Key", "Rim"]
    assert list(found["places"]) == ["Key"]
    np.testing.assert_array_equal(found["places"]["Key"][0], there)
    assert state(values, frame=5, lights=("Fill", "Rim"))["lamps"] == ["Rim"]
    own = state(values, frame=5, transforms=(("Key", (1.0, 1.0, 1.0)),))["places"]["Key"][0]
    np.testing.assert_array_equal(own[:3, 3], (1, 1, 1))
    trouble = Problem("Object 'Cube'", "it moves", "keep it")
    bad = scene(lamp("Key"), frames={5: LampFrame({}, (trouble,))})
    assert troubles(bad, frame=5) == [trouble.line()]


def test_states_are_compared_and_said() -> None:
    values = scene(lamp("Key"), lamp("Fill"))
    key, fill = state(values, lights=("Key",)), state(values, lights=("Fill",))
    moved = state(values, lights=("Key",), transforms=(("Key", (1.0, 1.0, 1.0)),), world=False)
    assert len({key_of(item) for item in (key, fill, moved, dict(AS_IN_SCENE))}) == 4
    assert key_of(state(values, lights=("Fill", "Key"))) == key_of(
        state(values, lights=("Key", "Fill"))
    )
    assert most_common([fill, key, key]) == key and most_common([fill, key]) == fill
    assert [described(item) for item in (key, moved, AS_IN_SCENE, state(values, lights=()))] == [
        "lamp 'Key'", "lamp 'Key' ('Key' moved), world off", "all lamps", "no lamp",
    ]  # fmt: skip


def test_the_area_of_a_lamp_is_that_of_its_shape() -> None:
    disk = {"shape": "DISK", "size_x": 2.0, "size_y": 2.0}
    assert lamp_places.area_of("AREA", disk, matrix(scale=3)) == pytest.approx(math.pi * 9)
    assert lamp_places.area_of("POINT", {"radius": 2.0}, matrix()) == pytest.approx(16 * math.pi)
    assert lamp_places.area_of("SUN", {"angle": 0.0}, matrix()) == 1.0


def table(folder: Path, text: str, **capture: Any) -> CaptureRequest:  # noqa: ANN401
    (folder / "lamps.csv").write_text(text)
    entry = {"camera": "Front", "photo": "shots/a.png", "transforms": "lamps.csv", **capture}
    file = folder / "captures.json"
    file.write_text(json.dumps({"schema": 1, "captures": [entry]}))
    return read_captures_file(file)[0]


def test_a_table_gives_places_by_id_or_file_name(tmp_path: Path) -> None:
    places = "photo,lamp,x,y,z\na,Key,1,2,3\nb,Key,4,5,6\na,Fill,7,8,9\n"
    expected = (("Key", (1.0, 2.0, 3.0)), ("Fill", (7.0, 8.0, 9.0)))
    assert table(tmp_path, places).transforms == expected
    assert table(tmp_path, places.replace("\na,", "\nshots/a.png,")).transforms == expected
    assert table(tmp_path, places, id="b").transforms == (("Key", (4.0, 5.0, 6.0)),)
    turned = "lamp,photo,qw,qx,qy,qz,x,y,z\nKey,a.png,1,0,0,0,4,5,6\n"
    assert table(tmp_path, turned).transforms == (("Key", (4.0, 5.0, 6.0, 1.0, 0.0, 0.0, 0.0)),)
    names = ",".join(f"m{i}{j}" for i in range(4) for j in range(4))
    whole = f"photo,lamp,{names}\na,Key,{','.join(map(str, FLAT))}\n"
    assert table(tmp_path, whole).transforms == (("Key", FLAT),)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("photo,lamp,x,y\na,Key,1,2\n", "has the columns photo, lamp, x, y; it takes photo, lamp"),
        ("photo,lamp,x,y,z,w\na,Key,1,2,3,4\n", "has column 'w'; it takes"),
        ("photo,lamp,x,y,z\na,Key,1,2,up\n", "row 2 of its table .* has 'up' for z, not a number"),
        ("photo,lamp,x,y,z\na,Key,1,2\n", "row 2 of its table .* has '' for z"),
        ("photo,lamp,x,y,z\na,,1,2,3\n", "row 2 of its table .* names no photo or no lamp"),
        ("photo,lamp,x,y,z\nb,Key,1,2,3\n", "has no row for it"),
        ("photo,lamp,x,y,z\na,Key,1,2,3\na,Key,1,2,3\n", "row 3 .* a second time"),
        ("photo,lamp,x,y,z\na,Key,1,2,nan\n", "holds nan, not a finite number"),
        ("", "has the columns of nothing"),
    ],
)
def test_a_table_that_cannot_be_used_is_named(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(BadInput, match=said):
        table(tmp_path, text)


def test_a_table_that_is_not_there_is_named_in_words(tmp_path: Path) -> None:
    file = tmp_path / "captures.json"
    entry = {"camera": "Front", "photo": "a.png", "transforms": "none.csv"}
    file.write_text(json.dumps({"schema": 1, "captures": [entry]}))
    with pytest.raises(BadInput, match=r"none.csv' cannot be read \(it does not exist\)"):
        read_captures_file(file)
