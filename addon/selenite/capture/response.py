# SPDX-License-Identifier: GPL-3.0-or-later
"""How a camera made code values of light: auto, srgb, linear, gamma:2.2, or a CSV."""

from __future__ import annotations

import math
import re
from pathlib import Path

from ..paths import why_not_file
from ..problems import Problem
from .request import AUTO_RESPONSE, GAMMA, RESPONSES

#: What the native reader takes: a name, an exponent, or rows (code value, red, green, blue).
NativeResponse = str | float | list[tuple[float, float, float, float]]

_PERMITTED = "give auto, srgb, linear, gamma:2.2, or a CSV of code values and light"
_LARGEST_TABLE = 10_000_000  # bytes


def read_response(text: str, problems: list[Problem]) -> NativeResponse | None:
    """None for "auto", which takes what the file says; None, with a problem, if there is none."""
    title = f"Response '{text}'"
    if text == AUTO_RESPONSE:
        return None
    if text in RESPONSES:
        return text
    try:
        if text.startswith(GAMMA):
            return _exponent(text.removeprefix(GAMMA))
        why = why_not_file(text)
        if why:
            raise ValueError(f"it is no name of a response, and as a file: {why}")  # noqa: TRY301
        return _table(Path(text))
    except (ValueError, OSError) as error:
        problems.append(Problem(title, str(error), _PERMITTED))
        return None


def _exponent(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.1 <= value <= 10:
        raise ValueError(f"its exponent '{text}' is no number in [0.1, 10]")
    return value


def _table(path: Path) -> list[tuple[float, float, float, float]]:
    """Rows of 2 numbers, code value and light, or of 4, code value and light of red, green, blue.
    A first line of words is passed over. Raises ValueError, OSError."""
    if path.stat().st_size > _LARGEST_TABLE:
        raise ValueError(f"it has more than {_LARGEST_TABLE} bytes")
    rows: list[tuple[float, float, float, float]] = []
    columns = 0
    for number, line in enumerate(path.read_text(encoding="utf-8-sig").splitlines(), 1):
        words = [word for word in re.split(r"[,;\s]+", line.strip()) if word]
        if not words or words[0].startswith("#"):
            continue
        try:
            values = [float(word) for word in words]
        except ValueError:
            if rows:
                raise ValueError(f"its line {number} holds '{line[:40]}', not numbers") from None
            continue
        columns = columns or len(values)
        if len(values) != columns or columns not in (2, 4):
            raise ValueError(f"its line {number} has {len(values)} numbers, not 2 or 4 as all")
        if not all(math.isfinite(value) and value >= 0 for value in values):
            raise ValueError(f"its line {number} holds a number that is not finite or below 0")
        red, green, blue = values[1:] * (1 if columns == 4 else 3)
        row = (values[0], red, green, blue)
        if values[0] > 1:
            raise ValueError(
                f"its code value {values[0]:g} in line {number} is above 1: divide code values by "
                "their top, 255 or 65535"
            )
        if rows and not (row[0] > rows[-1][0] and all(map(float.__ge__, row[1:], rows[-1][1:]))):
            raise ValueError(f"its line {number} does not rise: code values and light must")
        rows.append(row)
    if len(rows) < 2:
        raise ValueError(f"it has {len(rows)} rows of numbers, a table has at least 2")
    return rows
