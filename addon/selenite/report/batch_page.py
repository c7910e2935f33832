# SPDX-License-Identifier: GPL-3.0-or-later
"""What a batch of fits has found: a table (.csv) with a row for each value, and a page (.html)."""

from __future__ import annotations

import csv
import html
import io
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from urllib.parse import quote

from ..atomic_files import write_bytes
from ..fit.checkpoint import RESULT
from ..problems import BadInput
from .result_file import stored_result
from .table import interval, number

TABLE, PAGE = "fits.csv", "index.html"
COLUMNS = (
    "fit", "status", "parameter", "channel", "start", "value", "low", "high", "determined",
    "seconds", "folder", "reason",
)  # fmt: skip
_CHANNELS = ("red", "green", "blue")


@dataclass(frozen=True)
class Value:
    """One number of a result. ends: of its 90 % interval; determined: None where that is open."""

    parameter: str
    channel: str
    start: float
    fitted: float
    ends: tuple[float, float] | None
    determined: bool | None

    @property
    def cells(self) -> tuple[str, ...]:
        """As in COLUMNS, in six digits."""
        low, high = ("", "") if self.ends is None else (f"{end:.6g}" for end in self.ends)
        word = {True: "yes", False: "no", None: ""}[self.determined]
        numbers = f"{self.start:.6g}", f"{self.fitted:.6g}"
        return self.parameter, self.channel, *numbers, low, high, word


@dataclass(frozen=True)
class Ended:
    """A fit of a batch. status: done, refused, failed or waiting; folder: of its result, from that
    of the batch; reasons: why there is none; words: what was asked for."""

    name: str
    words: tuple[str, ...]
    status: str
    folder: str = ""
    reasons: tuple[str, ...] = ()
    seconds: float = 0.0

    @property
    def in_short(self) -> str:
        """A few words for one line."""
        if self.status == "done":
            return f"done in {self.seconds:.0f} s"
        return f"{self.status}: {'; '.join(self.reasons)}" if self.reasons else self.status

    def is_there(self, out: Path) -> bool:
        """Whether its result is on disk."""
        return bool(self.folder) and (out / self.folder / RESULT).is_file()

    def as_json(self) -> dict[str, object]:
        """Plain values."""
        return asdict(self)

    @staticmethod
    def of_json(data: Mapping[str, object]) -> Ended:
        """The reverse of `as_json`. Raises KeyError, TypeError."""
        words, reasons = data["words"], data["reasons"]
        if not isinstance(words, list) or not isinstance(reasons, list):
            raise TypeError("words and reasons are lists")
        return Ended(
            str(data["name"]),
            tuple(map(str, words)),
            str(data["status"]),
            str(data["folder"]),
            tuple(map(str, reasons)),
            float(str(data["seconds"])),
        )


def write_pages(out: Path, fits: Sequence[Ended]) -> None:
    """Both files, whole. Raises OSError."""
    values = {one.name: list(_values(out / one.folder)) if one.folder else [] for one in fits}
    write_bytes(out / TABLE, _table(fits, values).encode())
    write_bytes(out / PAGE, _page(out, fits, values).encode())


def _values(folder: Path) -> Iterator[Value]:
    """Of result.json."""
    try:
        found = stored_result(folder).parameters
    except BadInput:
        return
    for name, one in found.items():
        channels = _CHANNELS if len(one.value) > 1 else ("",)
        starts = one.initial or (math.nan,) * len(one.value)
        pairs = one.interval_90 if len(one.interval_90) == len(one.value) else [None] * 3
        for channel, start, value, pair in zip(channels, starts, one.value, pairs, strict=False):
            yield Value(name, channel, start, value, pair, one.determined)


def _table(fits: Sequence[Ended], values: Mapping[str, Sequence[Value]]) -> str:
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(COLUMNS)
    for one in fits:
        rest = (f"{one.seconds:.1f}", one.folder, "; ".join(one.reasons))
        for cells in [value.cells for value in values[one.name]] or [("",) * 7]:
            writer.writerow((one.name, one.status, *cells, *rest))
    return text.getvalue()


