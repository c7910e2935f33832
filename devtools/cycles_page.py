# SPDX-License-Identifier: GPL-3.0-or-later
"""The guide's table of Cycles' settings, from what *Set Cycles for the Fit* sets; a test compares
the committed page.

Run as a script, with a Python that has bpy, it rewrites docs/guide/cycles.md.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import generated_part

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "guide" / "cycles.md"
SCRIPT = Path(__file__).name


def _value(value: object) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    return f"{value:g}" if isinstance(value, float) else str(value)


def table() -> Iterator[str]:
    """Lines of Markdown: settings that change a picture, then those that are left to the user."""
    from selenite.cycles_check import render_settings

    named = [setting for setting in render_settings.SETTINGS if setting.cost]
    yield ""
    rows = [
        (setting.name, _value(setting.value) + " (not set)" * setting.remark, setting.cost)
        for setting in sorted(named, key=lambda item: item.remark)
    ]
    yield from generated_part.table(("setting", "for the fit", "another value"), rows)
    yield ""


def page(text: str) -> str:
    """The page with its table as the add-on has it now."""
    return generated_part.replaced(text, SCRIPT, table())


def main() -> None:
    sys.path.insert(0, str(ROOT / "addon"))
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
