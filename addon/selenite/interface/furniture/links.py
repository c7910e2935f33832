# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual, a report of a fault, and the sample scene."""

from __future__ import annotations

import importlib.util
import platform
import shutil
import subprocess
from pathlib import Path

import bpy

from ... import __version__
from ...demo import scenes
from ..texts import announce

_ADDON = Path(__file__).resolve().parents[2]
#: Where the manual is: in a package, or in a checkout.
_MANUALS = (_ADDON / "manual", _ADDON.parents[1] / "docs" / "guide")
_SAMPLE = "start.blend"


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


class SELENITE_OT_open_sample(bpy.types.Operator):
    """Open the sample scene with its photos: a pendant whose material is to be found. Save your own
    file first"""

    bl_idname = "selenite.open_sample"
    bl_label = "Open Sample Scene"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """It is part of this package."""
        cls.poll_message_set("This package has no sample scene; in a checkout use ./dev demo")
        return sample() is not None or (scenes() / "jade_pendant.py").is_file()

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Asks first where the open file has changes."""
        if bpy.data.is_dirty:
            return set(context.window_manager.invoke_confirm(self, event))
        return self.execute(context)

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """In place of the open file."""
        path = sample() or made_sample()
        return bpy.ops.wm.open_mainfile(filepath=str(path))


def sample() -> Path | None:
    """The scene of a package; a checkout has none."""
    path = _ADDON / "sample" / _SAMPLE
    return path if path.is_file() else None


def made_sample() -> Path:
    """In a checkout: made by another Blender, beside a folder with its photos, in this Blender's
    folder for temporary files."""
    folder = Path(bpy.app.tempdir) / "selenite-sample"
    (folder / "photos").mkdir(parents=True, exist_ok=True)
    path = folder / _SAMPLE
    words = (
        f"import sys; sys.path[:0] = {[str(scenes()), str(_importable())]!r}; import jade_pendant; "
        f"jade_pendant.EXAMPLE.save_start(__import__('pathlib').Path({str(path)!r}))"
    )
    command = [bpy.app.binary_path, "-b", "--factory-startup", "--python-exit-code", "1"]
    subprocess.run([*command, "--python-expr", words], check=True, capture_output=True)
    for photo in (scenes() / "jade_pendant").glob("*.png"):
        shutil.copy(photo, folder / "photos")
    return path


def _importable() -> Path:
    """The folder in which `selenite` is: of a checkout, of an add-on, or of an extension's wheel,
    which a Blender of factory settings does not search."""
    found = importlib.util.find_spec("selenite")
    assert found is not None and found.origin is not None  # the add-on's native modules are there
    return Path(found.origin).parents[1]


def bug_report() -> str:
    """Versions and system, line by line."""
    return "\n".join([
        f"Selenite {__version__}",
        f"Blender {bpy.app.version_string} ({bpy.app.build_platform.decode(errors='replace')})",
        f"Python {platform.python_version()}, {platform.platform()}",
    ])  # fmt: skip


CLASSES = (SELENITE_OT_open_manual, SELENITE_OT_report_bug, SELENITE_OT_open_sample)
