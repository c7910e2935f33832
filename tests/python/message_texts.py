# SPDX-License-Identifier: GPL-3.0-or-later
"""The messages of the add-on's sources: id -> English, with "{name}" for each argument."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

from selenite.capture.request import PROPERTIES

ADDON = Path(__file__).resolve().parents[2] / "addon" / "selenite"


def messages() -> dict[str, set[str]]:
    """Every `message` and `thing`; more than one English text of an id is a fault."""
    found: dict[str, set[str]] = {}
    for item in PROPERTIES:  # what their files are called
        if item.kind.file_of("x.csv"):
            found[f"thing.{item.name}"] = {f"{item.name.capitalize()} '{{name}}'"}
    for call in _calls("message", "thing"):
        if not isinstance(call.args[0], ast.Constant):
            continue
        first = ast.literal_eval(call.args[0])
        if call.func.id == "thing":
            found.setdefault(f"thing.{first.lower()}", set()).add(f"{first} '{{name}}'")
        else:
            found.setdefault(first, set()).add(ast.literal_eval(call.args[1]))
    return found


def arguments() -> dict[str, set[frozenset[str]]]:
    """Id -> the names that its calls give."""
    found: dict[str, set[frozenset[str]]] = {}
    for call in _calls("message"):
        names = frozenset(str(word.arg) for word in call.keywords)
        found.setdefault(ast.literal_eval(call.args[0]), set()).add(names)
    return found


def controls() -> set[str]:
    """The names of all that the panel says in words of its own."""
    return {ast.literal_eval(call.args[0]) for call in _calls("control")}


def _calls(*names: str) -> Iterator[ast.Call]:
    for path in sorted(ADDON.rglob("*.py")):
        if path.name == "messages.py":
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") in names:
                yield node
