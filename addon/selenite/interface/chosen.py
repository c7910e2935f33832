# SPDX-License-Identifier: GPL-3.0-or-later
"""The chosen row of a list of the panel."""

from __future__ import annotations

from typing import Any


def chosen(items: Any, at: int) -> Any:  # noqa: ANN401 - a collection of groups, and one of them
    """The row with number `at`; None where there is none."""
    return items[at] if 0 <= at < len(items) else None
