# SPDX-License-Identifier: GPL-3.0-or-later
"""The tables of a PLY file: elements with properties, in text or binary.

Source: Greg Turk, "The PLY Polygon File Format". A file in text is read as one whose numbers are
all doubles, so that both have one reader.
"""

from __future__ import annotations

import re
import struct
from array import array
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from . import numbers
from .files import Place, read_bytes, shortened

#: NumPy's codes of the types, and struct's.
_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8",
}  # fmt: skip
_LETTERS = dict(zip(("i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8"), "bBhHiIfd", strict=True))
_ORDERS = {"ascii": "<", "binary_little_endian": "<", "binary_big_endian": ">"}
_MOST_HEADER = 1 << 16
_END = re.compile(rb"[\r\n]end_header[ \t]*(?:\r\n|\n|\r)")
_LINES = re.compile(r"\r\n|\n|\r")


@dataclass(frozen=True)
class Property:
    """kind: of a value. counted: the type of the number before a list, "" for a single value."""

    name: str
    kind: str
    counted: str = ""


@dataclass(frozen=True)
class Element:
    """So many rows of the same properties."""

    name: str
    count: int
    properties: tuple[Property, ...]


@dataclass(frozen=True)
class Column:
    """A property of all rows. values: of lists those of all, one after another. lengths: of each
    list, (rows,). kind: NumPy's code of the type that the file gives it."""

    values: np.ndarray
    lengths: np.ndarray
    kind: str


@dataclass(frozen=True)
class PlyTables:
    """Columns by the names of element and property; comments without the word."""

    elements: dict[str, dict[str, Column]]
    comments: tuple[str, ...]


def read_tables(file: Path) -> PlyTables:
    """All of a file. Raises ReconstructionError."""
    data, place = read_bytes(file), Place(file, "header")
    end = _END.search(data, 0, _MOST_HEADER)
    if not data.startswith(b"ply") or end is None:
        raise place.error("it is no PLY")
    try:
        lines = _LINES.split(data[: end.start()].decode("utf-8"))
    except UnicodeDecodeError as error:
        raise place.error("it is no text in UTF-8") from error
    form = next((line.split()[1:2] for line in lines if line.startswith("format")), [])
    if not form or form[0] not in _ORDERS:
        raise place.error(f"its format is not one of {', '.join(_ORDERS)}")
    elements = _elements(lines, place)
    at, stored = end.end(), elements
    if form == ["ascii"]:
        try:
            text = data[at:].decode("ascii")
        except UnicodeDecodeError as error:
            raise Place(file, "numbers").error("they are no text") from error
        data, at = numbers.numbers(text, Place(file, "numbers")).tobytes(), 0
        stored = [_of_doubles(element) for element in elements]
    found = {}
    for element, kept in zip(elements, stored, strict=True):
        rows = _Rows(data, at, _ORDERS[form[0]], kept, Place(file, element.name))
        columns, at = rows.read()
        found[element.name] = {
            own.name: Column(*column, own.kind)
            for own, column in zip(element.properties, columns, strict=True)
        }
    comments = [line.partition(" ")[2].strip() for line in lines if line.startswith("comment ")]
    return PlyTables(found, tuple(comments))


def _elements(lines: list[str], place: Place) -> list[Element]:
    found: list[Element] = []
    for line in lines:
        words = line.split()
        if words[:1] == ["element"] and len(words) == 3:
            count = numbers.whole(words[2], place)
            if not 0 <= count <= numbers.MOST_NUMBERS:
                cure = "reduce the mesh"
                raise place.error(f"it has {count} of {shortened(words[1])}", cure)
            if any(element.name == words[1] for element in found):
                raise place.error(f"the element {shortened(words[1])} comes twice")
            found.append(Element(words[1], count, ()))
        elif words[:1] in (["element"], ["property"]):
            own = _property(words)
            if own is None or not found:
                raise place.error(f"'{shortened(line)}' is no element or property")
            found[-1] = replace(found[-1], properties=(*found[-1].properties, own))
    if any(element.count and not element.properties for element in found):
        raise place.error("an element has no property")
    return found


