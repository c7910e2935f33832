# SPDX-License-Identifier: GPL-3.0-or-later
"""A row per fit, and what the rows say together."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .cases import Case, errors, mean_error, seen
from .fits import answer_of

if TYPE_CHECKING:
    from selenite._core import FitResult, TrustReport

LEVELS = (0.1, 0.05, 0.02)
#: A fit is wrong above the one mean error, right below the other.
WRONG, RIGHT = 0.1, 0.05
SCALARS = (
    "base_color[0]", "base_color[1]", "base_color[2]", "albedo[0]", "albedo[1]", "albedo[2]",
    "extinction", "roughness", "coat_roughness", "transmission", "ior",
)  # fmt: skip
COLUMNS = (
    "label", "case", "kind", "mesh", "lighting", "cameras", "seed", "mean_error", *SCALARS,
    "cpu_seconds", "samples", "validation", "validation_standard_error", "best_iteration",
    "intervals", "covered", "undetermined", "misfit", "misfit_standard_error", "explained",
    "answer", "zscores", "optimiser", "grid_error", "alternative_minima", "image_error",
)  # fmt: skip


def row(
    label: str, case: Case, result: FitResult, cpu_seconds: float,
    texel_weights: np.ndarray | None = None,
) -> dict[str, Any]:  # fmt: skip
    """One fit as a row of the table. texel_weights: see `fits.texel_weights`; None: all alike."""
    answer = answer_of(result.values_best)
    found = errors(case, answer)
    line = {name: "" for name in COLUMNS} | {
        "label": label,
        "case": case.name,
        "kind": case.kind,
        "mesh": case.mesh,
        "lighting": case.lighting,
        "cameras": case.cameras,
        "seed": case.seed,
        "mean_error": mean_error(case, answer),
        "cpu_seconds": cpu_seconds,
        "samples": result.samples,
        "validation": result.best_validation,
        "validation_standard_error": result.best_validation_standard_error,
        "best_iteration": result.best_iteration,
        "optimiser": result.optimiser,
        "answer": " ".join(f"{x:.5g}" for value in answer.values() for x in np.ravel(value)),
    }
    if case.albedo_grid is not None:
        voxels = result.fields_best["Body:albedo_grid"]
        line["grid_error"] = float(np.abs(voxels - case.albedo_grid).mean())
    if case.image is not None:
        # Of sRGB code values; nothing moves a texel that no photo shows.
        off = np.abs(result.fields_best["Body:base_color_texture"] - case.image)
        line["image_error"] = float(np.average(off, weights=texel_weights))
    return line | found | trust(case, answer, result.report)


def trust(case: Case, answer: dict[str, Any], reported: TrustReport) -> dict[str, Any]:
    """How many intervals were given and how many hold the truth."""
    if not reported.parameters:
        return {}
    intervals = covered = 0
    undetermined, z = [], []
    for name, truth in case.target.items():
        entry = reported.parameters[f"Body:{name}"]
        for i, true in enumerate(truth):
            label = f"{name}[{i}]" if len(truth) > 1 else name
            if not entry.determined[i]:
                undetermined.append(label)
                continue
            low, high = entry.interval_90[i]
            intervals += 1
            covered += seen(name, low) <= seen(name, true) <= seen(name, high)
            error = max(entry.standard_error[i], 1e-12)
            z.append(f"{label}={(np.ravel(answer[name])[i] - true) / error:.2f}")
    misfit = reported.misfit
    return {
        "intervals": intervals,
        "covered": covered,
        "undetermined": " ".join(undetermined),
        "misfit": misfit.value,
        "misfit_standard_error": misfit.standard_error,
        "explained": int(misfit.explained),
        "alternative_minima": len(reported.alternative_minima),
        "zscores": " ".join(z),
    }


def line(found: dict[str, Any]) -> str:
    """One fit for the terminal."""
    parts = " ".join(f"{name.partition('_')[0]}{name[-3:] if '[' in name else ''} {found[name]:.3f}"
                     for name in SCALARS if found[name] != "")  # fmt: skip
    text = f"{found['case']}: mean {found['mean_error']:.4f} ({parts}) {found['cpu_seconds']:.1f} s"
    if found["intervals"] != "":
        text += f", {found['covered']} of {found['intervals']} intervals hold"
        text += f", not determined: {found['undetermined'] or 'none'}, "
        text += f"alternative minima: {found['alternative_minima']}"
    if found["grid_error"] != "":
        text += f", voxels off by {found['grid_error']:.3f}"
    if found["image_error"] != "":
        text += f", texels off by {found['image_error']:.3f}"
    return text


def show(rows: list[dict[str, str]], folder: Path) -> None:
    """Table on stdout and in summary.md, and plot.png."""
    lines = [
        "| recipe | case | runs | mean error: median, worst | of determined values "
        "| under 10 / 5 / 2 % "
        "| the same without roughness | intervals that hold | not determined "
        "| wrong ones warned of | right ones doubted | right ones with values left open "
        "| CPU s | Msamples |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    groups: dict[tuple[str, str], list[dict[str, str]]] = {}
    for one in rows:
        groups.setdefault((one["label"], one["kind"]), []).append(one)
    for (label, kind), some in sorted(groups.items()):
        error = np.array([float(one["mean_error"]) for one in some])
        under = _under(error)
        given = sum(int(one["intervals"] or 0) for one in some)
        covered = sum(int(one["covered"] or 0) for one in some)
        lost = sum(len(one["undetermined"].split()) for one in some)
        share = f"{covered} of {given} ({100 * covered / given:.0f} %)" if given else "-"
        cpu = np.mean([float(one["cpu_seconds"]) for one in some])
        samples = np.mean([float(one["samples"]) for one in some]) / 1e6
        lines.append(
            f"| {label} | {kind} | {len(some)} | {np.median(error):.3f}, {error.max():.3f} "
            f"| {_of_determined(some)} | {under} | {_under(_without_roughness(some))} "
            f"| {share} | {lost} "
            f"| {_share(some, WRONG, math.inf, is_warned_of)} "
            f"| {_share(some, 0, RIGHT, is_doubted)} "
            f"| {_share(some, 0, RIGHT, lambda one: bool(one['undetermined']))} "
            f"| {cpu:.0f} | {samples:.0f} |"
        )
    text = "\n".join(lines) + "\n"
    print(text)
    if rows:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "summary.md").write_text(text, encoding="utf-8")
        plot(groups, folder / "plot.png")


def _under(error: np.ndarray) -> str:
    """Percent of the runs below each level."""
    return " / ".join(f"{100 * np.mean(error < level):.0f}" for level in LEVELS)


def determined_error(one: dict[str, str]) -> float | None:
    """Mean error of the scalars that the report calls determined; None where there are none. Where
    photos do not tell a value, its error is luck: it changes from fit to fit."""
    undetermined = one["undetermined"].split()
    known = [
        float(one[name])
        for name in SCALARS
        if one.get(name) and not any(f"{other}[".startswith(f"{name}[") for other in undetermined)
    ]
    return float(np.mean(known)) if known else None


def _of_determined(some: list[dict[str, str]]) -> str:
    """Median and worst."""
    errors = [error for error in map(determined_error, some) if error is not None]
    return f"{np.median(errors):.3f}, {max(errors):.3f}" if errors else "-"


def is_warned_of(one: dict[str, str]) -> bool:
    """Whether the report of a fit warns of it: doubts it, or leaves a value open."""
    return is_doubted(one) or bool(one["undetermined"])


def is_doubted(one: dict[str, str]) -> bool:
    """Whether the report says that this may be the wrong place: a misfit, or alternative
    minima."""
    return one["explained"] == "0" or one["alternative_minima"] not in ("", "0")


def _share(some: list[dict[str, str]], low: float, high: float, has: Callable[..., bool]) -> str:
    """How many of the refined runs with an error in between are so."""
    between = [one for one in some if one["explained"] and low <= float(one["mean_error"]) < high]
    return f"{sum(map(has, between))} of {len(between)}"


def _without_roughness(some: list[dict[str, str]]) -> np.ndarray:
    """Mean errors of the other scalars: sharp reflections are narrower than a pixel."""
    others = [name for name in SCALARS if name != "roughness"]
    return np.array([np.mean([float(one[n]) for n in others if one.get(n)]) for one in some])


def plot(groups: dict[tuple[str, str], list[dict[str, str]]], path: Path) -> None:
    """Share of the runs below an error, a curve per recipe, a panel per case."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    kinds = sorted({kind for _, kind in groups})
    figure, axes = pyplot.subplots(1, len(kinds), figsize=(3.2 * len(kinds), 3), sharey=True)
    for axis, kind in zip(np.atleast_1d(axes), kinds, strict=True):
        for (label, other), some in sorted(groups.items()):
            if other != kind:
                continue
            error = np.sort([float(one["mean_error"]) for one in some])
            axis.step(error, np.arange(1, len(error) + 1) / len(error), where="post", label=label)
        axis.set(xscale="log", xlim=(1e-3, 1), ylim=(0, 1), title=kind, xlabel="mean error")
        for level in LEVELS:
            axis.axvline(level, color="0.85", zorder=0)
    np.atleast_1d(axes)[0].set_ylabel("share of the runs")
    np.atleast_1d(axes)[-1].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    pyplot.close(figure)
