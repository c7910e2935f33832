# SPDX-License-Identifier: GPL-3.0-or-later
"""Translations of the interface, as Blender takes them: language -> (context, text) -> text."""

from __future__ import annotations

import bpy

from .preferences import ADDON

_CONTEXTS = ("*", "Operator")


def register() -> None:
    """Each text in both contexts, that of labels and that of operators."""
    from .german import GERMAN

    german = {(context, text): found for text, found in GERMAN.items() for context in _CONTEXTS}
    bpy.app.translations.register(ADDON, {"de_DE": german, "de": german})


def unregister() -> None:
    """The inverse."""
    bpy.app.translations.unregister(ADDON)
