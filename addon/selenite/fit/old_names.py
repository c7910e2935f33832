# SPDX-License-Identifier: GPL-3.0-or-later
"""Names that files of earlier versions have, and what they are called now."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..json_text import JsonObject

#: Keys of result.json and of the report in state.json.
KEYS = {"rivals": "alternative_minima", "contested": "ambiguous"}
#: Why a fit stopped.
REASONS = {"the values have settled": "converged"}


def renamed(data: Mapping[str, object]) -> JsonObject:
    """The same with today's names, on every level."""
    return {KEYS.get(key, key): _renamed(key, value) for key, value in data.items()}


def _renamed(key: str, value: object) -> object:
    if isinstance(value, Mapping):
        return renamed(value)
    if isinstance(value, list):
        return [renamed(item) if isinstance(item, Mapping) else item for item in value]
    if key == "stopped_because" and isinstance(value, str):
        return REASONS.get(value, value)
    return value
