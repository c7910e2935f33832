# SPDX-License-Identifier: GPL-3.0-or-later
"""Every sentence that the panel may show has its text in each language of the add-on."""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import message_texts  # noqa: E402
import native_texts  # noqa: E402

INTERFACE = message_texts.ADDON / "interface"
LANGUAGES = sorted((INTERFACE / "furniture" / "messages").glob("*.json"))

_spec = importlib.util.spec_from_file_location("messages", INTERFACE / "messages.py")
assert _spec is not None and _spec.loader is not None
messages = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(messages)


def _texts(path: Path) -> dict[str, str]:
    labels = path.parents[1] / "texts" / path.name  # of the interface itself
    return json.loads(labels.read_text(encoding="utf-8")) | json.loads(
        path.read_text(encoding="utf-8")
    )


def _values(text: str) -> list[str]:
    return [f"<{at}>" for at in range(text.count("{}"))]


@pytest.mark.parametrize("path", LANGUAGES, ids=lambda path: path.stem)
def test_a_language_has_every_message(path: Path) -> None:
    wanted, found = message_texts.wanted(), _texts(path)
    assert len(wanted) > 900  # the collector collects
    lacking = [f"{place}: {text}" for text, place in wanted.items() if text not in found]
    assert not lacking, "\n".join(lacking)


@pytest.mark.parametrize("path", LANGUAGES, ids=lambda path: path.stem)
def test_a_language_has_what_the_native_modules_say(path: Path) -> None:
    wanted, found = native_texts.wanted(), _texts(path)
    assert len(wanted) > 200  # the collector collects
    lacking = [
        f"{place}: {part}"
        for part, (whole, place) in wanted.items()
        if part not in found and whole not in found
    ]
    assert not lacking, "\n".join(lacking)


def test_a_native_message_is_german_from_the_first_word_to_the_last() -> None:
    path = next(item for item in LANGUAGES if item.stem == "de_DE")
    language = messages.Messages(json.loads(path.read_text(encoding="utf-8")))
    said = "Photo 'a.png': cannot be read: it has a palette instead of colours"
    assert language.translated(said) == (
        "Foto „a.png“: nicht lesbar: es hat eine Palette statt Farben"
    )
    said = (
        "Body:ior: start = 3 lies outside its bounds [1, 2.5]; move the start or widen the bounds"
    )
    assert language.translated(said) == (
        "Body:ior: Start = 3 liegt außerhalb seiner Grenzen [1, 2.5]; "
        "verschiebe den Start oder erweitere die Grenzen"
    )


@pytest.mark.parametrize("path", LANGUAGES, ids=lambda path: path.stem)
def test_a_language_has_no_message_of_yesterday(path: Path) -> None:
    wanted = {*message_texts.wanted(), *native_texts.wanted()}
    found = json.loads(path.read_text(encoding="utf-8"))
    left = [text for text in found if " " in text and message_texts.is_sentence(text)]
    left = [text for text in left if text not in wanted]
    assert left == []


@pytest.mark.parametrize("path", LANGUAGES, ids=lambda path: path.stem)
def test_names_and_numbers_of_a_message_stay(path: Path) -> None:
    found = json.loads(path.read_text(encoding="utf-8"))
    language = messages.Messages(found)
    for text, words in found.items():
        assert words and text.count("{}") == words.count("{}"), text
        seen = language.translated(text.format(*_values(text)))
        assert all(value in seen for value in _values(text)), seen
        assert seen == words.format(*_values(text)), seen


def test_the_message_that_says_more_is_meant() -> None:
    language = messages.Messages(
        {"it is {}": "es ist {}", "it is {}, not {}": "es ist {}, kein {}"}
    )
    assert language.translated("it is 3, not text") == "es ist 3, kein text"


def test_what_fills_a_message_is_translated_too() -> None:
    language = messages.Messages({"no {}: {}": "kein {}: {}", "file '{}'": "Datei „{}“"})
    assert language.translated("no file 'a b': 3") == "kein Datei „a b“: 3"


def test_a_name_stays_where_it_is_a_word_of_the_language() -> None:
    language = messages.Messages({"left": "links", "photo '{}' {}": "Foto „{}“ {}"})
    assert language.translated("photo 'left' left") == "Foto „left“ links"


def test_what_a_message_is_about_is_translated_by_itself() -> None:
    language = messages.Messages({"{} is off": "aus ist {}", "lamp": "Lampe", "it": "es"})
    assert language.translated("lamp: it is off") == "Lampe: aus ist es"


def test_parts_of_a_line_are_translated_where_the_whole_is_not_known() -> None:
    language = messages.Messages({"file '{}'": "Datei „{}“", "give one": "gib eine an"})
    assert language.translated("file 'x': 7 lacks; give one") == "Datei „x“: 7 lacks; gib eine an"


def test_what_no_language_knows_stays() -> None:
    assert messages.Messages({}).translated("Body: 3 of 4") == "Body: 3 of 4"
