# SPDX-License-Identifier: GPL-3.0-or-later
"""Ids of photos, and cameras with several."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "addon"))

from selenite.capture import value_kinds  # noqa: E402
from selenite.capture.capture_property import CaptureProperty  # noqa: E402
from selenite.capture.captures_file import read_captures_file  # noqa: E402
from selenite.capture.request import (  # noqa: E402
    PROPERTIES,
    CaptureRequest,
    values_from_json,
    with_ids,
)
from selenite.commands import arguments, capture_arguments  # noqa: E402
from selenite.commands.capture_arguments import add_captures  # noqa: E402
from selenite.problems import BadInput, Problem  # noqa: E402
from selenite.scene_read.lens import LensDistortion  # noqa: E402

TOP = Path("/").absolute()  # with its drive, on Windows


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


def captures_from(
    *words: str, stored: Sequence[CaptureRequest] = ()
) -> tuple[tuple[CaptureRequest, ...], list[Problem]]:
    """Those of a command line about a scene with the cameras Front and Side."""
    parser = argparse.ArgumentParser()
    add_captures(parser, "")
    cameras = [SimpleNamespace(name=name) for name in ("Front", "Side")]
    problems: list[Problem] = []
    found = capture_arguments.captures_from(
        parser.parse_args(words),
        stored,
        SimpleNamespace(cameras=cameras, unusable_cameras={}),  # type: ignore[arg-type]
        problems,
    )
    return found, problems


def test_options_say_what_photos_do_not(tmp_path: Path) -> None:
    own = CaptureRequest(
        "Front", "/a.png", silhouette=3, gain="none", align=False, background="border",
        response="srgb", distortion=LensDistortion(9, 9, 4, 3),
    )  # fmt: skip
    words = (
        "--silhouette=0", "--gain=rgb", "--align", "--background=0,0,0", "--response=gamma:2",
        "--undistorted", "--exclude=Front=/c.png",
    )  # fmt: skip
    (first, second), problems = captures_from(*words, stored=[own, CaptureRequest("Side", "/b")])
    assert not problems
    assert first == replace(own, id="Front", exclude=f"{TOP}c.png")
    assert second == CaptureRequest(
        "Side", "/b", id="Side", silhouette=0, gain="rgb", align=True, background="0,0,0",
        response="gamma:2", distortion=False,
    )  # fmt: skip
    (bare,), _ = captures_from("--photo=Side=/b.png", "--response=curve.csv", stored=[own])
    assert bare == CaptureRequest(
        "Side", f"{TOP}b.png", id="Side", response=str(Path("curve.csv").absolute())
    )


def test_an_option_out_of_its_range_is_named() -> None:
    _, (problem,) = captures_from("--photo=Side=/b.png", "--silhouette=101")
    assert (problem.object, problem.cause) == ("Argument --silhouette", "it is 101")
    assert problem.cure == "give a whole number from 0 to 100"


def test_a_camera_may_be_given_several_photos() -> None:
    problems: list[Problem] = []
    found = arguments.files(["Front=/a.png", "Front=/b.png", "Front"], problems)
    assert found == [("Front", f"{TOP}a.png"), ("Front", f"{TOP}b.png")]
    assert [item.object for item in problems] == ["Argument 'Front'"]


def test_a_name_in_double_quotes_may_hold_every_sign() -> None:
    problems: list[Problem] = []
    odd = 'A=1:b, "c"\n'
    quoted = json.dumps(odd)
    assert arguments.files([f"{quoted}=/x=y.png"], problems) == [(odd, f"{TOP}x=y.png")]
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
        ("Cam=1", f"{TOP}a.png"),
        ("Cam=12", f"{TOP}b.png"),
        ("Cam", f"{TOP}c.png"),
        ("New", f"{TOP}d.png"),
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


def _shared(**defaults: object) -> dict[str, object]:
    captures = [{"camera": name, "photo": f"{name}.png"} for name in ("a", "b")]
    return {"schema": 1, "captures": captures, "defaults": defaults}


def test_captures_share_what_they_do_not_say(tmp_path: Path) -> None:
    file = tmp_path / "captures.json"
    content = _shared(camera="Front", response="curve.csv", gain="rgb", align=True, silhouette=2)
    content["captures"] = [
        {"photo": "a.png"},
        {"photo": "b.png", "camera": "Side", "gain": "none", "align": False, "silhouette": None},
    ]
    file.write_text(json.dumps(content))
    first, second = read_captures_file(file)
    table = str(tmp_path / "curve.csv")
    assert first == CaptureRequest(
        "Front", str(tmp_path / "a.png"), response=table, gain="rgb", align=True, silhouette=2
    )
    assert second == CaptureRequest(
        "Side", str(tmp_path / "b.png"), response=table, gain="none", align=False
    )


#: Of each kind a value as a file says it, where it can be a falsy one.
SAID: dict[type, object] = {
    value_kinds.Text: "words",
    value_kinds.File: "/a.png",
    value_kinds.MaskFile: "/b.png",
    value_kinds.Response: "gamma:2.2",
    value_kinds.Whole: 0,
    value_kinds.Levels: [0.0, 1.0],
    value_kinds.LampNames: [],
    value_kinds.LampPlaces: {"Key": [1.0, 2.0, 3.0]},
    value_kinds.Lens: False,
}


def said(item: CaptureProperty) -> object:
    """Not the default."""
    if isinstance(item.kind, value_kinds.Pixels):
        return [0] * item.kind.count
    if isinstance(item.kind, value_kinds.Number):
        return item.kind.lowest
    if isinstance(item.kind, value_kinds.OneOf):
        return item.kind.names[0]
    if isinstance(item.kind, value_kinds.Flag):
        return item.default is False
    return SAID[type(item.kind)]


def test_every_key_is_read_and_written_as_it_stands() -> None:
    """Values that are falsy are not left out."""
    content = {item.name: said(item) for item in PROPERTIES}
    request = CaptureRequest.from_json(content)
    assert request.as_json() == content
    assert CaptureRequest.from_json(json.loads(json.dumps(request.as_json()))) == request


@pytest.mark.parametrize("key", [item.name for item in PROPERTIES])
def test_no_key_takes_a_value_of_another_kind(key: str) -> None:
    with pytest.raises(ValueError, match=f"^its '{key}' (is|are|holds) "):
        values_from_json({key: 1j})
    if key in ("camera", "photo"):
        with pytest.raises(ValueError, match=f"its '{key}' is None, not text"):
            values_from_json({key: None})
    else:
        assert values_from_json({key: None}) == {}


@pytest.mark.parametrize(
    ("content", "cause", "cure"),
    [
        ([], "it holds no object", "give a JSON file with 'schema' and 'captures'"),
        ({"schema": 2}, "its schema is 2, this version reads 1", "begin it with 'schema': 1"),
        ({"schema": 1, "captures": {}}, "its 'captures' are no list", "list one object"),
        ({"schema": 1, "captures": [{}], "gain": "rgb"}, "its key 'gain' belongs into its", "each"),
        ({"schema": 1, "captures": [{}], "defaults": 3}, "they are 3, not an object", "keys of"),
        (_shared(photo="a.png"), "its key 'photo' differs from capture to capture", "each"),
        (_shared(gain="all"), "its 'gain' is 'all', not one of none, scalar, rgb", "correct it"),
        (_shared(gian="rgb"), "its key 'gian' is not known; did you mean 'gain'?", "correct it"),
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
    assert problem.object in (f"Captures '{file}'", f"Captures '{file}', defaults")
    assert problem.cause.startswith(cause) and cure in problem.cure
