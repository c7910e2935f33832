# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences of the add-on that its panel may show: every literal of two words or more that is no
docstring, with "{}" for what is filled in."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from selenite import parameters

ADDON = Path(__file__).resolve().parents[2] / "addon" / "selenite"
ROOMS = (
    "capture", "fit", "report", "advice", "environments", "interface", "scene_read", "write_back",
    "cycles_check", "importers", "grid_files.py", "json_text.py", "native.py",
    "problems.py",
)  # fmt: skip
#: Whose literals are no sentences for a user: pictures, files, tables of names, handlers.
NOT_SHOWN = (
    "report/pictures", "fit/old_names.py", "advice/trade/report.py", "cycles_check/worker.py",
    "interface/problem_words.py", "interface/furniture/links.py",
)  # fmt: skip
_NAMES = "_"  # in a word: a list of identifiers
_FILLED_LATER = re.compile(r"\{\w+\}")


def wanted() -> dict[str, str]:
    """Pattern -> a place where it stands."""
    found = {item.help: f"parameter {item.name}" for item in parameters.table().values()}
    for room in ROOMS:
        top = ADDON / room
        for path in sorted(top.rglob("*.py")) if top.is_dir() else [top]:
            place = path.relative_to(ADDON).as_posix()
            if not place.startswith(NOT_SHOWN):
                for line, text in _texts(path):
                    found.setdefault(text, f"{place}:{line}")
    return found


def is_sentence(text: str) -> bool:
    """Two lower-case words at least, and no list of identifiers."""
    words = text.replace("{}", " ").replace("'", " ").split()
    plain = [word for word in (item.strip(".,;:()") for item in words) if word.isalpha()]
    plain = [word for word in plain if word.islower()]
    names = sum(_NAMES in word for word in words)
    return len(plain) >= 2 and names * 3 <= len(words) and "\n" not in text


def _texts(path: Path) -> Iterator[tuple[int, str]]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    left_out = set()
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr):
            left_out.add(body[0].value)  # a docstring
        if isinstance(node, ast.JoinedStr):
            left_out |= set(node.values)
        if isinstance(node, ast.FormattedValue) and node.format_spec is not None:
            left_out |= {node.format_spec, *ast.walk(node.format_spec)}
        if isinstance(node, ast.AnnAssign) and getattr(node.target, "id", "").endswith("_NAMES"):
            left_out |= set(ast.walk(node))
        if isinstance(node, ast.Call) and _is_of_properties(node):
            left_out |= set(ast.walk(node))
    for node in ast.walk(tree):
        text = _pattern(node) if node not in left_out else None
        if text is not None and is_sentence(text):
            yield node.lineno, " ".join(_FILLED_LATER.sub("{}", text).split())


def _is_of_properties(node: ast.Call) -> bool:
    """Names of properties, and tooltips, which are Blender's to translate."""
    name = getattr(node.func, "id", getattr(node.func, "attr", ""))
    return name.endswith("Property") or name in {
        "modelled", "no_effect", "noise_only", "modelled_values", "warned_by_reader",
        "refused_by_reader", "remarked",
    }  # fmt: skip


def _pattern(node: ast.AST) -> str | None:
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else None
    if isinstance(node, ast.JoinedStr):
        parts = ["{}" if isinstance(x, ast.FormattedValue) else x.value for x in node.values]
        return "".join(parts)
    return None
