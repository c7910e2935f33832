# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows of now beside those recorded: the table in Markdown, and what got worse."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

Row = dict[str, Any]
#: A loss is more than this beyond the spread of the seeds.
MORE = 0.1
#: Errors below are as good as none: nobody sees half a percent.
SMALL_ERROR = 0.005
COLUMNS = (
    "processor", "revision", "what", "name", "seed", "mean_error", "worst_error", "worst",
    "determined_error", "right", "intervals", "hold", "undetermined", "unsaid", "cpu_seconds",
    "peer_seconds", "ratio", "stopped", "values",
)  # fmt: skip


def worse(now: Sequence[float], then: Sequence[float], floor: float = 0.0) -> bool:
    """Whether the mean of what should be small grew by more than MORE and the spread: the root of
    the sum of both variances, 0 of a single value. Means up to `floor` are never worse."""
    if not len(now) or not len(then):
        return False
    spread = np.sqrt(sum(np.var(some, ddof=1) if len(some) > 1 else 0.0 for some in (now, then)))
    limit = (1 + MORE) * np.mean(then) + spread
    return bool(np.mean(now) > max(limit, floor) + 1e-9)


def losses(now: Sequence[Row], then: Sequence[Row]) -> list[str]:
    """Sentences, one for each loss. Totals count only bodies that both have."""
    found = [f"{row['name']}, seed {row['seed']}: {row['stopped']}" for row in now if _failed(row)]
    for name in dict.fromkeys(row["name"] for row in now):
        ours, theirs = _of(now, name), _of(then, name)
        if not theirs:
            continue
        for column, label, floor in (
            ("determined_error", "mean error of determined values", SMALL_ERROR),
            ("cpu_seconds", "CPU seconds", 0.0),
        ):
            if ours[0]["what"] == "race":
                continue
            a, b = _numbers(ours, column), _numbers(theirs, column)
            if worse(a, b, floor):
                found.append(f"{name}: {label} {np.mean(a):.4g}, {np.mean(b):.4g} recorded")
        found += _race_lost(name, ours, theirs)
    both = {row["name"] for row in now if row["what"] == "fit"} & {row["name"] for row in then}
    ours, theirs = ([row for row in some if row["name"] in both] for some in (now, then))
    for label, of_row in _TOTALS.items():
        a, b = _by_seed(ours, of_row), _by_seed(theirs, of_row)
        if worse(a, b):
            found.append(f"all bodies: {label} {np.mean(a):.3g}, {np.mean(b):.3g} recorded")
    return found


def _race_lost(name: str, ours: list[Row], theirs: list[Row]) -> list[str]:
    """Only where both our time and the ratio got worse: the load of the machine changes the one,
    and the peer's own time, which varies by a quarter, the other."""
    seconds, before = _numbers(ours, "cpu_seconds"), _numbers(theirs, "cpu_seconds")
    ratio, recorded = _numbers(ours, "ratio"), _numbers(theirs, "ratio")
    slower = worse(seconds, before)
    if not slower or not worse([1 / x for x in ratio], [1 / x for x in recorded]):
        return []
    then = f"{np.mean(recorded):.2f} and {np.mean(before):.3f} s recorded"
    return [f"{name}: ratio {np.mean(ratio):.2f} and {np.mean(seconds):.3f} s, {then}"]


def _failed(row: Row) -> bool:
    return str(row.get("stopped", "")).startswith("failed")


def _of(rows: Sequence[Row], name: str) -> list[Row]:
    return [row for row in rows if row["name"] == name]


def _numbers(rows: Sequence[Row], column: str) -> list[float]:
    return [float(row[column]) for row in rows if row.get(column) not in (None, "")]


def _words(row: Row, column: str) -> int:
    return len(str(row.get(column) or "").split())


def _missed(row: Row) -> float:
    return float(row.get("intervals") or 0) - float(row.get("hold") or 0)


#: What should be small, summed over the bodies for each seed.
_TOTALS: dict[str, Callable[[Row], float]] = {
    "fits that are not right": lambda row: 1.0 - float(row.get("right") or 0),
    "intervals that do not hold": _missed,
    "values called undetermined": lambda row: _words(row, "undetermined"),
    "values with neither": lambda row: _words(row, "unsaid"),
}


def _by_seed(rows: Sequence[Row], of_row: Callable[[Row], float]) -> list[float]:
    seeds = sorted({row["seed"] for row in rows})
    return [sum(of_row(row) for row in rows if row["seed"] == seed) for seed in seeds]


def table(now: Sequence[Row], then: Sequence[Row], processor: str) -> str:
    """Markdown; numbers recorded stand in brackets."""
    revision = then[0]["revision"] if then else ""
    text = f"{processor}; recorded: {revision or 'nothing of this kind of processor'}\n\n"
    races = [row for row in now if row["what"] == "race"]
    if races:
        text += "| race | Selenite, CPU s | Mitsuba, CPU s | ratio |\n|---|---|---|---|\n"
        for row in races:
            known = _of(then, row["name"])
            cells = [row["name"][5:]]
            for column in ("cpu_seconds", "peer_seconds", "ratio"):
                cells.append(f"{row[column]}{_before(_numbers(known, column), '.3f')}")
            text += "| " + " | ".join(cells) + " |\n"
        text += "\n"
    fits = [row for row in now if row["what"] == "fit"]
    if not fits:
        return text
    text += (
        "| body | fits | mean error | worst error | of determined values | right | intervals hold "
        "| undetermined | neither | CPU s | stopped because |\n"
        "|---|---|---|---|---|---|---|---|---|---|---|\n"
    )
    names = list(dict.fromkeys(row["name"] for row in fits))
    for name in names:
        text += _line(name, _of(fits, name), _of(then, name))
    if len(names) > 1:
        known = [row for row in then if row["name"] in names]
        text += _line("all", fits, known)
    return text


def _line(name: str, ours: list[Row], theirs: list[Row]) -> str:
    cells = [name, str(len(ours))]
    for column in ("mean_error", "worst_error", "determined_error"):
        mine = _numbers(ours, column)
        spread = f" ± {np.std(mine, ddof=1):.3f}" if len(mine) > 1 else ""
        value = f"{np.mean(mine):.4f}{spread}" if mine else "-"
        cells.append(value + _before(_numbers(theirs, column), ".4f"))
    for count in (
        lambda rows: f"{sum(_numbers(rows, 'right')):.0f}",
        lambda rows: f"{sum(_numbers(rows, 'hold')):.0f}/{sum(_numbers(rows, 'intervals')):.0f}",
        lambda rows: str(sum(_words(row, "undetermined") for row in rows)),
        lambda rows: str(sum(_words(row, "unsaid") for row in rows)),
    ):
        cells.append(count(ours) + (f" ({count(theirs)})" if theirs else ""))
    seconds = _numbers(ours, "cpu_seconds")
    value = f"{np.mean(seconds):.0f}" if seconds else "-"
    cells.append(value + _before(_numbers(theirs, "cpu_seconds"), ".0f"))
    reasons = [str(row["stopped"]) for row in ours]
    cells.append("; ".join(f"{reasons.count(one)} {one}" for one in dict.fromkeys(reasons)))
    return "| " + " | ".join(cells) + " |\n"


def _before(values: Sequence[float], form: str) -> str:
    return f" ({np.mean(values):{form}})" if len(values) else ""
