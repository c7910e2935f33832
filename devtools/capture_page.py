# SPDX-License-Identifier: GPL-3.0-or-later
"""The guide's tables of a capture's keys and controls, from their declaration; a test compares the
committed page.

Run as a script it rewrites docs/guide/captures.md.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import generated_part

if TYPE_CHECKING:
    from selenite.capture.capture_property import CaptureProperty
    from selenite.capture.panel_controls import Control

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "guide" / "captures.md"
SCRIPT = Path(__file__).name


def _meaning(item: CaptureProperty) -> str:
    from selenite.capture.value_kinds import Flag

    limits = item.kind.limits()
    found = [item.help, item.more]
    if limits:
        found.append(f"{limits['min']} to {limits['max']}")
    if isinstance(item.kind, Flag):
        found.append("`true` or `false`")
    return "; ".join(filter(None, found))


def _choices(control: Control) -> str:
    items = control.keywords.get("items", ())
    assert isinstance(items, tuple)
    return ", ".join(title for _, title, *_ in items)


def table() -> Iterator[str]:
    """Lines of Markdown."""
    from selenite.capture.request import PROPERTIES

    rows = [(f"`{item.name}`", _meaning(item), item.left_out) for item in PROPERTIES]
    yield from ("", *generated_part.table(("key", "meaning", "default"), rows))
    yield from ("", "## Controls", "")
    controls = [
        (f"*{control.label}*", f"`{item.name}`", _choices(control), control.help)
        for item in PROPERTIES
        for control in item.controls()
    ]
    yield from (*generated_part.table(("control", "key", "choices", "meaning"), controls), "")


def page(text: str) -> str:
    """The page with its table as the declaration has it now."""
    return generated_part.replaced(text, SCRIPT, table())


def main() -> None:
    sys.path.insert(0, str(ROOT / "addon"))
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