_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2rem auto; max-width: 70rem; padding: 0 1rem;
  color: #1d2126; background: #fff; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin: 0 0 .4rem; }
section { border-top: 1px solid #d5d9de; padding: 1rem 0; display: flow-root; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { text-align: right; padding: .15rem .8rem .15rem 0; }
th { font-weight: 600; color: #59616b; }
th:first-child, td:first-child { text-align: left; }
figure { float: right; margin: 0 0 .5rem 1rem; text-align: center; color: #59616b; }
figure img { height: 9rem; display: block; border-radius: 4px; background: #eceff2; }
.wrong { color: #a3160e; } .open { color: #8a5a00; }
@media (prefers-color-scheme: dark) { body { color: #e4e7ea; background: #1b1e22; }
  section { border-color: #3a4048; } th, figure { color: #a2aab3; }
  figure img { background: #2a2f35; }
  .wrong { color: #ff8a80; } .open { color: #ffc46b; } a { color: #8ab8ff; } }
"""


def _page(out: Path, fits: Sequence[Ended], values: Mapping[str, Sequence[Value]]) -> str:
    counts = {word: sum(one.status == word for one in fits) for word in
              ("done", "refused", "failed", "waiting")}  # fmt: skip
    summary = ", ".join(f"{count} {word}" for word, count in counts.items() if count)
    wrong = [one for one in fits if one.status in ("refused", "failed")]
    parts = [
        "<!doctype html>",
        '<html lang="en"><head><meta charset="utf-8"><title>Fits</title>',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<style>{_STYLE}</style></head><body>",
        f"<h1>{len(fits)} fits: {summary}</h1>",
        f'<p><a href="{TABLE}">All values as a table</a></p>',
    ]
    if wrong:
        parts.append('<section><h2 class="wrong">Without a result</h2><ul>')
        parts += [f"<li><b>{_safe(one.name)}</b> {_safe(one.in_short)}</li>" for one in wrong]
        parts.append("</ul></section>")
    for one in fits:
        if one.folder:
            parts.append(_section(out, one, values[one.name]))
    parts.append("</body></html>\n")
    return "\n".join(parts)


def _section(out: Path, one: Ended, rows: Sequence[Value]) -> str:
    parts = ["<section>", *_pictures(out, one)]
    link = quote(Path(one.folder).as_posix())
    parts.append(f'<h2><a href="{link}/">{_safe(one.name)}</a></h2>')
    parts.append("<table><tr><th>parameter</th><th>start</th><th>fitted</th>")
    parts.append("<th>90 % interval</th><th>verdict</th></tr>")
    for row in rows:
        half = None if row.ends is None else (row.ends[1] - row.ends[0]) / 2
        verdict = {True: "determined", False: '<span class="open">not determined</span>', None: ""}
        cells = (
            _safe(f"{row.parameter} {row.channel}".strip()),
            number(row.start),
            number(row.fitted, half),
            "" if row.ends is None else interval(*row.ends),
            verdict[row.determined],
        )
        parts.append("<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
    parts.append(f"</table><p>{one.seconds:.0f} s</p></section>")
    return "\n".join(parts)


def _pictures(out: Path, one: Ended) -> Iterator[str]:
    """Photo and fit of the first photo, with links to the sheet of all."""
    folder = out / one.folder
    photo = next(iter(sorted(folder.glob("*_reference.png"))), None)
    if photo is None:
        return
    sheet = quote((Path(one.folder) / "contact_sheet.png").as_posix())
    stem = photo.name.removesuffix("_reference.png")
    for ending, title in (("optimised", "fit"), ("reference", "photo")):  # the last floats left
        source = quote((Path(one.folder) / f"{stem}_{ending}.png").as_posix())
        yield f'<figure><a href="{sheet}"><img src="{source}" alt="{title}"></a>{title}</figure>'


def _safe(text: str) -> str:
    return html.escape(text.encode(errors="backslashreplace").decode())
