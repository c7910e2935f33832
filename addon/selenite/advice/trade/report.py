# SPDX-License-Identifier: GPL-3.0-or-later
"""What a measurement leaves behind: table as CSV and JSON, and a plot."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import TYPE_CHECKING

from ... import __version__
from ...atomic_files import write_bytes
from ...json_text import json_text
from . import choices
from .measure import Row, Trade

if TYPE_CHECKING:
    from ...json_text import JsonObject

SCHEMA = 1
COLUMNS = (
    "name", "preset", "height", "spp", "depth", "iterations", "runs", "expected_seconds",
    "seconds", "cpu_seconds", "error", "lowest_error", "highest_error", "on_front",
)  # fmt: skip
ERROR_IS = (
    "root mean square over parameters and runs of fitted minus true value; of parameters with a "
    "wide range (power, strength, extinction) of the logarithm of their ratio"
)
_NOTHING = "no fit ended within the budget, so there is no plot; give more seconds"
_NO_MATPLOTLIB = (
    "matplotlib is not installed, so there is no plot; install it with: pip install matplotlib"
)


def report(trade: Trade) -> JsonObject:
    """The content of trade.json. What was not run has null in its place."""
    measured = [row for row in trade.rows if row.runs]
    points = [(row.mean("seconds"), row.error()) for row in measured]
    on_front = {
        row.choice.name for row, best in zip(measured, choices.front(points), strict=True) if best
    }
    rows = [_row(row, row.choice.name in on_front) for row in trade.rows]
    return {
        "schema": SCHEMA,
        "selenite": __version__,
        "scene": trade.plan.request.scene,
        "photos": [item.id for item in trade.plan.captures],
        "parameters": {
            item.name: {"true": list(item.start), "start": list(choices.displaced(item))}
            for item in trade.plan.unknowns
        },
        "error_is": ERROR_IS,
        "seed": trade.plan.request.settings.seed,
        "budget": trade.budget,
        "seconds": trade.seconds,
        "photo_spp": trade.photo_spp,
        "settings": rows,
        "presets": {row["preset"]: row for row in rows if row["preset"]},
    }


def write(content: JsonObject, folder: Path) -> dict[str, str | None]:
    """trade.csv, trade.json and trade.png; each appears whole or not at all. Raises OSError.

    Returns {"csv", "json", "plot"}: paths; the plot's is None where there is none.
    """
    folder.mkdir(parents=True, exist_ok=True)
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, COLUMNS, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    for row in content["settings"]:
        writer.writerow({key: "" if value is None else value for key, value in row.items()})
    picture = plot(content)
    files: dict[str, str | None] = {"csv": None, "json": None, "plot": None}
    pieces = {
        "csv": ("trade.csv", text.getvalue().encode()),
        "json": ("trade.json", (json_text(content, indent=1) + "\n").encode()),
        "plot": ("trade.png", picture),
    }
    for key, (name, data) in pieces.items():
        if data is not None:
            write_bytes(folder / name, data)
            files[key] = str(folder / name)
    return files


def why_no_plot(content: JsonObject) -> str:
    """Why there is a table but no plot; "" if there is one."""
    if not any(row["runs"] for row in content["settings"]):
        return _NOTHING
    return "" if _plotting() else _NO_MATPLOTLIB


def _plotting() -> tuple[type, type] | None:
    """matplotlib's canvas and figure; None where it is not installed."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        return None
    return FigureCanvasAgg, Figure


def plot(content: JsonObject) -> bytes | None:
    """A PNG of error over seconds with the front and the presets; None: see `why_no_plot`."""
    found = _plotting()
    rows = [row for row in content["settings"] if row["runs"]]
    if found is None or not rows:
        return None
    canvas, figure_type = found
    figure = figure_type(figsize=(9, 6), dpi=110, layout="constrained")
    canvas(figure)
    axes = figure.add_subplot()
    rows.sort(key=lambda row: row["seconds"])
    for index, row in enumerate(rows):
        name = row["preset"].capitalize() if row["preset"] else row["name"]
        colour = "#b3401f" if row["preset"] else "#3b5b7a"
        spread = [  # rounding may put a mean outside
            [max(0.0, row["error"] - row["lowest_error"])],
            [max(0.0, row["highest_error"] - row["error"])],
        ]
        axes.errorbar(
            row["seconds"], row["error"], yerr=spread, color=colour,
            marker="D" if row["preset"] else "o", markersize=9 if row["on_front"] else 5,
            markerfacecolor=colour if row["on_front"] else "white", capsize=2, elinewidth=0.8,
        )  # fmt: skip
        axes.annotate(
            name, (row["seconds"], row["error"]), textcoords="offset points",
            xytext=(8, -13 if index % 2 else 6),
            fontsize=11 if row["preset"] else 8, color=colour,
        )  # fmt: skip
    best = sorted((row["seconds"], row["error"]) for row in rows if row["on_front"])
    axes.plot(*zip(*best, strict=True), color="#888888", linewidth=1, zorder=0) if best else None
    axes.margins(x=0.15, y=0.1)
    axes.set_xscale("log")
    if all(row["lowest_error"] > 0 for row in rows):  # 0 has no place on a log axis
        axes.set_yscale("log")
    axes.set_xlabel("seconds of a fit on this machine")
    axes.set_ylabel("error of the fitted values")
    name = Path(content["scene"]).name.encode(errors="replace").decode()
    title = f"{name}: filled is on the front, bars are all runs"
    axes.set_title(title, parse_math=False)
    axes.grid(True, which="both", color="#e5e5e5", linewidth=0.6)
    image = io.BytesIO()
    figure.savefig(image, format="png")
    return image.getvalue()


def _row(row: Row, on_front: bool) -> JsonObject:
    settings = row.choice.settings
    errors = [run["error"] for run in row.runs]
    measured = bool(errors)
    return {
        "name": row.choice.name,
        "preset": row.choice.preset,
        "height": settings.height,
        "spp": settings.spp,
        "depth": settings.depth,
        "iterations": settings.iterations,
        "runs": len(errors),
        "expected_seconds": row.expected_seconds,
        "seconds": row.mean("seconds") if measured else None,
        "cpu_seconds": row.mean("cpu_seconds") if measured else None,
        "error": row.error() if measured else None,
        "lowest_error": min(errors) if measured else None,
        "highest_error": max(errors) if measured else None,
        "on_front": on_front,
        "errors": row.errors(),
        "failure": row.failure or None,
    }
