# SPDX-License-Identifier: GPL-3.0-or-later
"""The table and the plot of a race of fits."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from .cases import Case
from .curves import Curve, at_smallest

#: Mean relative error at which a fit has arrived.
LEVEL = 0.05
OURS = "Selenite"
#: A run of Mitsuba that was cut off has arrived if it stayed for so much of the time that it took.
#: Selenite's ends by itself.
HOLD = 0.25
COLUMNS = (
    "case", "kind", "seed", "recipe", "reached", "converged", "best_error", "last_error",
    "late_share", "last_error_smallest_loss", "converged_smallest_loss", "cpu_seconds",
    "iterations", "compiling", "curve",
)  # fmt: skip


def row(case: Case, recipe: str, curve: dict[str, Any], path: Path) -> dict[str, Any]:
    """One fit; seconds without compilation, which has a column of its own. "" for never.

    A fit has arrived where it converges; `reached` is the first time that it touches the level.
    """
    compiling = curve.get("compiling", 0.0)
    run = Curve(np.array(curve["seconds"]) - compiling, np.array(curve["errors"]))
    hold = 0.0 if recipe == OURS else HOLD
    line = {
        "case": case.name,
        "kind": case.kind,
        "seed": case.seed,
        "recipe": recipe,
        "reached": _number(run.reached(LEVEL)),
        "converged": _number(run.converged(LEVEL, hold)),
        "late_share": run.late_share(LEVEL),
        "best_error": float(run.errors.min()),
        "last_error": float(run.errors[-1]),
        "cpu_seconds": float(run.seconds[-1]),
        "iterations": len(run.errors),
        "compiling": compiling,
        "curve": str(path),
    }
    if "losses" in curve:
        # A loss is that of the values before the step.
        before = np.array([curve["start_error"], *curve["errors"][:-1]])
        other = Curve(run.seconds, at_smallest(before, np.array(curve["losses"])))
        line |= {
            "last_error_smallest_loss": float(other.errors[-1]),
            "converged_smallest_loss": _number(other.converged(LEVEL, hold)),
        }
    return {name: line.get(name, "") for name in COLUMNS}


def _number(value: float | None) -> float | str:
    return "" if value is None else value


def _seconds(one: dict[str, Any], column: str = "converged", extra: float = 0.0) -> str:
    return f"{float(one[column]) + extra:.1f}" if one[column] != "" else "not reached"


def line(one: dict[str, Any]) -> str:
    """One fit for the terminal."""
    return (
        f"{one['case']}, {one['recipe']}: CPU s to {100 * LEVEL:g} %: {_seconds(one)}, "
        f"error {float(one['last_error']):.3f} after {float(one['cpu_seconds']):.1f} CPU s "
        f"and {one['iterations']} answers"
    )


def show(rows: list[dict[str, Any]], folder: Path) -> None:
    """Table on stdout and in summary.md, and plot.png."""
    level = f"{100 * LEVEL:g} %"
    lines = [
        f"| case | fit | CPU s to {level} | of the smallest loss | first touched | to compile "
        "| whole run, CPU s | error: least, last, of the smallest loss "
        f"| within {level} in the last quarter | times Selenite's |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    own = {one["case"]: one for one in rows if one["recipe"] == OURS}
    for one in sorted(rows, key=lambda r: (r["case"], r["recipe"] != OURS, r["recipe"])):
        peer = one["recipe"] != OURS
        errors = [one["best_error"], one["last_error"], one["last_error_smallest_loss"]]
        lines.append(
            f"| {one['case']} | {one['recipe']} | {_seconds(one)} "
            f"| {_seconds(one, 'converged_smallest_loss') if peer else '-'} "
            f"| {_seconds(one, 'reached')} | {float(one['compiling']):.1f} "
            f"| {float(one['cpu_seconds']):.0f} "
            f"| {', '.join(f'{float(error):.3f}' for error in errors if error != '')} "
            f"| {100 * float(one['late_share']):.0f} % of the answers "
            f"| {_times(one, own.get(one['case']))} |"
        )
    text = "\n".join(lines) + "\n"
    print(text)
    if rows:
        (folder / "summary.md").write_text(text, encoding="utf-8")
        plot(rows, folder)


def _times(one: dict[str, Any], own: dict[str, Any] | None) -> str:
    """How many times as long as Selenite, by the kinder of its two answers; a bound where neither
    has arrived."""
    if own is None or own is one or own["converged"] == "":
        return "-"
    arrivals = [one[name] for name in ("converged", "converged_smallest_loss") if one[name] != ""]
    if not arrivals:
        return f"more than {float(one['cpu_seconds']) / float(own['converged']):.1f}"
    return f"{min(map(float, arrivals)) / float(own['converged']):.1f}"


def plot(rows: list[dict[str, Any]], folder: Path) -> None:
    """Error over CPU time, a panel per case."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    names = sorted({one["case"] for one in rows})
    figure, axes = pyplot.subplots(
        1, len(names), figsize=(3.6 * len(names), 3.4), sharey=True, squeeze=False
    )
    for axis, name in zip(axes[0], names, strict=True):
        for one in sorted(rows, key=lambda r: (r["recipe"] != OURS, r["recipe"])):
            if one["case"] != name:
                continue
            curve = json.loads((folder / one["curve"]).read_text(encoding="utf-8"))
            seconds = np.array(curve["seconds"]) - float(one["compiling"])
            style = {"linewidth": 2.0} if one["recipe"] == OURS else {"linewidth": 0.8}
            axis.step(seconds, curve["errors"], where="post", label=one["recipe"], **style)
        axis.axhline(LEVEL, color="0.7", zorder=0)
        axis.set(xscale="log", yscale="log", xlabel="CPU seconds")
        axis.set_xlim(left=0.1)
        axis.set_title(name, fontsize=9)
    axes[0][0].set_ylabel("mean relative error")
    axes[0][0].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(folder / "plot.png", dpi=110)
    pyplot.close(figure)
