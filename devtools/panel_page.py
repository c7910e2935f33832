# SPDX-License-Identifier: GPL-3.0-or-later
"""The guide's tables of the panel's controls, from their tooltips; a test compares the committed
page.

Run as a script, with the Python that has bpy 4.5, it rewrites docs/guide/panel.md.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

import generated_part

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "guide" / "panel.md"
SCRIPT = Path(__file__).name
VERSION = (4, 5)  # of the Blender that has every control

#: Class with settings -> heading.
SETTINGS = {
    "SeleniteCapture": "Settings of a capture",
    "SeleniteRow": "Settings of a parameter",
    "SeleniteSettings": "Settings of the fit",
    "SeleniteStage": "Settings of a stage",
    "SelenitePictures": "Settings of the pictures",
    "SeleniteResult": "A fitted value",
    "SelenitePreferences": "Preferences of the add-on",
}
#: What devtools/capture_page.py has.
ELSEWHERE = {"SeleniteCapturePhoto", "SeleniteCaptureLights"}


def _buttons(classes: list[type]) -> list[tuple[str, str]]:
    """Label and tooltip of what a user presses."""
    pressed = [
        item
        for item in classes
        if issubclass(item, bpy.types.Operator)
        and "INTERNAL" not in getattr(item, "bl_options", ())
    ]
    # Blender takes the docstring for a tooltip when it registers the class.
    tooltips = [getattr(item, "bl_description", "") or item.__doc__ or "" for item in pressed]
    return sorted(
        {(f"*{item.bl_label}*", text) for item, text in zip(pressed, tooltips, strict=True)}
    )


def _settings(item: type) -> list[tuple[str, str, str]]:
    """Label, choices and tooltip of each setting of a class."""
    import interface_texts  # type: ignore[import-not-found]  # of the tests in Blender

    found = []
    for _, words in interface_texts._properties(item):
        items = words.get("items", ())
        choices = "" if callable(items) else ", ".join(choice[1] for choice in items)
        found.append((f"*{words['name']}*", choices, words.get("description", "")))
    return list(dict.fromkeys(found))


def table() -> Iterator[str]:
    """Lines of Markdown: all buttons, then the settings by what they belong to."""
    import interface_texts

    classes = interface_texts._classes()
    yield from ("", "### Buttons", "")
    yield from generated_part.table(("button", "effect"), _buttons(classes))
    order = list(SETTINGS)
    named = [item for item in classes if _settings(item) and item.__name__ not in ELSEWHERE]
    named.sort(key=lambda item: order.index(item.__name__) if item.__name__ in order else 99)
    for item in named:
        yield from ("", f"### {SETTINGS.get(item.__name__) or 'Options of ' + item.bl_label}", "")
        yield from generated_part.table(("setting", "choices", "meaning"), _settings(item))
    yield ""


def page(text: str) -> str:
    """The page with its tables as the interface has them now."""
    return generated_part.replaced(text, SCRIPT, table())


def main() -> None:
    sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "blender_tests")]
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
