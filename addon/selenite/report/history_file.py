# SPDX-License-Identifier: GPL-3.0-or-later
"""history.csv of a result folder."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np


def write_history(path: Path, history: dict[str, Any], numbers: set[str]) -> None:
    """One row per iteration; a value that was not measured is left empty. `numbers`: the fields
    that hold no colours."""
    columns: list[tuple[str, np.ndarray]] = [
        (name, np.asarray(history[name]))
        for name in ("stage", "iteration", "loss", "validation")
        if name in history
    ]
    bias = np.asarray(history["mean_bias"])
    columns += [(f"mean_bias_{c}", bias[:, i]) for i, c in enumerate("rgb")]
    for name, values in history["values"].items():
        values = np.asarray(values)
        names = [name] if values.shape[1] == 1 else [f"{name}.{c}" for c in "rgb"]
        columns += [(label, values[:, i]) for i, label in enumerate(names)]
    for name, column in history["field_means"].items():
        if name in numbers:
            columns.append((f"{name} mean", column[:, 0]))
        else:
            columns += [(f"{name} mean.{c}", column[:, i]) for i, c in enumerate("rgb")]
    with path.open("w", newline="", encoding="utf-8", errors="backslashreplace") as file:
        writer = csv.writer(file)
        writer.writerow([name for name, _ in columns])
        for row in range(len(bias)):
            writer.writerow([_cell(values[row]) for _, values in columns])


def _cell(value: Any) -> str:  # noqa: ANN401 - numpy scalars
    if isinstance(value, np.integer):
        return str(int(value))
    return "" if math.isnan(value) else repr(float(value))
