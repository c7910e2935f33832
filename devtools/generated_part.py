# SPDX-License-Identifier: GPL-3.0-or-later
"""The part of a page of the guide that a script writes, between two markers."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence

END = "<!-- end of the table -->"


def replaced(text: str, script: str, lines: Iterable[str]) -> str:
    """The page with these lines between the markers of a script, such as "node_page.py"."""
    begin = f"<!-- table: devtools/{script} -->"
    before, _, rest = text.partition(begin)
    _, _, after = rest.partition(END)
    return f"{before}{begin}\n" + "\n".join(lines) + f"\n{END}{after}"


def removed(text: str) -> str:
    """The page without its generated parts: what a hand has written."""
    return re.sub(rf"<!-- table: .*?{re.escape(END)}", "", text, flags=re.DOTALL)


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    """A table: its head, its rule, and each row on one line."""
    yield f"| {' | '.join(heads)} |"
    yield "|" + "---|" * len(heads)
    for row in rows:
        yield f"| {' | '.join(map(_cell, row))} |"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("<", "\\<")
