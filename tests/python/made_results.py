# SPDX-License-Identifier: GPL-3.0-or-later
"""Plans and results of fits, as far as the words about them need."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from selenite import native
from selenite.parameters import table

EXPLAINED = {"value": 0.0001, "standard_error": 0.0001, "explained": True}


def plan_of(*names: str) -> Any:
    """Of parameters of the material Jade, between 0 and 1."""
    unknowns = [
        SimpleNamespace(
            owner="Jade", parameter=table()["material", name], name=f"Jade:{name}",
            start=(0.5,) * table()["material", name].width, minimum=0.0, maximum=1.0,
            by_ratio=False,
        )
        for name in names
    ]  # fmt: skip
    photo = SimpleNamespace(id="Front", isolated=0.0, free_gain="none", mask_share=1.0)
    return SimpleNamespace(unknowns=unknowns, fields=[], captures=[photo])


def result_of(
    misfit: dict[str, Any] | None = None, **entries: tuple[float, float, float] | None
) -> dict[str, Any]:
    """name -> (low, value, high), or None for a value that is not determined."""
    report = {}
    values = {}
    for name, numbers in entries.items():
        low, value, high = numbers or (0.0, 0.5, 1.0)
        values[f"Jade:{name}"] = [value]
        report[f"Jade:{name}"] = {
            "standard_error": [0.01], "interval_90": [[low, high]],
            "determined": [numbers is not None], "at_bound": [None], "correlated_with": [None],
        }  # fmt: skip
    return {
        "values_best": values,
        "stopped": native.core().StopReason.CONVERGED,
        "report": {
            "parameters": report, "passes": 3, "alternative_minima": [], "ambiguous": [],
            "misfit": misfit or EXPLAINED,
        },
    }  # fmt: skip
