# SPDX-License-Identifier: GPL-3.0-or-later
"""The chosen row of a list of the panel."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..scene_read.hosts import BpyStruct


def chosen(items: BpyStruct, at: int) -> BpyStruct:  # a collection of groups, and one of them
    """The row with number `at`; None where there is none."""
    return items[at] if 0 <= at < len(items) else None
