# SPDX-License-Identifier: GPL-3.0-or-later
"""One line for what is said of many photos alike: a capture of a hundred photos has no hundred
lines to say that none of them is there."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import PurePath

from ..problems import listed

#: What a line may be of, its name, and what is said of it.
_OF_ONE = re.compile(r"(Photo|Mask|Exclude|Camera) '([^']*)'([^':]*: .*)", re.DOTALL)
_NUMBER = re.compile(r"\d+(?:\.\d+)?")
#: Lines that stand alone; of more, one says how many and names the first of them.
_MOST_ALONE, _NAMED = 3, 3


def grouped(lines: Iterable[str]) -> list[str]:
    """The lines, in their order. Where more than three say the same of photos, masks or cameras but
    for numbers, one stands for all, with the least and the largest of each number."""
    groups: dict[tuple[str, str], list[tuple[str, str]]] = {}
    for line in lines:
        match = _OF_ONE.fullmatch(line)
        kind, name, said = match.groups() if match else ("", "", line)
        key = (kind, _NUMBER.sub("#", said)) if match else ("", line)
        groups.setdefault(key, []).append((name, said))
    found = []
    for (kind, _), members in groups.items():
        if not kind:
            found += [said for _, said in members]
        elif len(members) <= _MOST_ALONE:
            found += [f"{kind} '{name}'{said}" for name, said in members]
        else:
            names = [PurePath(name.replace("\\", "/")).name or name for name, _ in members]
            more = f" and {len(names) - _NAMED} more"
            said = _in_ranges([said for _, said in members])
            found.append(f"{len(names)} {kind.lower()}s ({listed(names[:_NAMED])}{more}){said}")
    return found


def _in_ranges(texts: list[str]) -> str:
    """One text for all, which differ in numbers alone."""
    columns = list(zip(*(_NUMBER.findall(text) for text in texts), strict=True))

    def of_column(column: tuple[str, ...]) -> str:
        low, high = min(column, key=float), max(column, key=float)
        return low if low == high else f"{low} to {high}"

    shown = iter([of_column(column) for column in columns])
    return _NUMBER.sub(lambda _: next(shown), texts[0])
