# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/measurements/constants.md names every member of every `Options` struct, with its value."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "measurements" / "constants.md"
STRUCT = re.compile(r"^struct (\w+Options) \{\n(.*?)^\};", re.MULTILINE | re.DOTALL)
#: A member with a default that is no struct of options itself: its name and the default.
MEMBER = re.compile(r"\b(\w+)\s*(?:=\s*([^,;]+?)|\{(\{\{.*?\}\}|[^{}]+)\})\s*(?=[,;])")


def options() -> dict[str, dict[str, str]]:
    """Members and defaults by struct, as the headers of native/fit have them."""
    found = {}
    for header in sorted((ROOT / "native" / "fit").rglob("*.h")):
        for name, body in STRUCT.findall(header.read_text(encoding="utf-8")):
            body = re.sub(r"//.*", "", body)
            body = re.sub(r"^  struct \w+ \{.*?^  \};", "", body, flags=re.MULTILINE | re.DOTALL)
            body = re.sub(r"^  static .*?^  \}", "", body, flags=re.MULTILINE | re.DOTALL)
            found[name] = {m[0]: m[1] or m[2] for m in MEMBER.findall(body)}
    return found


def rows() -> dict[str, dict[str, str]]:
    """Members and values by section of the page; what is in brackets is no member."""
    found: dict[str, dict[str, str]] = {}
    for section in PAGE.read_text(encoding="utf-8").split("\n## ")[1:]:
        name, _, body = section.partition("\n")
        found[name] = {}
        for names, value in re.findall(r"^\| (`[^(|]*`) \| (.*?) \|", body, re.MULTILINE):
            members = re.findall(r"`(\w+)`", names)
            values = value.split(", ") if len(members) > 1 else [value]
            found[name] |= dict(zip(members, values, strict=True))
    return found


def number(text: str) -> float | None:
    """The number that a default or a value of the page states; None for anything else."""
    text = re.sub(r"\$(\d+)\\cdot10\^\{(-?\d+)\}\$", r"\1e\2", text.strip())
    text = re.sub(r"\$10\^\{(-?\d+)\}\$", r"1e\1", text)
    if match := re.fullmatch(r"([\d.]+) ?/ ?([\d.]+)", text):
        return float(match[1]) / float(match[2])
    try:
        return float(text)
    except ValueError:
        return None


def test_structs_and_members_are_those_of_the_page() -> None:
    expected = {name: sorted(members) for name, members in options().items()}
    assert len(expected) > 15
    assert {name: sorted(members) for name, members in rows().items()} == expected


@pytest.mark.parametrize("struct", sorted(options()))
def test_values_are_those_of_the_page(struct: str) -> None:
    page = rows()[struct]
    compared = 0
    for member, default in options()[struct].items():
        value, said = number(default), number(page[member])
        if value is None or said is None or member == "share_of_samples":  # one of so many
            continue
        assert said == pytest.approx(value), member
        compared += 1
    assert compared > 0
