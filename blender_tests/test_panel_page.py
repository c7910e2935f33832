# SPDX-License-Identifier: GPL-3.0-or-later
"""The guide's tables of the panel and of Cycles' settings say what the add-on has."""

import sys
from pathlib import Path

import bpy
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "devtools"))

import cycles_page  # noqa: E402
import panel_page  # noqa: E402

pytestmark = [pytest.mark.blender, pytest.mark.usefixtures("addon")]


@pytest.mark.skipif(
    bpy.app.version[:2] != panel_page.VERSION, reason="older Blenders lack some controls"
)
def test_the_page_of_the_panel_has_every_control_with_its_tooltip():
    text = panel_page.PAGE.read_text(encoding="utf-8")
    assert text.count("\n| *") > 100  # the collector collects
    assert panel_page.page(text) == text, (
        "docs/guide/panel.md is out of date: .venv/bin/python devtools/panel_page.py"
    )


def test_each_control_has_a_tooltip_on_the_page():
    text = panel_page.PAGE.read_text(encoding="utf-8")
    rows = [line for line in text.splitlines() if line.startswith("| *")]
    assert [line for line in rows if line.rstrip("|").rstrip().endswith("|")] == []


def test_the_page_of_cycles_has_every_setting_that_changes_a_picture():
    text = cycles_page.PAGE.read_text(encoding="utf-8")
    assert "| Volume Bounces | 1024 |" in text
    assert cycles_page.page(text) == text, (
        "docs/guide/cycles.md is out of date: .venv/bin/python devtools/cycles_page.py"
    )
