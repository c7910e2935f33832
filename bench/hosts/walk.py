# SPDX-License-Identifier: GPL-3.0-or-later
"""In one Blender: what the table of properties knows of it, and what it names. Writes JSON.

PYTHON bench/hosts/walk.py OUT, or blender -b --factory-startup --python bench/hosts/walk.py -- OUT.
"""

import json
import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "blender_tests")]

import bpy  # noqa: E402
import known_properties as known  # noqa: E402
import property_cases as made  # noqa: E402
from property_scenes import scope  # noqa: E402

from selenite.scene_read.properties import judge  # noqa: E402


def factory_messages():
    """What is said of the scene that Blender starts with, rendered by Cycles."""
    bpy.ops.wm.read_factory_settings(use_empty=False)
    bpy.context.scene.render.engine = "CYCLES"
    problems, warnings = judge(scope())
    return [item.line() for item in problems] + warnings


def unnamed():
    """Cases whose value is not named, with what was said instead."""
    failed = []
    for case in made.cases():
        try:
            place, said = made.found_by(case)
        except Exception as error:  # noqa: BLE001 - told, and the run fails
            failed.append(f"{case.id}: {type(error).__name__}: {error}")
            continue
        if not any(made.is_named(case, place, item) for item in said):
            failed.append(f"{case.id}: {said}")
    return failed


def main():
    report = {
        "version": bpy.app.version_string,
        "python": ".".join(map(str, sys.version_info[:2])),
        "counts": known.counts(),
        "unknown": known.unknown(),
        "absent": list(known.absent_rows()),
        "factory": factory_messages(),
        "cases": len(made.cases()),
        "unnamed": unnamed(),
        "defaults": known.different_defaults(),
    }
    Path(sys.argv[-1]).write_text(json.dumps(report, indent=1))
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)  # Blender as a module can hang on the way out


main()
