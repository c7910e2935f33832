# SPDX-License-Identifier: GPL-3.0-or-later
"""A CSV file that grows by a row per run, so that a bench can be stopped and taken up."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

#: Columns of tables of earlier versions, and what they are called now.
_RENAMED = {
    "rivals": "alternative_minima",
    "settled": "converged",
    "settled_smallest_loss": "converged_smallest_loss",
}


def read(path: Path) -> list[dict[str, str]]:
    """Rows of earlier runs; none if there is no file."""
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return [{_RENAMED.get(name, name): value for name, value in row.items()} for row in rows]


def append(path: Path, line: dict[str, Any], columns: Sequence[str]) -> None:
    """Adds a row; rows of an older version get the columns that they lack."""
    write(path, [*read(path), line], columns)


def write(path: Path, rows: Sequence[dict[str, Any]], columns: Sequence[str]) -> None:
    """Replaces the file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(".partial.csv")
    with partial.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(
            file, columns, restval="", extrasaction="ignore", lineterminator="\n"
        )
        writer.writeheader()
        writer.writerows(rows)
    partial.replace(path)
