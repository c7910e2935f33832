# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs one script of blender_tests/gui in a Blender window, the add-on importable."""

import runpy
import sys
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "addon"))
sys.path.append(str(ROOT / ".venv/lib/python3.11/site-packages"))

bpy.context.preferences.view.show_splash = False  # type: ignore[union-attr]
script = Path(sys.argv[sys.argv.index("--") + 1])
sys.path.insert(1, str(script.parent))
runpy.run_path(str(script), run_name="__main__")
