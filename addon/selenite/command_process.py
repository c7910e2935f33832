# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs one command line in a process of its own, inside Blender or with the module bpy.

A script, whose last word names a JSON file: "words" of the command, and "python_path" for what this
Python lacks. Its stdout is one JSON object, as that of --json.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

if __name__ == "__main__":
    request = json.loads(Path(sys.argv[-1]).read_text(encoding="utf-8"))
    sys.path.extend(item for item in request["python_path"] if item not in sys.path)
    from selenite.cli import run_as_process

    os._exit(run_as_process(request["words"]))  # bpy can hang in its own destructors
