# SPDX-License-Identifier: GPL-3.0-or-later
"""The guide's tables of options, from the parser of the command line; a test compares the committed
page.

Run as a script it rewrites docs/guide/command_line.md.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import generated_part

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "guide" / "command_line.md"
SCRIPT = Path(__file__).name

#: Flags, values, help: a row of a table.
Row = tuple[str, str, str]


def commands() -> dict[str, argparse.ArgumentParser]:
    """Name -> parser."""
    from selenite import cli

    for action in cli.build_parser()._actions:
        if action.dest == "command":
            return dict(action.choices or {})  # type: ignore[call-overload, no-any-return]
    raise LookupError("the command line has no commands")


def _values(action: argparse.Action) -> str:
    if action.choices is not None:
        return "|".join(str(choice) for choice in action.choices)
    if action.nargs == 0:
        return ""
    named = action.metavar or action.dest.upper()
    return named if isinstance(named, str) else " ".join(named)


def _row(action: argparse.Action) -> Row:
    flags = ", ".join(f"`{flag}`" for flag in action.option_strings)
    values = _values(action)
    text = (action.help or "") % {"default": action.default}
    return flags, f"`{values}`" if values else "", text


def rows(parser: argparse.ArgumentParser) -> list[Row]:
    """Of the options of one command, but those of every command."""
    general = {"--help", "--json"}
    return [
        _row(action)
        for action in parser._actions
        if action.option_strings and not general & set(action.option_strings)
    ]


def synopsis(name: str, parser: argparse.ArgumentParser) -> str:
    """The command with what it takes besides options."""
    words = [action for action in parser._actions if not action.option_strings]
    needed = [
        f"{action.option_strings[0]} {_values(action)}"
        for action in parser._actions
        if action.required and action.option_strings
    ]
    places = [f"[{_values(a)}]" if a.nargs == "?" else _values(a) for a in words]
    return " ".join(["selenite", name, *places, *needed, "[options]"])


def table() -> Iterator[str]:
    """Lines of Markdown: the options of several commands, then those of each."""
    own = {name: rows(parser) for name, parser in commands().items()}
    users: dict[Row, list[str]] = {}
    for name, found in own.items():
        for row in found:
            users.setdefault(row, []).append(name)
    shared = [(*row, ", ".join(names)) for row, names in users.items() if len(names) > 1]
    yield from ("", "### Options of several commands", "")
    yield from generated_part.table(("option", "value", "meaning", "of"), shared)
    for name, parser in commands().items():
        alone = [row for row in own[name] if len(users[row]) == 1]
        yield from ("", f"### Options of {name}", "", f"`{synopsis(name, parser)}`")
        if alone:
            yield from ("", *generated_part.table(("option", "value", "meaning"), alone))
    yield ""


def page(text: str) -> str:
    """The page with its tables as the parser has them now."""
    return generated_part.replaced(text, SCRIPT, table())


def main() -> None:
    sys.path.insert(0, str(ROOT / "addon"))
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
