# SPDX-License-Identifier: GPL-3.0-or-later
"""One line for what is said of many photos alike: a capture of a hundred photos has no hundred
lines to say that none of them is there."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import PurePath

from ..messages import rendered, subject
from ..problems import listed

#: What many lines may say the same of.
_OF_MANY = ("photo", "mask", "exclude", "camera")
_NUMBER = re.compile(r"\d+(?:\.\d+)?")
#: Lines that stand alone; of more, one says how many and names the first of them.
_MOST_ALONE, _NAMED = 3, 3
_PLACE = "\0"  # of the thing, in what is said of it


def grouped(lines: Iterable[str]) -> list[str]:
    """The lines, in their order. Where more than three say the same of photos, masks or cameras but
    for numbers, one stands for all, with the least and the largest of each number."""
    groups: dict[tuple[str, str], list[tuple[str, str, str]]] = {}
    for line in lines:
        kind, name = subject(line)
        said = rendered(line, {f"thing.{kind}": _PLACE}.get) if kind in _OF_MANY else ""
        key = (kind, _NUMBER.sub("#", said)) if said else ("", line)
        groups.setdefault(key, []).append((line, name, said))
    found = []
    for (kind, _), members in groups.items():
        if not kind or len(members) <= _MOST_ALONE:
            found += [line for line, _, _ in members]
            continue
        names = [PurePath(name.replace("\\", "/")).name or name for _, name, _ in members]
        more = f" and {len(names) - _NAMED} more"
        all_of_them = f"{len(names)} {kind}s ({listed(names[:_NAMED])}{more})"
        found.append(_in_ranges([said for *_, said in members]).replace(_PLACE, all_of_them))
    return found


def _in_ranges(texts: list[str]) -> str:
    """One text for all, which differ in numbers alone."""
    columns = list(zip(*(_NUMBER.findall(text) for text in texts), strict=True))

    def of_column(column: tuple[str, ...]) -> str:
        low, high = min(column, key=float), max(column, key=float)
        return low if low == high else f"{low} to {high}"

    shown = iter([of_column(column) for column in columns])
    return _NUMBER.sub(lambda _: next(shown), texts[0])
