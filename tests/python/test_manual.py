# SPDX-License-Identifier: GPL-3.0-or-later
"""The guide says what the code does, and its links lead somewhere."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from selenite import cli
from selenite.capture.request import PROPERTIES

ROOT = Path(__file__).resolve().parents[2]
GUIDE = ROOT / "docs" / "guide"
sys.path.insert(0, str(ROOT / "devtools"))

import capture_page  # noqa: E402
import parameter_page  # noqa: E402


def test_page_of_parameters_is_the_native_table() -> None:
    from selenite import _core

    expected = parameter_page.page(_core.parameters())
    assert parameter_page.PAGE.read_text(encoding="utf-8") == expected, (
        "docs/guide/parameters.md is out of date: python devtools/parameter_page.py"
    )


def test_tables_of_captures_are_those_of_the_declaration() -> None:
    text = capture_page.PAGE.read_text(encoding="utf-8")
    assert capture_page.page(text) == text, (
        "docs/guide/captures.md is out of date: python devtools/capture_page.py"
    )


def test_each_synopsis_of_the_guide_has_the_options_of_its_command() -> None:
    text = (GUIDE / "command_line.md").read_text(encoding="utf-8")
    commands = next(
        action.choices for action in cli.build_parser()._actions if action.dest == "command"
    )
    for name, parser in commands.items():
        wanted = {
            option
            for action in parser._actions
            for option in action.option_strings
            if option.startswith("--") and option not in ("--help", "--json")  # of every command
        }
        section = text.partition(f"\n## {name}\n")[2].partition("\n## ")[0]
        shown = re.findall(r"^`?(selenite .*?)(?:`$|\n```|\n(?=selenite ))", section, re.M | re.S)
        assert shown, name
        found = {option for form in shown for option in re.findall(r"--[a-z-]+", form)}
        if any("[CAPTURES]" in form for form in shown):
            found |= {"--photo", "--captures", *(item.flag for item in PROPERTIES if item.option)}
        assert found == wanted


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
    [*sorted(GUIDE.glob("*.md")), ROOT / "README.md", ROOT / "CONTRIBUTING.md"],
    ids=lambda path: path.name,
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
