# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether two folders of results hold the same bits: the first difference, in words.

Times, places, versions and words for humans that name a file do not count; names that a revision
has changed are brought to the new ones (`renamed`).
"""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from golden import renamed

#: Files that say nothing about results, or say them in sentences of their own.
_NOT_COMPARED = frozenset({"done.json", "log.txt", "run.json"})
#: Folders likewise.
_NOT_ENTERED = frozenset({"interrupted", "fits"})
#: Where a .vdb file holds a name that is drawn anew whenever it is written.
_VDB_NAME = slice(21, 57)
ReadPicture = Callable[[str], np.ndarray]


def difference(
    one: Path, other: Path, read_picture: ReadPicture, left_out: Collection[str] = ()
) -> str:
    """Between two folders of one case; "" where they are equal. left_out: more keys of JSON
    objects that do not count."""
    files, others = _files(one), _files(other)
    if not files and not others:
        return "there are no results"
    if files.keys() != others.keys():
        missing, added = files.keys() - others.keys(), others.keys() - files.keys()
        return f"files: {sorted(missing)} before, {sorted(added)} now"
    for name, path in sorted(files.items()):
        found = _file_difference(path, others[name], (one, other), read_picture, left_out)
        if found:
            return f"{name}: {found}"
    return ""


def _files(folder: Path) -> dict[str, Path]:
    found = {}
    for path in folder.rglob("*"):
        name = path.relative_to(folder)
        if path.is_file() and path.name not in _NOT_COMPARED and name.parts[0] not in _NOT_ENTERED:
            # The report of a fit is its result.json, and lines about files.
            if str(name) == "report.json" and (folder / "result").is_dir():
                continue
            new_name = renamed.FILES.get(path.name, path.name)
            found[str(name.with_name(new_name))] = path
    return found


def _file_difference(
    one: Path,
    other: Path,
    folders: tuple[Path, Path],
    read_picture: ReadPicture,
    left_out: Collection[str],
) -> str:
    if one.suffix == ".json":
        texts = [
            path.read_text(encoding="utf-8").replace(str(folder), "FOLDER")
            for path, folder in zip((one, other), folders, strict=True)
        ]
        first_value, second_value = map(json.loads, texts)
        return json_difference(first_value, second_value, left_out=left_out)
    if one.suffix == ".csv":
        return table_difference(*(_rows(path) for path in (one, other)))
    first, second = (bytearray(path.read_bytes()) for path in (one, other))
    if one.suffix == ".vdb":
        first[_VDB_NAME] = second[_VDB_NAME] = bytes(36)
    if first == second:
        return ""
    if one.suffix in (".exr", ".png"):  # the file may hold a date or a version
        return array_difference(read_picture(str(one)), read_picture(str(other)))
    if one.suffix == ".npy":
        found = array_difference(np.load(one), np.load(other))
        return found or "the header of the array"
    if len(first) != len(second):
        return f"{len(first)} bytes before, {len(second)} now"
    index = next(i for i, (a, b) in enumerate(zip(first, second, strict=True)) if a != b)
    return f"byte {index} is {first[index]:#04x} before, {second[index]:#04x} now"


def json_difference(one: Any, other: Any, place: str = "", left_out: Collection[str] = ()) -> str:
    """Of what `json.loads` gives; numbers are equal where every bit is. left_out: more keys that
    do not count."""
    if isinstance(one, dict) and isinstance(other, dict):
        first, second = (_renamed(item, left_out) for item in (one, other))
        for key in renamed.ADDED - first.keys():
            second.pop(key, None)
        if first.keys() != second.keys():
            lost, added = first.keys() - second.keys(), second.keys() - first.keys()
            return f"{place or 'keys'}: {sorted(lost)} before, {sorted(added)} now"
        for key in first:
            found = json_difference(first[key], second[key], f"{place}/{key}", left_out)
            if found:
                return found
        return ""
    if isinstance(one, list) and isinstance(other, list):
        if len(one) != len(other):
            return f"{place}: {len(one)} items before, {len(other)} now"
        for index, (a, b) in enumerate(zip(one, other, strict=True)):
            found = json_difference(a, b, f"{place}[{index}]", left_out)
            if found:
                return found
        return ""
    if isinstance(one, str) and isinstance(other, str):
        one, other = new_text(one), new_text(other)
    # The representation tells -0.0 from 0.0 and 1 from 1.0, and is exact.
    return "" if repr(one) == repr(other) else f"{place}: {one!r} before, {other!r} now"


def _renamed(item: Mapping[str, Any], left_out: Collection[str]) -> dict[str, Any]:
    """Under new names, without what does not count. Raises ValueError where two become one."""
    found: dict[str, Any] = {}
    for key, value in item.items():
        if key in renamed.LEFT_OUT or key in left_out:
            continue
        new_key = renamed.KEYS.get(key, key)
        if new_key in found:
            raise ValueError(f"'{new_key}' is there twice, once by its old name")
        found[new_key] = value
    return found


def new_text(text: str) -> str:
    """In the words of the newest revision."""
    for old, new in renamed.TEXTS:
        text = text.replace(old, new)
    return text


def _rows(path: Path) -> list[list[str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.reader(file))


def table_difference(one: list[list[str]], other: list[list[str]]) -> str:
    """Of two tables with a header, by the text of each cell."""
    if not one or not other:
        return "" if one == other else "one of the tables is empty"
    head, second = ([renamed.KEYS.get(name, name) for name in rows[0]] for rows in (one, other))
    if head != second:
        return f"columns {head} before, {second} now"
    for number, (row, changed) in enumerate(zip(one[1:], other[1:], strict=False), start=1):
        if len(row) != len(changed):
            return f"row {number}: {len(row)} cells before, {len(changed)} now"
        for name, a, b in zip(head, row, changed, strict=False):
            if a != b and name not in renamed.LEFT_OUT:
                return f"row {number}, {name}: {a} before, {b} now"
    return "" if len(one) == len(other) else f"{len(one) - 1} rows before, {len(other) - 1} now"


def array_difference(one: np.ndarray, other: np.ndarray) -> str:
    """Of shape, type, or the bits of an element."""
    if (one.shape, one.dtype) != (other.shape, other.dtype):
        return f"{one.dtype}{one.shape} before, {other.dtype}{other.shape} now"
    first, second = (np.ascontiguousarray(item).view(np.uint8) for item in (one, other))
    places = np.argwhere((first != second).reshape(one.size, -1).any(axis=1))
    if not len(places):
        return ""
    index = tuple(int(i) for i in np.unravel_index(int(places[0][0]), one.shape))
    values = f"{one[index]!r} before, {other[index]!r} now"
    return f"{len(places)} of {one.size} numbers; at {index} {values}"
