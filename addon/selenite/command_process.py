# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs one command line in a process of its own, inside Blender or with the module bpy.

A script, whose last word names a JSON file: "words" of the command, "python_path" for what this
Python lacks, and "ends_with_parent". Its stdout is one JSON object, as that of --json.
"""

from __future__ import annotations

import json
import os
import sys
import threading
from pathlib import Path


def _end_with_parent() -> None:
    """The parent holds the other end of stdin: no process stays behind where it was killed."""
    while sys.stdin.buffer.read(1):
        pass
    os._exit(1)


if __name__ == "__main__":
    request = json.loads(Path(sys.argv[-1]).read_text(encoding="utf-8"))
    if request.get("ends_with_parent"):
        threading.Thread(target=_end_with_parent, daemon=True).start()
    sys.path.extend(item for item in request["python_path"] if item not in sys.path)
    from selenite.cli import run_as_process

    os._exit(run_as_process(request["words"]))  # bpy can hang in its own destructors
