# SPDX-License-Identifier: GPL-3.0-or-later
"""The part of a page of the guide that a script writes, between two markers."""

from __future__ import annotations

import re
from collections.abc import Iterable

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


def cell(text: str) -> str:
    """A text on one line of a table."""
    return " ".join(text.split()).replace("|", "\\|").replace("<", "\\<")
