# SPDX-License-Identifier: GPL-3.0-or-later
"""Every control of the panel is named in docs/guide/panel.md, or where that page points to."""

from pathlib import Path

import bpy
import interface_texts
import pytest

pytestmark = [pytest.mark.blender, pytest.mark.usefixtures("addon")]

GUIDE = Path(__file__).resolve().parents[1] / "docs" / "guide"
#: The latter has those of a capture.
PAGES = (GUIDE / "panel.md", GUIDE / "captures.md")
#: Label -> what the panel writes in its place, and the page too.
CALLED = {
    "Refresh Parameters": "Refresh",
    "Reset Parameters": "Reset",
    "Restore Originals": "Restore",
    "Stop and Keep Best": "Stop (Keep)",
    "Selenite: Result": "pop-up",
    "Add Capture": "*+*",
    "Remove Capture": "*-*",
    "Material, Lamp or World": "lock",
    "Fitted Colour": "value or colour",
    "Minimum": "*Min*",
    "Maximum": "*Max*",
    "Use": "tick of a row",
    "Value": "their values",
    "At": "iteration",
}


def controls():
    """Labels of operators that a user presses, and of what they can set."""
    found = set()
    for item in interface_texts._classes():
        internal = "INTERNAL" in getattr(item, "bl_options", ())
        if issubclass(item, bpy.types.Operator) and not internal:
            found.add(item.bl_label)
        found |= {words["name"] for _, words in interface_texts._properties(item)}
    return found


def test_the_page_of_the_panel_names_every_control():
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    found = controls()
    assert len(found) > 100  # the collector collects
    assert sorted(name for name in found if CALLED.get(name, name) not in text) == []
