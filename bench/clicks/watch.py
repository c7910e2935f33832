# SPDX-License-Identifier: GPL-3.0-or-later
"""In a Blender window that another process drives by clicks: only looks, and writes what it sees.

blender --python bench/clicks/watch.py -- FILE [CHECKOUT]

FILE is written anew ten times a second. CHECKOUT: the add-on is taken from there; without one it
has to be enabled in the preferences.
"""

import importlib
import json
import sys
from pathlib import Path

import bpy

FILE, *CHECKOUT = (Path(word) for word in sys.argv[sys.argv.index("--") + 1 :])
INTERVAL = 0.1  # seconds
MATERIAL = "Jade"


def part(name):
    """A module of the add-on, as it is enabled."""
    modules = ("selenite", "bl_ext.user_default.selenite")
    found = next(item for item in modules if item in bpy.context.preferences.addons or CHECKOUT)
    return importlib.import_module(f"{found}.{name}")


def node_values():
    """Of the material as it stands in the scene, by the names of the sockets."""
    material = bpy.data.materials.get(MATERIAL)
    if material is None:
        return {}
    nodes = material.node_tree.nodes
    node = next(item for item in nodes if item.bl_idname == "ShaderNodeBsdfPrincipled")
    values = {item.name: getattr(item, "default_value", None) for item in node.inputs}
    return {
        name: list(value) if hasattr(value, "__len__") else value
        for name, value in values.items()
        if value is not None and not isinstance(value, str)
    }


def seen():
    """What the panel and the scene say now."""
    state = part("interface.state")
    settings = bpy.context.scene.selenite
    phase = state.RUN.phase
    warnings = state.WARNINGS.get(bpy.context.scene.name)
    return {
        "blender": bpy.app.version_string,
        "python": sys.version.split()[0],
        "module": part("native").core().__file__,
        "file": bpy.data.filepath,
        "is_idle": state.is_idle() and state.PAIRING.job is None,
        "captures": [item.camera.name if item.camera else "" for item in settings.captures],
        "ticked": sorted(row.parameter for row in settings.rows if row.enabled),
        "problems": [str(item) for items in state.PROBLEMS.values() for item in items],
        "warnings": [*warnings.of_scene, *warnings.of_plan] if warnings else [],
        "phase": phase.title if phase else None,
        "message": state.RUN.message,
        "check": state.CHECK.message,
        "verdict": settings.verdict,
        "results": {
            row.parameter: [round(float(value), 4) for value in row.value][: row.width]
            for row in settings.results
        },
        "applied": bool(settings.applied),
        "nodes": node_values(),
    }


def write():
    """Whole or not at all: the other process reads while this one writes."""
    try:
        text = json.dumps(seen(), indent=1)
    except Exception as error:  # a file is being opened
        text = json.dumps({"trouble": f"{type(error).__name__}: {error}"})
    new = FILE.with_suffix(".new")
    new.write_text(text, encoding="utf-8")
    new.replace(FILE)
    return INTERVAL


if CHECKOUT:
    sys.path.insert(0, str(CHECKOUT[0] / "addon"))
    sys.path.append(str(CHECKOUT[0] / ".venv/lib/python3.11/site-packages"))
    import selenite

    selenite.register()
bpy.app.timers.register(write, persistent=True)
