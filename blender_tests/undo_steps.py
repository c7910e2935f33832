# SPDX-License-Identifier: GPL-3.0-or-later
"""Undo without a window: works once steps were pushed by hand, so no test has to do without it.

An operator that pushes no step of its own shows: undoing leads to the step before the last one, in
which the mark has another value.
"""

import bpy

_MARK = "steps before the operator"


def prepare():
    """Call it before the operator, which has to be called with ("EXEC_DEFAULT", True)."""
    for number in (1, 2):
        bpy.context.scene[_MARK] = number
        bpy.ops.ed.undo_push(message=f"step {number}")


def undo():
    """Takes back the operator's step, and fails if it has none. Pointers are stale afterwards."""
    assert bpy.ops.ed.undo.poll()
    assert bpy.ops.ed.undo() == {"FINISHED"}
    assert bpy.context.scene[_MARK] == 2, "the operator has pushed no undo step"


def redo():
    """Brings it back."""
    assert bpy.ops.ed.redo.poll()
    assert bpy.ops.ed.redo() == {"FINISHED"}
