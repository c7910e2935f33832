# SPDX-License-Identifier: GPL-3.0-or-later
"""The guide's table of nodes says what the reader does."""

import sys
from pathlib import Path

import bpy
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "devtools"))

import node_page  # noqa: E402

pytestmark = pytest.mark.blender


@pytest.mark.skipif(
    bpy.app.version[:2] != node_page.VERSION, reason="the page is that of another Blender's nodes"
)
def test_the_table_of_nodes_is_what_the_reader_reads():
    text = node_page.PAGE.read_text(encoding="utf-8")
    assert text.count("\n| ") > 50
    assert node_page.page(text) == text, (
        "docs/guide/node_graphs.md is out of date: .venv/bin/python devtools/node_page.py"
    )


def test_what_is_refused_is_in_the_table():
    assert node_page.row_of("ShaderNodeNewGeometry").outputs == ["Tangent"]
    assert node_page.row_of("ShaderNodeBsdfToon") is None
    assert "Roughness" in node_page.row_of("ShaderNodeBsdfGlass").fitted
