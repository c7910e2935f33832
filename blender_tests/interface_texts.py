# SPDX-License-Identifier: GPL-3.0-or-later
"""Every text of the interface: labels, tooltips and items of what the add-on registers, and the
literals that its panels translate or draw."""

import ast
import inspect
from pathlib import Path

import bpy

from selenite import interface

INTERFACE = Path(__file__).resolve().parents[1] / "addon" / "selenite" / "interface"
#: Words that are the same in every language, or Blender's own and translated by it.
SAME = {
    "",
    "Selenite",
    "sRGB",
    "B2",
    "K1",
    "K2",
    "K3",
    "K4",
    "P1",
    "P2",
    "P3",
    "P4",
    "Y",
    "Z",
    "IOR",
    "Gauss-Newton",
    "Adam",
}
_DRAWN = {"label", "prop", "operator", "menu", "paragraph", "draw_bar", "translated"}


def _classes():
    return [item for module in interface._MODULES for item in module.CLASSES]


def _properties(item):
    """(identifier, keywords) of the properties that a class declares and panels may draw."""
    own = {"__annotations__": vars(item).get("__annotations__", {})}
    made = type(item.__name__, (), own | {"__module__": item.__module__})
    for key, annotation in inspect.get_annotations(made, eval_str=True).items():
        words = getattr(annotation, "keywords", {})
        if "HIDDEN" not in words.get("options", ()) and words.get("name"):
            yield key, words


def registered():
    """Labels, tooltips and items of classes and of their properties."""
    found = set()
    for item in _classes():
        found.add(getattr(item, "bl_label", ""))
        if issubclass(item, (bpy.types.Operator, bpy.types.Panel)):
            found.add(getattr(item, "bl_description", ""))
        for _, words in _properties(item):
            found |= {words["name"], words.get("description", "")}
            for one in words.get("items", ()):
                found |= {one[1], one[2]}
    return found


def without_tooltip():
    """Operators, panels and properties that say nothing more than their name."""
    found = []
    for item in _classes():
        has_one = issubclass(item, (bpy.types.Operator, bpy.types.Panel))
        if has_one and not getattr(item, "bl_description", ""):
            found.append(item.__name__)
        found += [
            f"{item.__name__}.{key}"
            for key, words in _properties(item)
            if not words.get("description")
        ]
    return found


def drawn():
    """Literals in calls that draw or translate."""
    found = set()
    for path in INTERFACE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call):
                continue
            function = node.func
            if not isinstance(function, ast.Attribute | ast.Name):
                continue
            name = function.attr if isinstance(function, ast.Attribute) else function.id
            if name not in _DRAWN:
                continue
            words = [*(node.args[-1:] if name == "translated" else [])]
            words += [item.value for item in node.keywords if item.arg == "text"]
            for word in words:
                if isinstance(word, ast.Constant) and isinstance(word.value, str):
                    found.add(word.value)
    return found


def all_texts():
    """What has to be translated."""
    return {text for text in registered() | drawn() if text not in SAME}
