# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages and progress on stderr; stdout belongs to --json."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress

#: Between two lines of progress where there is no terminal.
_SECONDS = 5.0
#: Who hears of progress beside the terminal, with (fraction, text).
_HEARS: list[Callable[[float, str], None]] = []
#: Of what the bars are a part, "" for the whole of a command.
_PART = [""]


def say(text: str) -> None:
    """One line on stderr. Where nobody reads it any more, or its disk is full, the work goes on."""
    shown = text.encode(errors="backslashreplace").decode()  # names of files that are not UTF-8
    with suppress(OSError, AttributeError):  # closed: None
        sys.stderr.write(shown + "\n")
        sys.stderr.flush()


def say_saved(file: object, kept: str) -> None:
    """That a .blend file is written. kept: the new name of what was there, or ""."""
    say(f"wrote {file}" + (f"; the file that was there is now {kept}" if kept else ""))


def table(titles: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Columns of text on stderr, numbers to the right."""
    lines = [titles, *rows]
    widths = [max(len(line[i]) for line in lines) for i in range(len(titles))]
    for line in lines:
        cells = [line[0].ljust(widths[0])]
        cells += [cell.rjust(width) for cell, width in zip(line[1:], widths[1:], strict=True)]
        say("  ".join(cells).rstrip())


class Bar:
    """A progress bar with seconds left; without `rich` or a terminal a line now and then."""

    #: When the newest line of any bar was said: bars that follow each other count as one.
    _last = -math.inf

    def __init__(self, title: str) -> None:
        self._title = title
        self._rich = None
        try:
            from rich.console import Console
            from rich.progress import BarColumn, Progress, TextColumn
        except ImportError:  # Blender's own Python
            return
        console = Console(file=sys.stderr)
        # Variables such as FORCE_COLOR make a terminal of any stream in the eyes of `rich`.
        if sys.stderr is not None and sys.stderr.isatty() and not console.is_dumb_terminal:
            columns = (
                TextColumn("{task.description}"),
                BarColumn(),
                TextColumn("{task.fields[note]}"),
            )
            self._rich = Progress(*columns, console=console, transient=True)
            self._task = self._rich.add_task(title, total=1.0, note="")
            self._rich.start()

    def update(self, fraction: float, seconds_left: float = math.nan, note: str = "") -> None:
        """`fraction` in [0, 1]; `seconds_left` NaN while unknown."""
        left = "" if math.isnan(seconds_left) else f"{seconds_left:.0f} s left"
        text = "  ".join(word for word in (_PART[0], note, left) if word)
        for hears in _HEARS:
            hears(fraction, text)
        if self._rich is not None:
            self._rich.update(self._task, completed=fraction, note=text)
        elif time.monotonic() - Bar._last > _SECONDS:
            Bar._last = time.monotonic()
            say(f"{self._title}: {fraction:.0%}  {text}")

    def close(self) -> None:
        """Removes the bar."""
        if self._rich is not None:
            self._rich.stop()


@contextmanager
def bar(title: str) -> Iterator[Bar]:
    """A bar that goes away whatever happens."""
    shown = Bar(title)
    try:
        yield shown
    finally:
        shown.close()


@contextmanager
def heard(by: Callable[[float, str], None]) -> Iterator[None]:
    """Progress also goes to a function."""
    _HEARS.append(by)
    try:
        yield
    finally:
        _HEARS.remove(by)


@contextmanager
def part(name: str) -> Iterator[None]:
    """Progress begins with the name of what it belongs to."""
    before, _PART[0] = _PART[0], name
    try:
        yield
    finally:
        _PART[0] = before
