# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual says what the code does."""

from __future__ import annotations

import sys
from pathlib import Path

from selenite import cli

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "devtools"))

import parameter_page  # noqa: E402


def test_page_of_parameters_is_the_native_table() -> None:
    from selenite import _core

    expected = parameter_page.page(_core.parameters())
    assert parameter_page.PAGE.read_text(encoding="utf-8") == expected, (
        "docs/manual/parameters.md is out of date: python devtools/parameter_page.py"
    )


def test_every_option_of_the_command_line_is_in_the_manual() -> None:
    text = (ROOT / "docs" / "manual" / "command_line.md").read_text(encoding="utf-8")
    commands = next(
        action.choices for action in cli.build_parser()._actions if action.dest == "command"
    )
    for name, parser in commands.items():
        assert f"selenite {name}" in text
        for action in parser._actions:
            for option in action.option_strings:
                if option.startswith("--") and option != "--help":
                    assert option in text, f"{name} {option}"
