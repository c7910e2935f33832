# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual, and a report of a fault."""

from __future__ import annotations

import platform
from pathlib import Path

import bpy

from ... import __version__
from ..texts import announce

_ADDON = Path(__file__).resolve().parents[2]
#: Where the manual is: in a package, or in a checkout.
_MANUALS = (_ADDON / "manual", _ADDON.parents[1] / "docs" / "guide")


class SELENITE_OT_open_manual(bpy.types.Operator):
    """Open the manual: first fit, panel, photographing, results, symptoms and cures"""

    bl_idname = "selenite.open_manual"
    bl_label = "Manual"

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """In the program that the system has for it."""
        for folder in _MANUALS:
            for name in ("index.html", "index.md"):
                if (folder / name).is_file():
                    return bpy.ops.wm.path_open(filepath=str(folder / name))
        announce(
            self, {"WARNING"}, f"The manual is not in {_MANUALS[0]}; it is docs/guide of a checkout"
        )
        return {"CANCELLED"}


class SELENITE_OT_report_bug(bpy.types.Operator):
    """Copy what a report of a fault needs to the clipboard: versions and system. Add what you did,
    what you saw and what you expected"""

    bl_idname = "selenite.report_bug"
    bl_label = "Report a Bug"

    def execute(self, context: bpy.types.Context) -> set[str]:
        """No address is opened, and nothing leaves the machine."""
        context.window_manager.clipboard = bug_report()
        announce(
            self, {"INFO"}, "Copied; paste it into a report, with the file selenite-error-*.txt"
        )
        return {"FINISHED"}


def bug_report() -> str:
    """Versions and system, line by line."""
    return "\n".join([
        f"Selenite {__version__}",
        f"Blender {bpy.app.version_string} ({bpy.app.build_platform.decode(errors='replace')})",
        f"Python {platform.python_version()}, {platform.platform()}",
    ])  # fmt: skip


CLASSES = (SELENITE_OT_open_manual, SELENITE_OT_report_bug)
