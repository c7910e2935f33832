# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs one command line in a process of its own, inside Blender or with the module bpy.

A script, whose last word names a JSON file: "words" of the command, "python_path" for what this
Python lacks, and "ends_with_parent". Its stdout is one JSON object, as that of --json.
"""

from __future__ import annotations

import json
import sys
import threading
from collections.abc import Callable
from pathlib import Path


def _end_with_parent(end: Callable[[int], object]) -> None:
    """The parent holds the other end of stdin: no process stays behind where it was killed."""
    while sys.stdin.buffer.read(1):
        pass
    end(1)


if __name__ == "__main__":
    request = json.loads(Path(sys.argv[-1]).read_text(encoding="utf-8"))
    sys.path.extend(item for item in request["python_path"] if item not in sys.path)
    from selenite.process_end import end_process

    if request.get("ends_with_parent"):
        threading.Thread(target=_end_with_parent, args=(end_process,), daemon=True).start()
    from selenite.cli import run_as_process

    end_process(run_as_process(request["words"]))
