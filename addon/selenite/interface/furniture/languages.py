# SPDX-License-Identifier: GPL-3.0-or-later
"""Translations of the interface: each file of texts/ is a language, English -> its text.

A new language is a new file, named as Blender names the language; nothing else changes.
"""

from __future__ import annotations

import json
from pathlib import Path

import bpy

from .preferences import ADDON

TEXTS = Path(__file__).parent / "texts"
_CONTEXTS = ("*", "Operator")  # of labels, and of operators


def register() -> None:
    """Each text in both contexts. Blender 4 and later call German "de"."""
    found: dict[str, dict[tuple[str, str], str]] = {}
    for path in sorted(TEXTS.glob("*.json")):
        texts = json.loads(path.read_text(encoding="utf-8"))
        language = {
            (context, text): words for text, words in texts.items() for context in _CONTEXTS
        }
        found |= {path.stem: language, path.stem.partition("_")[0]: language}
    bpy.app.translations.register(ADDON, found)  # type: ignore[arg-type]  # the stubs are wrong


def unregister() -> None:
    """The inverse."""
    bpy.app.translations.unregister(ADDON)
