# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets of quality, for scenes and for the preferences. Numbers and names must not change."""

PRESET_ITEMS = (
    ("draft", "Draft", "Small pictures, few iterations", 0),
    ("balanced", "Balanced", "The usual choice", 1),
    ("accurate", "Accurate", "More samples and iterations", 2),
)
