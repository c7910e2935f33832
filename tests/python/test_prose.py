# SPDX-License-Identifier: GPL-3.0-or-later
"""The guide, the README, the changelog and the command line: short sentences in the terms of the
field, counted."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "devtools"), str(Path(__file__).parent)]

from message_texts import messages  # noqa: E402

import generated_part  # noqa: E402
from selenite.cli import build_parser  # noqa: E402

GUIDE = sorted((ROOT / "docs" / "guide").glob("*.md"))
README = ROOT / "README.md"
METHOD = sorted((ROOT / "docs" / "method").glob("*.md"))
CHANGELOG = ROOT / "CHANGELOG.md"
MOST_WORDS = 15_000  # of the guide, without what scripts write
#: Page that a script writes as a whole.
GENERATED = "parameters.md"
#: Pages -> words a sentence: on average over all of them, and at most.
PROSE = {
    "guide": ([*GUIDE, README], 16.0, 30),
    "method": (METHOD, 16.0, 35),  # formulas count
    "changelog": ([CHANGELOG], 20.0, 40),
}
LONGEST_CHANGE = 25  # words of a line of the changelog
SECTIONS = ("Added", "Changed", "Deprecated", "Removed", "Fixed", "Security")
#: What the field says otherwise: never a heading, alone or among other words.
NOT_IN_HEADINGS = (
    "arrived", "as good", "beside", "blur", "contested", "even fields", "evidence", "focus", "hold",
    "imitate", "in turns", "instruments", "likeness", "look", "looks", "nearness", "rival",
    "rivals", "scout", "search", "secants", "separate", "serious", "settle", "sharpened", "spread",
    "tell", "tells", "told", "turn", "turns", "valley", "verification", "way",
)  # fmt: skip

_FENCE = re.compile(r"^```.*?^```[^\n]*$", re.MULTILINE | re.DOTALL)
_IMAGE = re.compile(r"!\[[^\]]*\]\([^)]*\)")
_LINK = re.compile(r"\[([^\]]*)\]\([^)]*\)")
_CODE = re.compile(r"`[^`]*`")
_HEADING = re.compile(r"^#+ +(.*)$", re.MULTILINE)
_ITEM = re.compile(r"^\s*(?:[-*]|\d+\.) +")
_END = re.compile(r"(?<=[.!?])[\"')*_]*\s+")


def blocks(text: str) -> list[str]:
    """Paragraphs and list items, as words: without code blocks, tables, headings and pictures.

    A link is its text, inline code a single word.
    """
    text = _FENCE.sub("\n", text)
    text = _CODE.sub("code", _LINK.sub(r"\1", _IMAGE.sub("", text)))
    found = [""]
    for line in text.splitlines():
        bare = line.strip()
        if not bare or bare.startswith(("|", "#")):
            found.append("")
        elif _ITEM.match(line):
            found.append(_ITEM.sub("", line))
        else:
            found[-1] += f" {bare}"
    return [" ".join(block.split()) for block in found if block.strip()]


def words(text: str) -> int:
    """Those with a letter or a digit."""
    return sum(any(c.isalnum() for c in word) for word in text.split())


def sentences(text: str) -> list[str]:
    """Of prose; one that leads to a list or a table ends there."""
    parts = [part for block in blocks(text) for part in _END.split(block)]
    return [part for part in parts if words(part)]


def _read(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def test_sentences_are_counted_as_a_reader_does() -> None:
    text = (
        "# Not this\n\nOne two three. Four `five six` [seven](a.b/c.d)!\n\n"
        "| not | this |\n|---|---|\n\n- An item\n  of 4 words\n- Another: one\n\n"
        "```\nnot this. nor this.\n```\n\n![not this](p.png)\nIt is 0.5 - or more.\n"
    )
    assert [words(item) for item in sentences(text)] == [3, 3, 5, 2, 5]


@pytest.mark.parametrize("pages", PROSE)
def test_no_sentence_is_too_long(pages: str) -> None:
    paths, _, longest = PROSE[pages]
    found = [item for path in paths for item in sentences(_read(path)) if words(item) > longest]
    assert not found, "\n".join(found)


@pytest.mark.parametrize("pages", PROSE)
def test_sentences_are_short_on_average(pages: str) -> None:
    paths, longest_mean, _ = PROSE[pages]
    counts = [words(item) for path in paths for item in sentences(_read(path))]
    assert counts
    assert sum(counts) / len(counts) <= longest_mean


def _helps(parser: argparse.ArgumentParser) -> Iterator[str]:
    """Descriptions of options and groups, of all commands."""
    yield from (group.description or "" for group in parser._action_groups if group.title != "")
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                yield from _helps(command)
        elif action.help and action.help != argparse.SUPPRESS:
            yield action.help


def test_sentences_of_the_command_line_are_as_short() -> None:
    _, longest_mean, longest = PROSE["guide"]
    helps = [text for text in _helps(build_parser()) if "\n" not in text]
    texts = helps + [text for found in messages().values() for text in found]
    counts = {item: words(item) for text in texts for item in _END.split(text) if words(item)}
    assert len(counts) > 300
    assert not [item for item, count in counts.items() if count > longest]
    assert sum(counts.values()) / len(counts) <= longest_mean


def test_the_guide_is_short() -> None:
    pages = {path.name: generated_part.removed(_read(path)) for path in GUIDE}
    del pages[GENERATED]
    counts = {name: words(text) for name, text in pages.items()}
    assert sum(counts.values()) <= MOST_WORDS, counts


@pytest.mark.parametrize("path", [*GUIDE, CHANGELOG], ids=lambda path: path.name)
def test_headings_use_the_terms_of_the_field(path: Path) -> None:
    text = _CODE.sub("code", _FENCE.sub("", _read(path)))
    private = re.compile(rf"\b({'|'.join(NOT_IN_HEADINGS)})\b", re.IGNORECASE)
    found = [heading for heading in _HEADING.findall(text) if private.search(heading)]
    assert not found, "\n".join(found)


def test_a_change_is_one_short_line_under_its_kind() -> None:
    section, wrong = "", []
    for line in _read(CHANGELOG).split("## [", 1)[1].splitlines()[1:]:
        if line.startswith("### "):
            section = line.removeprefix("### ")
            wrong += [] if section in SECTIONS else [line]
        elif line.startswith("## ["):
            section = ""
        elif line.startswith("- "):
            change = blocks(line)[0]
            wrong += [] if section and words(change) <= LONGEST_CHANGE else [line]
        elif line.strip():
            wrong.append(line)  # neither a heading nor a change
    assert not wrong, "\n".join(wrong)
