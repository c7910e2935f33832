# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts what the classes of a C++ source declare.

No C++ parser: it reads the plain declarations that this repository is made of. Comments, strings
and preprocessor lines are taken out first. Then a class is a sequence of statements, each of which
ends with `;` or with a body in braces.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

_NOISE = re.compile(
    r'R"\w*\((?:.|\n)*?\)\w*"'
    r'|"(?:\\.|[^"\\\n])*"'
    r"|(?<!\w)'(?:\\.|[^'\\\n])'"
    r"|//[^\n]*|/\*(?:.|\n)*?\*/"
    r"|^[ \t]*#(?:[^\n\\]|\\.|\\\n)*",
    re.MULTILINE,
)
#: The head of a definition: not `enum class`, no parameter of a template, no forward declaration.
_CLASS = re.compile(
    r"(?<!enum )(?<![<,])(?<![<,] )\b(class|struct)\s+(?:alignas\s*\([^()]*\)\s*)?"
    r"((?:\w+(?:<[^;{}()]*?>)?::)*\w+(?:<[^;{}()]*?>)?)\s*(?:final\s*)?(?::(?!:)[^;{}()]*)?\{"
)
_ACCESS = re.compile(r"\s*(public|private|protected)\s*:(?!:)")
_SPECIFIER = re.compile(r"\b(?:alignas|decltype|__attribute__|noexcept)\s*(?=\()")
_SKIPPED = re.compile(r"(using|typedef|friend|static_assert|enum|class|struct|union)\b")


@dataclass
class ClassBody:
    """A class or struct. A static member is a constant of its class, not one of its members."""

    name: str
    methods: int = 0  #: overloads, constructors, operators, deleted ones: each counts
    members: int = 0  #: non-static data
    hides: bool = False  #: something in it is not public: it is no plain value


def classes(source: str) -> list[ClassBody]:
    """All classes that a source defines, nested ones for themselves."""
    text = _NOISE.sub(lambda found: '""' if found[0][0] in "\"'R" else " ", source)
    found = []
    for head in _CLASS.finditer(text):
        body = text[head.end() : _closing(text, head.end() - 1)]
        found.append(_read(ClassBody(head[2]), body, is_open=head[1] == "struct"))
    return found


def _read(found: ClassBody, body: str, is_open: bool) -> ClassBody:
    for statement in _statements(body):
        if statement in ("public", "private", "protected"):
            is_open = statement == "public"
            continue
        text = _declaration(statement)
        if not text or _SKIPPED.match(text):
            continue
        if _is_function(text):
            found.methods += 1
        elif not re.match(r"(inline\s+)?static\b", text):
            found.members += len(_split(text))
        found.hides = found.hides or not is_open
    return found


def _statements(body: str) -> Iterator[str]:
    """Access labels, and declarations without their bodies."""
    start = at = 0
    while at < len(body):
        if body[start:at].strip() == "" and (label := _ACCESS.match(body, at)):
            yield label[1]
            start = at = label.end()
        elif body[at] == ";":
            yield body[start:at]
            start = at = at + 1
        elif body[at] in "([":
            at = _closing(body, at) + 1
        elif body[at] == "{":
            head, end = body[start:at], _closing(body, at) + 1
            if _goes_on_after_braces(head):
                at = end
                continue
            yield head
            semicolon = re.compile(r"\s*;").match(body, end)
            start = at = semicolon.end() if semicolon else end
        else:
            at += 1


def _goes_on_after_braces(head: str) -> bool:
    """Whether the braces after it are an initializer, not a body."""
    text = _declaration(head)
    if _SKIPPED.match(text):
        return False
    if not _is_function(text):
        return True
    # the list of a constructor, where a brace after a name starts the value of a member
    in_list = re.search(r"\)\s*(noexcept\s*)?:(?!:)", head)
    return bool(in_list) and head.rstrip()[-1] not in ")}"


def _declaration(statement: str) -> str:
    """Without template parameters, attributes and what an alignment or a type is made of."""
    text = re.sub(r"\[\[.*?\]\]", " ", statement, flags=re.DOTALL)
    text = " ".join(text.split())
    while text.startswith("template"):
        text = text[_angle_end(text, text.index("<")) :].strip()
        text = re.sub(r"^requires\s*\w[\w:]*(<[^<>]*>)?\s", "", text)
    while specifier := _SPECIFIER.search(text):
        end = _closing(text, text.index("(", specifier.start())) + 1
        type_name = " auto " if specifier[0] == "decltype" else " "
        text = (text[: specifier.start()] + type_name + text[end:]).strip()
    return re.sub(r"^(mutable|explicit|virtual|constexpr|inline)\s+(?=\w)", "", text)


def _is_function(text: str) -> bool:
    """A parenthesis outside of template arguments, and before any value."""
    if re.search(r"\boperator\b", text):
        return True
    depth = 0
    for character in text:
        depth += (character == "<") - (character == ">")
        if depth <= 0 and character in "={":
            return False
        if depth <= 0 and character == "(":
            return True
    return False


def _split(text: str) -> list[str]:
    """The declarators of a list: at commas outside of brackets of any kind."""
    parts, depth, start = [], 0, 0
    for at, character in enumerate(text):
        depth += (character in "<([{") - (character in ">)]}")
        if character == "," and depth == 0:
            parts.append(text[start:at])
            start = at + 1
    return [*parts, text[start:]]


def _angle_end(text: str, at: int) -> int:
    depth = 0
    while True:
        depth += (text[at] == "<") - (text[at] == ">")
        at += 1
        if depth == 0:
            return at


def _closing(text: str, at: int) -> int:
    """Of the bracket that opens there."""
    opening = text[at]
    closing = {"(": ")", "[": "]", "{": "}"}[opening]
    depth = 0
    for i in range(at, len(text)):
        depth += (text[i] == opening) - (text[i] == closing)
        if depth == 0:
            return i
    raise ValueError(f"{opening} is never closed: {text[at : at + 60]!r}")
