# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels without a window: what they draw, as text."""

from types import SimpleNamespace

import bpy


class FakeLayout:
    """Records what a panel draws and refuses what Blender would refuse."""

    def __init__(self, drawn=None):
        self.drawn = [] if drawn is None else drawn
        self.enabled = True

    def row(self, **_options):
        return FakeLayout(self.drawn)

    box = column = split = row

    def label(self, text="", icon="NONE", icon_value=0, translate=True):
        assert icon in bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items
        self.drawn.append(text)

    def prop(
        self, data, name, text=None, index=-1, emboss=True, icon="NONE", slider=False,
        translate=True,
    ):  # fmt: skip
        assert icon in bpy.types.UILayout.bl_rna.functions["prop"].parameters["icon"].enum_items
        assert name in data.bl_rna.properties, name
        self.drawn.append(text or name)

    def operator(self, name, text="", icon="NONE", depress=False, emboss=True):
        group, _, word = name.partition(".")
        assert hasattr(bpy.types, f"{group.upper()}_OT_{word}"), name
        self.drawn.append(name)
        return SimpleNamespace()

    def menu(self, name, text=""):
        assert hasattr(bpy.types, name)
        self.drawn.append(text)

    def separator(self, factor=1.0):
        pass

    def template_list(
        self, kind, _identity, data, name, active_data, active, rows=1, item_dyntip_propname=""
    ):
        assert hasattr(bpy.types, kind)
        kept = data.bl_rna.properties[name].fixed_type
        assert not item_dyntip_propname or item_dyntip_propname in kept.properties
        assert name in data.bl_rna.properties and active in active_data.bl_rna.properties
        self.drawn.append(name)

    def template_ID(self, data, name, open=""):  # noqa: A002 - Blender's word
        assert name in data.bl_rna.properties
        self.drawn.append(name)

    def template_icon(self, icon_value, scale=1.0):
        assert icon_value >= 0 and scale > 0
        self.drawn.append("icon")

    def progress(self, factor, text):
        assert 0 <= factor <= 1
        self.drawn.append(text)


def draw(panel):
    """Everything that a panel draws, as text."""
    layout = FakeLayout()
    panel.draw(SimpleNamespace(layout=layout), bpy.context)
    return "\n".join(str(item) for item in layout.drawn)
