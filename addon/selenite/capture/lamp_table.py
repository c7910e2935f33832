# SPDX-License-Identifier: GPL-3.0-or-later
"""Where lamps stood for each photo, from a table (.csv); see docs/guide/lights_of_captures.md."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

from ..paths import why_not_file

_NAMES = ("photo", "lamp")
_PLACE = ("x", "y", "z")
_ROTATION = ("qw", "qx", "qy", "qz")
_MATRIX = tuple(f"m{row}{column}" for row in range(4) for column in range(4))
#: For messages.
COLUMNS = "photo, lamp, and x, y, z (with or without qw, qx, qy, qz), or m00 to m33"


class LampTable:
    """The rows of a table by what they call the photo: {photo: {lamp: numbers}}."""

    def __init__(self, path: Path) -> None:
        """Raises ValueError, whose text says which row is wrong."""
        self.path = path
        if why := why_not_file(path):
            raise ValueError(f"its table '{path}' cannot be read ({why})")
        try:
            with path.open(newline="", encoding="utf-8-sig") as file:
                rows = list(csv.reader(file, strict=True))
        except (OSError, UnicodeDecodeError, csv.Error) as error:
            raise ValueError(f"its table '{path}' cannot be read ({error})") from error
        header = [name.strip().lower() for name in rows[0]] if rows else []
        columns = _columns(header, path)
        self._rows: dict[str, dict[str, list[float]]] = {}
        for number, row in enumerate(rows[1:], 2):
            if any(cell.strip() for cell in row):
                self._take(number, dict(zip(header, row, strict=False)), columns)

    def of(self, identity: str, photo: str) -> dict[str, object]:
        """Lamps of a photo: by its id, its file as it is given, its file's name with or without the
        ending. Raises ValueError where no row is about it."""
        names = (identity, photo, Path(photo).name, Path(photo).stem)
        for name in names:
            if name and name in self._rows:
                return dict(self._rows[name])
        raise ValueError(
            f"its table '{self.path}' has no row for it; "
            "the column 'photo' takes an id or a file name"
        )

    def _take(self, number: int, row: dict[str, str], columns: Sequence[str]) -> None:
        where = f"row {number} of its table '{self.path}'"
        photo, lamp = ((row.get(name) or "").strip() for name in _NAMES)
        if not photo or not lamp:
            raise ValueError(f"{where} names no photo or no lamp")
        numbers = []
        for name in columns:
            cell = (row.get(name) or "").strip()
            try:
                numbers.append(float(cell))
            except ValueError:
                raise ValueError(f"{where} has '{cell}' for {name}, not a number") from None
        lamps = self._rows.setdefault(photo, {})
        if lamp in lamps:
            raise ValueError(f"{where} moves lamp '{lamp}' of photo '{photo}' a second time")
        lamps[lamp] = numbers


def _columns(header: Sequence[str], path: Path) -> tuple[str, ...]:
    """The names of the columns with numbers, in the order in which a request takes them."""
    known = {*_NAMES, *_PLACE, *_ROTATION, *_MATRIX}
    have = set(header)
    for numbers in (_MATRIX, (*_PLACE, *_ROTATION), _PLACE):
        if have == {*_NAMES, *numbers} and len(header) == len(have):
            return numbers
    wrong = [name for name in header if name not in known]
    found = f"column '{wrong[0]}'" if wrong else f"the columns {', '.join(header) or 'of nothing'}"
    raise ValueError(f"its table '{path}' has {found}; it takes {COLUMNS}")