def _property(words: list[str]) -> Property | None:
    if len(words) == 3 and words[1] in _TYPES:
        return Property(words[2], _TYPES[words[1]])
    if len(words) != 5 or words[1] != "list" or not {words[2], words[3]} <= set(_TYPES):
        return None
    counted = _TYPES[words[2]]
    return None if counted.startswith("f") else Property(words[4], _TYPES[words[3]], counted)


def _of_doubles(element: Element) -> Element:
    properties = [
        replace(own, kind="f8", counted="f8" if own.counted else "") for own in element.properties
    ]
    return replace(element, properties=tuple(properties))


#: Of each property, values and lengths as a Column has them; and where the rows end.
_Read = tuple[list[tuple[np.ndarray, np.ndarray]], int]


class _Rows:
    """The rows of an element, from a place in the data on."""

    def __init__(self, data: bytes, at: int, order: str, element: Element, place: Place) -> None:
        self._data, self._at, self._order, self._place = data, at, order, place
        self._count, self._properties = element.count, element.properties
        least = sum(np.dtype(own.counted or own.kind).itemsize for own in self._properties)
        if element.count * least > len(data) - at:
            raise self._too_short()

    def read(self) -> _Read:
        """All of them. Raises ReconstructionError."""
        first, _ = self._one_by_one(min(self._count, 1))
        if self._count == 0:
            return first, self._at
        alike = self._all_as([int(each[0]) for _, each in first])
        return self._one_by_one(self._count) if alike is None else alike

    def _too_short(self) -> Exception:
        return self._place.error(f"it ends before the last of its {self._count} rows")

    def _all_as(self, lengths: list[int]) -> _Read | None:
        """If all rows have lists of these lengths; None otherwise."""
        fields: list[tuple] = []
        for index, (own, length) in enumerate(zip(self._properties, lengths, strict=True)):
            if own.counted:
                fields.append((f"count {index}", self._order + own.counted))
            fields.append((f"{index}", self._order + own.kind, (length,)))
        row = np.dtype(fields)
        end = self._at + self._count * row.itemsize
        if end > len(self._data):
            return None
        rows = np.frombuffer(self._data, row, self._count, self._at)
        columns = []
        for index, (own, length) in enumerate(zip(self._properties, lengths, strict=True)):
            if own.counted and (rows[f"count {index}"] != length).any():
                return None
            columns.append((rows[f"{index}"].reshape(-1), np.full(self._count, length)))
        return columns, end

    def _one_by_one(self, count: int) -> _Read:
        at, total = self._at, 0
        values = [array("d") for _ in self._properties]
        lengths = [array("q") for _ in self._properties]
        for _ in range(count):
            for index, own in enumerate(self._properties):
                number = 1.0
                if own.counted:
                    (number,), at = self._unpacked(own.counted, 1, at)
                    if not 0 <= number <= numbers.MOST_NUMBERS or number != int(number):
                        raise self._place.error(f"a list of it has {number:g} entries")
                found, at = self._unpacked(own.kind, int(number), at)
                values[index].extend(found)
                lengths[index].append(int(number))
                total += int(number)
            if total > numbers.MOST_NUMBERS:
                cause = f"it has more than {numbers.MOST_NUMBERS} numbers"
                raise self._place.error(cause, "reduce the mesh")
        columns = [
            (np.array(own, np.float64), np.array(each, np.int64))
            for own, each in zip(values, lengths, strict=True)
        ]
        return columns, at

    def _unpacked(self, kind: str, count: int, at: int) -> tuple[tuple, int]:
        end = at + count * np.dtype(kind).itemsize
        if end > len(self._data):
            raise self._too_short()
        return struct.unpack_from(f"{self._order}{count}{_LETTERS[kind]}", self._data, at), end
