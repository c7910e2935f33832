# SPDX-License-Identifier: GPL-3.0-or-later
"""The guide's tables of a capture, from its declaration; `./dev test` compares the committed page.

Run as a script it rewrites them in docs/guide/captures.md.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from selenite.capture.capture_property import CaptureProperty

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "guide" / "captures.md"
START = "<!-- From the declaration of a capture, by devtools/capture_page.py. -->"
END = "<!-- Until here. -->"


def page(text: str) -> str:
    """The whole page with its tables as they have to be."""
    before, _, rest = text.partition(START)
    return f"{before}{START}\n\n{tables()}\n{END}{rest.partition(END)[2]}"


def tables() -> str:
    """A row for each key, and one for each that the panel or the command line has."""
    from selenite.capture.request import PROPERTIES

    lines = ["| key | meaning | left out |", "|---|---|---|"]
    for item in PROPERTIES:
        lines.append(f"| `{item.name}` | {_meaning(item)} | {item.left_out} |")
    lines += ["", "## In the panel and on the command line", ""]
    lines += ["| key | in the panel | option |", "|---|---|---|"]
    for item in PROPERTIES:
        if item.panel is not None or item.option is not None:
            lines.append(f"| `{item.name}` | {_labels(item)} | {_option(item)} |")
    return "\n".join(lines) + "\n"


def _meaning(item: CaptureProperty) -> str:
    from selenite.capture.value_kinds import Flag

    limits = item.kind.limits()
    found = [item.help, item.more]
    if limits:
        found.append(f"{limits['min']} to {limits['max']}")
    if isinstance(item.kind, Flag):
        found.append("`true` or `false`")
    return "; ".join(text for text in found if text)


def _labels(item: CaptureProperty) -> str:
    return ", ".join(f"*{control.label}*" for control in item.controls())


def _option(item: CaptureProperty) -> str:
    if item.option is None:
        return ""
    words = " ".join([item.flag, *filter(None, [item.metavar])])
    return f"`{words}`".replace("|", "\\|")  # a bar ends a cell


def main() -> None:
    sys.path.insert(0, str(ROOT / "addon"))
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
