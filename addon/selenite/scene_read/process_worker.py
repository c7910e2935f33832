# SPDX-License-Identifier: GPL-3.0-or-later
"""A process that works on a copy of the file; see `blender_process`, which starts it.

Run as a script with a folder as its last word, inside Blender or with the module bpy. The folder
holds scene.blend and request.json, whose "module" has a function `run(folder, request, note)`; its
report goes there.
"""

from __future__ import annotations

import importlib
import json
import sys
import traceback
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path


def main(folder: Path) -> int:
    """Leaves report.json, with the key "error" or "problems" if it went wrong."""
    request = json.loads((folder / "request.json").read_text(encoding="utf-8"))
    # What this Python lacks comes from the parent's: the add-on, and what it brings along.
    sys.path.extend(item for item in request["python_path"] if item not in sys.path)
    from selenite.atomic_files import write_bytes
    from selenite.problems import BadInput

    def write(name: str, data: Mapping[str, object]) -> None:
        write_bytes(folder / name, json.dumps(data).encode())  # the other process reads any time

    def note(fraction: float, text: str) -> None:
        with suppress(PermissionError):  # on Windows, while it is read: the next one follows
            write("progress.json", {"fraction": fraction, "text": text})

    try:
        work = importlib.import_module(request["module"])
        report, status = work.run(folder, request, note), 0
    except BadInput as error:
        report, status = {"problems": [item.as_json() for item in error.problems]}, 2
    except Exception as error:
        traceback.print_exc()
        report, status = {"error": f"{type(error).__name__}: {error}"}, 1
    write("report.json", report)
    return status


if __name__ == "__main__":
    words = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    status = main(Path(words[0]))
    sys.stdout.flush()
    sys.stderr.flush()
    from selenite.process_end import end_process

    end_process(status)
