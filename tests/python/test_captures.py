# SPDX-License-Identifier: GPL-3.0-or-later
"""Ids of photos, and cameras with several."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "addon"))

from selenite.capture.captures_file import read_captures_file  # noqa: E402
from selenite.capture.request import CaptureRequest, with_ids  # noqa: E402
from selenite.commands import arguments  # noqa: E402
from selenite.problems import BadInput, Problem  # noqa: E402


def ids(*captures: tuple[str, str], cameras: tuple[str, ...] = ()) -> list[str]:
    """captures: (camera, id or "")."""
    asked = [CaptureRequest(camera, "photo.png", id=name) for camera, name in captures]
    return [item.id for item in with_ids(asked, cameras)]


def test_an_id_is_the_name_of_the_camera_unless_it_repeats() -> None:
    assert ids(("Front", ""), ("Side", "")) == ["Front", "Side"]
    assert ids(("Front", ""), ("Side", ""), ("Front", ""), ("Front", "")) == [
        "Front", "Side", "Front#2", "Front#3",
    ]  # fmt: skip


def test_no_id_is_the_name_of_another_camera() -> None:
    assert ids(("Front", ""), ("Front", ""), ("Front#2", "")) == ["Front", "Front#3", "Front#2"]
    assert ids(("Front", ""), ("Front", ""), cameras=("Front", "Front#2")) == ["Front", "Front#3"]


def test_given_ids_stay_and_are_not_given_again() -> None:
    assert ids(("Front", "morning"), ("Front", "")) == ["morning", "Front"]
    assert ids(("Front", ""), ("Front", "Front#2"), ("Front", "")) == [
        "Front", "Front#2", "Front#3",
    ]  # fmt: skip
    twice = with_ids([CaptureRequest("Front", "a.png"), CaptureRequest("Front", "b.png")])
    assert with_ids(twice) == twice


def test_a_photo_without_a_camera_has_no_id() -> None:
    assert ids(("", ""), ("Front", "")) == ["", "Front"]


def test_a_camera_may_be_given_several_photos() -> None:
    problems: list[Problem] = []
    found = arguments.files(["Front=/a.png", "Front=/b.png", "Front"], problems)
    assert found == [("Front", "/a.png"), ("Front", "/b.png")]
    assert [item.object for item in problems] == ["Argument 'Front'"]


def test_a_name_in_double_quotes_may_hold_every_sign() -> None:
    problems: list[Problem] = []
    odd = 'A=1:b, "c"\n'
    quoted = json.dumps(odd)
    assert arguments.files([f"{quoted}=/x=y.png"], problems) == [(odd, "/x=y.png")]
    assert arguments.names([f"{quoted}:ior,roughness"], problems) == [
        (odd, "ior"),
        (odd, "roughness"),
    ]
    assert arguments.assignments([f"{quoted}:ior=1.2,1.8"], problems) == {(odd, "ior"): (1.2, 1.8)}
    assert arguments.words([f"{quoted}:albedo_grid=a=b.vol"], "--grid", "N", problems) == {
        (odd, "albedo_grid"): "a=b.vol"
    }
    line_break = '"A\n":power'
    assert arguments.names([line_break], problems) == [("A\n", "power")]
    assert arguments.unquoted(quoted) == odd and arguments.unquoted('"half') == '"half'
    assert not problems


def test_names_with_signs_work_without_quotes_where_they_are_known() -> None:
    problems: list[Problem] = []
    cameras = ["Cam", "Cam=1", "Cam=12"]
    texts = ["Cam=1=/a.png", "Cam=12=/b.png", "Cam=/c.png", "New=/d.png"]
    assert arguments.files(texts, problems, cameras) == [
        ("Cam=1", "/a.png"),
        ("Cam=12", "/b.png"),
        ("Cam", "/c.png"),
        ("New", "/d.png"),
    ]
    assert arguments.assignments(["A=B:C:ior=1.5"], problems) == {("A=B:C", "ior"): (1.5,)}
    assert arguments.words(["A=B:albedo_grid=16"], "--grid", "N", problems) == {
        ("A=B", "albedo_grid"): "16"
    }
    assert not problems


@pytest.mark.parametrize("text", ['"Cam', '"Cam"', '"Cam"x=/a.png', '"Cam"=', "Cam", "=/a.png"])
def test_the_error_says_how_a_name_is_quoted(text: str) -> None:
    problems: list[Problem] = []
    assert arguments.files([text], problems) == []
    (problem,) = problems
    assert problem.object == f"Argument '{text}'" and '"A=1"=FILE' in problem.cure


@pytest.mark.parametrize(
    ("content", "cause", "cure"),
    [
        ([], "it holds no object", "give a JSON file with 'schema' and 'captures'"),
        ({"schema": 2}, "its schema is 2, this version reads 1", "begin it with 'schema': 1"),
        ({"schema": 1, "captures": {}}, "its 'captures' are no list", "list one object"),
        ({"schema": 1, "captures": [{}], "gain": "rgb"}, "its key 'gain' belongs into its", "each"),
        ({"schema": 1, "capture": [{}]}, "its key 'capture' is not known", "'captures'?"),
    ],
)
def test_a_file_of_captures_says_what_is_wrong(
    tmp_path: Path, content: object, cause: str, cure: str
) -> None:
    """A key that stands beside the captures would count for none of them without a word."""
    file = tmp_path / "captures.json"
    file.write_text(json.dumps(content))
    with pytest.raises(BadInput) as error:
        read_captures_file(file)
    (problem,) = error.value.problems
    assert problem.object == f"Captures '{file}'"
    assert problem.cause.startswith(cause) and cure in problem.cure
