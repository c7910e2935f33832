# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences of the native modules that the panel may show: of photos, scenes, renders and fits."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from message_texts import is_sentence

NATIVE = Path(__file__).resolve().parents[2] / "native"
ROOMS = ("image", "fit", "scene", "render", "model", "module")
#: Whose literals are docstrings and names of settings, or said to the module's own tests.
NOT_SHOWN = (
    "fit/solver/optimiser.cpp", "fit/photo/photo.h", "model/field_index.h", "model/probe.cpp",
    "module/probe_binding.cpp",
)  # fmt: skip
#: What `problems.problems_of` takes for the thing that a line is about: it is shown by itself.
_TITLE = re.compile(r"^(?:\{\}|[A-Z]\w+(?: '\{\}'| image| frame|[.:]\w+)?|\w+\.\w+): ")
_FILE = re.compile(
    r"^('\{\}' |(?:\{\})?(?=(?:has|is|says|stores|holds|lacks|begins|takes|connects|maps) ))"
)
_LITERAL = r'"(?:[^"\\\n]|\\.)*"'
_NO_CODE = re.compile(rf"{_LITERAL}|//[^\n]*|/\*.*?\*/|#include[^\n]*", re.DOTALL)
#: Between two literals of one message: an expression that is joined to both.
_FILLED = re.compile(r"\s*(?:\+[^;{}?]*\+|<<[^;{}?]*<<)\s*")
#: A problem is added in parts.
_ADDED = re.compile(rf"\b(?:add|refuse)\((?:{_LITERAL}|[^\";])*?\);")
#: The other literals of the bindings are docstrings.
_THROWN = re.compile(rf"\bthrow\b(?:{_LITERAL}|[^\";])*;")
_COMMA = re.compile(rf"({_LITERAL})|,")
_JOINED = re.compile(r"\s*(?:\+|<<)")


def wanted() -> dict[str, tuple[str, str]]:
    """Part of a message, with "{}" for what is filled in -> (the whole, the file where it stands).
    Messages of one part are their own whole."""
    found: dict[str, tuple[str, str]] = {}
    for room in ROOMS:
        for path in sorted((NATIVE / room).rglob("*")):
            place = path.relative_to(NATIVE).as_posix()
            if path.suffix in {".cpp", ".h", ".in"} and place not in NOT_SHOWN:
                code = path.read_text(encoding="utf-8")
                if room == "module":
                    code = "\n".join(_THROWN.findall(code))
                for text in _patterns(code):
                    whole = " ".join(text.split())
                    for part in _parts(whole, of_file=room == "image"):
                        if is_sentence(part):
                            found.setdefault(part, (whole, f"native/{place}"))
    return found


def _parts(text: str, *, of_file: bool) -> list[str]:
    """What is translated by itself: cause and cure. of_file: its name goes into the title, and the
    cause says "it", see `capture.photo_files.unreadable`."""
    if of_file:
        text = _FILE.sub("it ", text, count=1)
    text = _TITLE.sub("", text, count=1)
    text = re.sub(r"^\{\}(?=[a-z])|(?<=[a-z'])\{\}$", "", text)  # the rest of the line
    return [part.strip(" ;,:.(") for part in text.split("; ")]


def _patterns(code: str) -> Iterator[str]:
    code = _NO_CODE.sub(lambda item: item[0] if item[0][0] == '"' else " ", code)
    code = _ADDED.sub(lambda item: _COMMA.sub(lambda at: at[1] or "+", item[0]), code)
    text, end = None, 0
    for literal in re.finditer(_LITERAL, code):
        words = literal[0][1:-1].replace('\\"', '"').replace("\\n", "\n")
        between = code[end : literal.start()]
        end = literal.end()
        if text is not None and not between.strip(" \n+"):
            text += words
        elif text is not None and _FILLED.fullmatch(between):
            text += "{}" + words
        else:
            if text is not None:
                yield text + ("{}" if _JOINED.match(between) else "")
            text = ("{}" if re.search(r"(?:\+|<<)\s*$", between) else "") + words
    if text is not None:
        yield text + ("{}" if _JOINED.match(code[end:]) else "")
