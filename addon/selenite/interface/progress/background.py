# SPDX-License-Identifier: GPL-3.0-or-later
"""Work in the background as panels draw it: how far it has come, and the button that ends it."""

from __future__ import annotations

import bpy

from .. import state
from ..texts import paragraph


def draw_bar(layout: bpy.types.UILayout, fraction: float, text: str, lines: int = 1) -> None:
    """The text above a bar, in at least so many lines: a panel that grows hides its end for a
    moment."""
    whole = layout.column(align=True)
    paragraph(whole, bpy.context, text, lines=lines)
    if hasattr(layout, "progress"):  # 4.0 on; it would cut a text of its own
        whole.progress(factor=fraction, text="")
        return
    line = whole.row(align=True)
    line.scale_y = 0.5
    parts = line.split(factor=min(max(fraction, 0.01), 1.0), align=True)
    parts.operator("selenite.progress", text="", depress=True)
    parts.operator("selenite.progress", text="")


class SELENITE_OT_progress(bpy.types.Operator):
    """How far the work has come"""

    bl_idname = "selenite.progress"
    bl_label = "Progress"
    bl_options = {"INTERNAL"}

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Only drawn, in Blenders without a progress bar."""
        return {"CANCELLED"}


def draw_stop(layout: bpy.types.UILayout) -> None:
    """The button that ends what runs and keeps what it has found."""
    layout.operator("selenite.stop", text="Stop (Keep)", icon="CHECKMARK")


def draw_work(layout: bpy.types.UILayout, work: state.Background, *, keeps: bool = False) -> bool:
    """Whether it runs: then how far it has come, and the button that ends it. keeps: what it has
    found so far."""
    if work.job is None:
        return False
    fraction = work.step.fraction if work.step else 0.0
    draw_bar(layout, fraction, work.step.text if work.step else "Starting")
    if keeps:
        draw_stop(layout)
    else:
        layout.operator("selenite.cancel", icon="X")
    return True


def draw_next_camera(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """The button, how far it has come, and what was found."""
    if not draw_work(layout, state.NEXT):
        layout.operator("selenite.suggest_camera", icon="OUTLINER_OB_CAMERA")
    for line in state.NEXT.lines:
        paragraph(layout, context, line)


CLASSES = (SELENITE_OT_progress,)
