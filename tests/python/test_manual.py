# SPDX-License-Identifier: GPL-3.0-or-later
"""The guide says what the code does, and its links lead somewhere."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from selenite import cli

ROOT = Path(__file__).resolve().parents[2]
GUIDE = ROOT / "docs" / "guide"
sys.path.insert(0, str(ROOT / "devtools"))

import capture_page  # noqa: E402
import command_page  # noqa: E402
import parameter_page  # noqa: E402


def test_page_of_parameters_is_the_native_table() -> None:
    from selenite import _core

    expected = parameter_page.page(_core.parameters())
    assert parameter_page.PAGE.read_text(encoding="utf-8") == expected, (
        "docs/guide/parameters.md is out of date: python devtools/parameter_page.py"
    )


def test_table_of_captures_is_that_of_their_declaration() -> None:
    text = capture_page.PAGE.read_text(encoding="utf-8")
    assert capture_page.page(text) == text, (
        "docs/guide/captures.md is out of date: python devtools/capture_page.py"
    )


def test_tables_of_options_are_those_of_the_parser() -> None:
    text = command_page.PAGE.read_text(encoding="utf-8")
    assert text.count("\n| `--") > 80  # the collector collects
    assert command_page.page(text) == text, (
        "docs/guide/command_line.md is out of date: python devtools/command_page.py"
    )


def test_tables_of_options_have_each_option_of_each_command() -> None:
    shared, *sections = "\n".join(command_page.table()).split("\n### Options of ")[1:]
    of_each = dict(section.partition("\n")[::2] for section in sections)
    for name, parser in command_page.commands().items():
        lines = [line for line in shared.splitlines() if re.search(rf"\b{name}\b.*\|$", line)]
        shown = set(re.findall(r"^\| .*?`(--[a-z-]+)", "\n".join([*lines, of_each[name]]), re.M))
        assert {row[0].split("`")[1] for row in command_page.rows(parser)} <= shown, name


def test_each_command_has_a_section_of_the_guide() -> None:
    headings = _anchors(command_page.PAGE)
    assert [name for name in command_page.commands() if name not in headings] == []


def test_no_option_of_the_guide_is_made_up() -> None:
    known = {"--json", "--command"}  # the latter is Blender's
    for action in cli.build_parser()._actions:
        for parser in (action.choices or {}).values():
            known |= {option for item in parser._actions for option in item.option_strings}
    for page in GUIDE.glob("*.md"):
        text = page.read_text(encoding="utf-8")
        options = re.findall(r"`(?:selenite [^`\n]*? )?(--[a-z][a-z-]+)", text)
        assert [option for option in options if option not in known] == [], page.name


def test_every_page_is_in_the_index() -> None:
    index = (GUIDE / "index.md").read_text(encoding="utf-8")
    pages = [path.name for path in GUIDE.glob("*.md") if path.name != "index.md"]
    assert [name for name in pages if f"({name})" not in index] == []


def _anchors(page: Path) -> set[str]:
    """Those of a page's headings: small letters, no punctuation, hyphens for spaces."""
    headings = re.findall(r"^#+ +(.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize(
    "page",
    [*sorted((ROOT / "docs").glob("*/*.md")), *sorted(ROOT.glob("*.md"))],
    ids=lambda path: path.relative_to(ROOT).as_posix(),
)
def test_links_lead_to_files_and_headings(page: Path) -> None:
    broken = []
    for link in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        if re.match(r"\w+:", link):
            continue  # an address of the web
        name, _, anchor = link.partition("#")
        target = (page.parent / name).resolve() if name else page
        if not target.is_file() or (anchor and anchor not in _anchors(target)):
            broken.append(link)
    assert not broken, "\n".join(broken)
