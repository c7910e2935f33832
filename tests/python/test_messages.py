# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages by id: each has its text in each language, with the same arguments."""

from __future__ import annotations

import ast
import copy
import importlib.util
import json
import pickle
import string
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import message_texts  # noqa: E402

from selenite.messages import (  # noqa: E402
    control,
    joined,
    message,
    named,
    packed,
    phrase,
    rendered,
    thing,
    unpacked,
)

FURNITURE = message_texts.ADDON / "interface" / "furniture"
_spec = importlib.util.spec_from_file_location("controls", FURNITURE.parent / "controls.py")
assert _spec is not None and _spec.loader is not None
_controls = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(_controls)
CONTROLS = _controls.CONTROLS
LANGUAGES = sorted((FURNITURE / "messages").glob("*.json"))


def _names(text: str) -> set[str]:
    return {name for _, name, _, _ in string.Formatter().parse(text) if name is not None}


@pytest.mark.parametrize("path", LANGUAGES, ids=lambda path: path.stem)
def test_a_language_has_every_message_and_no_other(path: Path) -> None:
    wanted, found = message_texts.messages(), json.loads(path.read_text(encoding="utf-8"))
    assert 200 <= len(wanted) <= 250, "daily sentences, not every refusal"
    assert set(wanted) == set(found)
    for key, english in wanted.items():
        assert len(english) == 1, f"{key} says two things: {english}"
        assert _names(found[key]) == _names(*english), key


def test_a_message_is_given_what_its_text_names() -> None:
    english = message_texts.messages()
    for key, given in message_texts.arguments().items():
        assert given == {frozenset(_names(*english[key]))}, key


def test_the_panel_has_words_for_every_control_and_they_name_no_option() -> None:
    losses = {name for name in message_texts.controls() if name.startswith("loss.")}
    assert message_texts.controls() - losses == set(CONTROLS)
    for path in LANGUAGES:
        labels = json.loads((FURNITURE / "texts" / path.name).read_text(encoding="utf-8"))
        assert set(CONTROLS.values()) <= set(labels)
    assert not any("--" in words for words in CONTROLS.values())


def test_no_source_that_the_panel_shares_names_an_option_outside_a_control() -> None:
    rooms = ("scene_read", "capture", "fit", "report", "advice", "importers")
    found = []
    for room in rooms:
        for path in sorted((message_texts.ADDON / room).rglob("*.py")):
            if path.parent.name == "cluster":  # the panel has none
                continue
            tree = ast.parse(path.read_text(encoding="utf-8"))
            allowed = {
                part
                for node in ast.walk(tree)
                if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "control"
                for part in ast.walk(node)
            }
            allowed |= {
                node.value for node in ast.walk(tree) if isinstance(node, ast.Expr)
            }  # docstrings
            found += [
                f"{path.name}: {node.value}"
                for node in ast.walk(tree)
                if isinstance(node, ast.Constant) and isinstance(node.value, str)
                if node not in allowed and " --" in f" {node.value}" and " " in node.value
            ]
    assert found == []


GERMAN = {"a": "{x} liegt {side} von „{name}“", "left": "links", "right": "rechts"}


def test_what_fills_a_message_is_translated_too_and_a_name_stays() -> None:
    said = message("a", "{x} is {side} of '{name}'", x=3, side=message("left", "left"), name="left")
    assert said == "3 is left of 'left'", "it is its English"
    assert rendered(said, GERMAN.get) == "3 liegt links von „left“"
    assert rendered(joined("; ", (said, "more")), GERMAN.get) == "3 liegt links von „left“; more"
    assert (
        rendered(phrase("see {what}", what=message("right", "right")), GERMAN.get) == "see rechts"
    )
    assert rendered("left", GERMAN.get) == "left", "a plain text is no message"


def test_braces_in_what_fills_a_message_stay() -> None:
    said = message("b", "file '{name}'", name="a{x}.png")
    assert rendered(said, {"b": "Datei „{name}“"}.get) == "Datei „a{x}.png“"
    assert joined(", ", ("{", "}")) == "{, }"
    assert control("x", "'{a}'") == "'{a}'"


def test_a_cure_names_the_option_or_the_control() -> None:
    cure = phrase("take it out, or {fit} {name}", fit=control("fit", "add --fit"), name="A:ior")
    assert cure == "take it out, or add --fit A:ior"
    shown = rendered(cure, lambda key: CONTROLS.get(key.removeprefix("control.")))
    assert shown == "take it out, or tick A:ior"


def test_a_message_survives_a_property_of_blender_a_copy_and_a_process() -> None:
    said = message("a", "{x} is {side}", x=3, side=message("left", "left"))
    kept = unpacked(packed([said, "plain"]))
    for found in (kept[0], copy.deepcopy(said), pickle.loads(pickle.dumps(said))):  # noqa: S301
        assert found == said
        assert rendered(found, {"a": "{side}: {x}", "left": "links"}.get) == "links: 3"
    assert kept[1] == "plain"
    assert unpacked("Good match. Apply.\nMore") == ["Good match. Apply.", "More"], "earlier files"
    assert unpacked("") == []


def test_what_a_problem_is_about_is_known_without_its_text() -> None:
    assert thing("Camera", "it's 'left'") == "Camera 'it's 'left''"
    assert named(thing("Camera", "it's 'left'")) == ("camera", "it's 'left'")
    assert named("Camera 'Front'") == ("", "")


def test_a_separator_may_be_a_message_and_may_have_braces() -> None:
    said = joined(message("or", " or "), ("A", message("left", "left")))
    assert said == "A or left"
    assert rendered(said, {"or": " oder ", "left": "links"}.get) == "A oder links"
    assert joined("{}", ("a", "b")) == "a{}b"


@pytest.mark.parametrize("text", ['[["a"]]', "[1", '["a", ["b", "{x}", {}]]', "3", "null"])
def test_a_property_with_anything_in_it_is_its_text(text: str) -> None:
    assert unpacked(text) == [text]
