# SPDX-License-Identifier: GPL-3.0-or-later
"""In a Blender without numpy the add-on switches on and says what to install."""

import sys

import bpy
import pytest

import selenite

pytestmark = pytest.mark.blender34


@pytest.fixture
def no_numpy(monkeypatch):
    monkeypatch.setitem(sys.modules, "numpy", None)


class Layout:
    def __init__(self):
        self.lines = []

    def label(self, text):
        self.lines.append(text)


def test_panel_and_terminal_name_the_package(no_numpy, capsys):
    selenite.register()
    try:
        assert not hasattr(bpy.types.Scene, "selenite")
        panel = bpy.types.SELENITE_PT_notice
        layout = Layout()
        panel.draw(type("Drawn", (), {"layout": layout})(), bpy.context)
        text = " ".join(layout.lines)
        assert "python3-numpy" in text and "restart Blender" in text
        # The default sidebar cuts what is longer.
        assert max(map(len, layout.lines)) <= 40
        assert capsys.readouterr().err == text + "\n"
    finally:
        selenite.unregister()
    assert not hasattr(bpy.types, "SELENITE_PT_notice")


def test_with_numpy_again_the_whole_panel_comes(no_numpy, monkeypatch):
    selenite.register()
    selenite.unregister()
    monkeypatch.undo()
    selenite.register()
    try:
        assert hasattr(bpy.types.Scene, "selenite")
        assert not hasattr(bpy.types, "SELENITE_PT_notice")
    finally:
        selenite.unregister()
