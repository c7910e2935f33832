# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves of a fit: its loss, and every parameter between its bounds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...fit.plan import FitPlan
from ...fit.unknowns import labels
from .canvas import FAINT, GRID, INK, Canvas, Colour
from .glyphs import width_of

if TYPE_CHECKING:
    from ..._core import FitResult, History

_BLUE: Colour = (0.12, 0.36, 0.7)
_ORANGE: Colour = (0.85, 0.42, 0.08)
_CHANNELS: tuple[Colour, ...] = ((0.8, 0.15, 0.13), (0.13, 0.55, 0.2), (0.15, 0.32, 0.8))
_BOUND: Colour = (0.5, 0.2, 0.5)
_WIDTH, _HEIGHT = 400, 210  # of one plot, pixels
_LEFT, _RIGHT, _TOP, _BOTTOM = 58, 10, 26, 24
_COLUMNS = 2
_LEAST_WIDTH, _LEAST_HEIGHT = 200, 96
#: Plots that a page has at most, the loss among them; what is left out is counted.
_MOST = 24


@dataclass(frozen=True)
class Curve:
    """y (k,) over the iterations; NaN: not measured."""

    y: np.ndarray
    colour: Colour
    name: str = ""
    dots: bool = False


@dataclass(frozen=True)
class Plot:
    """One pair of axes. bounds: lines across; intervals: (low, high, colour) at the right end;
    mark: an iteration with a line of its own."""

    title: str
    x: np.ndarray
    curves: Sequence[Curve]
    logarithmic: bool = False
    bounds: Sequence[float] = ()
    intervals: Sequence[tuple[float, float, Colour]] = field(default=())
    mark: float | None = None
    stages: Sequence[float] = ()


def page(plots: Sequence[Plot], room: tuple[int, int] | None = None) -> Canvas:
    """All of them on one page, row by row. room: width and height of the page, as far as plots stay
    readable in it."""
    shown = plots[:_MOST]
    columns, size = _grid(len(shown), room)
    rows = -(-len(shown) // columns)
    left_out = len(plots) - len(shown)
    canvas = Canvas(columns * size[0], rows * size[1] + (24 if left_out else 4))
    for index, plot in enumerate(shown):
        row, column = divmod(index, columns)
        _draw(canvas, plot, column * size[0], row * size[1], size)
    if left_out:
        text = f"{left_out} more parameters are in history.csv"
        canvas.text(10, rows * size[1] + 4, text, colour=FAINT)
    return canvas


def _grid(count: int, room: tuple[int, int] | None) -> tuple[int, tuple[int, int]]:
    """Columns, and width and height of a plot: as near to the usual shape as the room permits."""
    if room is None:
        return _COLUMNS, (_WIDTH, _HEIGHT)
    width, height = room

    def cell(columns: int) -> tuple[int, int]:
        return width // columns, (height - 28) // -(-count // columns)

    def size(columns: int) -> float:
        across, down = cell(columns)
        return min(across / _WIDTH, down / _HEIGHT)

    best = max(range(1, max(1, min(count, 6)) + 1), key=size)
    across, down = cell(best)
    return best, (max(_LEAST_WIDTH, across), max(_LEAST_HEIGHT, down))


def of_fit(
    plan: FitPlan,
    history: History,
    result: FitResult | None = None,
    mark: float | None = None,
) -> list[Plot]:
    """Loss first, then each parameter and the mean of each grid or image. history: as of the native
    result; result: the same, for the best iteration and the intervals."""
    x = np.asarray(history["iteration"], float)
    report = (result or {}).get("report", {}).get("parameters", {})
    best = mark
    if best is None and result is not None:
        best = float(result["best_iteration"])
    stages = _stage_starts(history, x)
    found = [_loss(history, x, best, stages)]
    names = labels(plan.unknowns)
    for item in plan.unknowns:
        values = np.asarray(history["values"].get(item.name, np.empty((0, 1))), float)
        if len(values) != len(x):
            continue
        rows = report.get(item.name, {}).get("interval_90") or []
        colours = (_BLUE,) if values.shape[1] == 1 else _CHANNELS
        intervals = [
            (float(low), float(high), colour)
            for (low, high), colour in zip(rows, colours, strict=False)
        ]
        title = names[item.name]
        if item.parameter.unit not in ("", "1"):
            title += f" ({item.parameter.unit})"
        found.append(
            Plot(
                title, x, _channels(values), item.by_ratio, (item.minimum, item.maximum),
                intervals, best, stages,
            )
        )  # fmt: skip
    for name, column in history.get("field_means", {}).items():
        values = np.asarray(column, float)
        number = all(item.values.shape[-1] == 1 for item in plan.fields if item.name == name)
        curves = _channels(values[:, :1] if number else values)
        found.append(Plot(f"{name}, mean", x, curves, mark=best, stages=stages))
    return found


def write(path: Path, plan: FitPlan, result: FitResult) -> None:
    """The page of a fit that has ended, as PNG. Raises OSError."""
    page(of_fit(plan, result["history"], result)).write(path)


def ticks(low: float, high: float, most: int = 4) -> list[float]:
    """Round numbers between two, both included where they are round: about `most`, at least two."""
    span = high - low
    if not (math.isfinite(span) and span > 0):
        return [low]
    found = _multiples(low, high, span / most)
    return found if len(found) > 1 else _multiples(low, high, span / (most + 2))


def _multiples(low: float, high: float, raw: float) -> list[float]:
    """Of a round step that is at least `raw`."""
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(power * factor for factor in (1, 2, 5, 10) if power * factor >= raw * (1 - 1e-9))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [round(number * step, 12) + 0.0 for number in range(first, last + 1)]


def decades(low: float, high: float, most: int = 5) -> list[float]:
    """Powers of ten between two positive numbers; where there are few, 1, 2 and 5 times them, or
    what `ticks` gives."""
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    step = max(1, -(-(last - first) // most))
    found = [10.0**n for n in range(first, last + 1, step)]
    if last - first <= 2 and most > 3:
        found = [f * 10.0**n for n in range(first, last + 1) for f in (1, 2, 5)]
    found = [value for value in found if low * 0.999 <= value <= high * 1.001]
    return found if len(found) > 1 else ticks(low, high, most)


def _loss(history: History, x: np.ndarray, best: float | None, stages: Sequence[float]) -> Plot:
    loss = np.asarray(history["loss"], float)
    validation = np.asarray(history["validation"], float)
    curves = [Curve(loss, _BLUE, "loss")]
    if np.isfinite(validation).any():
        curves.append(Curve(validation, _ORANGE, "validated", dots=True))
    seen = np.concatenate([curve.y for curve in curves])
    seen = seen[np.isfinite(seen)]
    positive = bool(len(seen)) and float(seen.min()) > 0
    return Plot("Loss", x, curves, logarithmic=positive, mark=best, stages=stages)


def _channels(values: np.ndarray) -> list[Curve]:
    if values.shape[1] == 1:
        return [Curve(values[:, 0], _BLUE)]
    return [
        Curve(values[:, c], colour, name)
        for c, (colour, name) in enumerate(zip(_CHANNELS, ("red", "green", "blue"), strict=True))
    ]


def _stage_starts(history: History, x: np.ndarray) -> list[float]:
    if "stage" not in history or not len(x):
        return []
    changes = np.flatnonzero(np.diff(np.asarray(history["stage"]))) + 1
    return [float(x[at]) for at in changes]


def _draw(canvas: Canvas, plot: Plot, left: int, top: int, size: tuple[int, int]) -> None:
    x0, x1 = left + _LEFT, left + size[0] - _RIGHT
    y0, y1 = top + _TOP, top + size[1] - _BOTTOM
    low, high = _range(plot)
    last = max(1.0, float(plot.x.max()) if len(plot.x) else 1.0)

    def across(value: float) -> float:
        return x0 + value / last * (x1 - x0)

    def scaled(value: np.ndarray) -> np.ndarray:
        with np.errstate(divide="ignore", invalid="ignore"):
            if plot.logarithmic:
                share = (np.log(value) - math.log(low)) / (math.log(high) - math.log(low))
            else:
                share = (value - low) / (high - low)
        found: np.ndarray = y1 - share * (y1 - y0)
        return np.where(np.isfinite(found), found, np.nan)

    def up(value: float) -> float:
        return float(scaled(np.array([value]))[0])

    canvas.fill(x0, y0, x1, y1, (1.0, 1.0, 1.0))
    most = max(2, (y1 - y0) // 36)
    for value in decades(low, high, most) if plot.logarithmic else ticks(low, high, most):
        canvas.fill(x0, up(value), x1, up(value) + 1, GRID)
        canvas.text(x0 - 5, up(value) - 7, f"{value:.4g}", size=12, align=1)
    for value in (n for n in ticks(0, last, 5) if n == round(n)):
        canvas.fill(across(value), y1, across(value) + 1, y1 + 4, FAINT)
        canvas.text(across(value), y1 + 6, f"{value:.0f}", size=12, align=0.5)
    for value in plot.stages:
        canvas.fill(across(value), y0, across(value) + 1, y1, FAINT, 0.6)
    for value in plot.bounds:
        if low <= value <= high:
            canvas.fill(x0, up(value) - 1, x1, up(value) + 1, _BOUND, 0.7)
    if plot.mark is not None:
        canvas.fill(across(plot.mark), y0, across(plot.mark) + 1, y1, INK, 0.5)
    for number, (bottom, ceiling, colour) in enumerate(plot.intervals):
        edge = x1 - 2 - 5 * number
        span = scaled(np.clip([bottom, ceiling], low, high))
        canvas.fill(edge - 3, float(span[1]), edge, float(span[0]) + 1, colour, 0.6)
    for curve in plot.curves:
        y = np.clip(scaled(curve.y), y0, y1)
        known = np.isfinite(y)
        points = np.stack([across(1) * plot.x - x0 * (plot.x - 1), y], axis=-1)[known]
        canvas.line(_thinned(points), curve.colour, 1.6)
        if curve.dots and len(points) <= 60:
            for px, py in points:
                canvas.dot(px, py, curve.colour, 2)
    right = float(x1)
    for name, colour in reversed(_legend(plot, x1 - x0)):
        canvas.text(right, top + 7, name, size=13, align=1, colour=colour)
        right -= 9 + width_of(name, 13)
    canvas.text(x0, top + 6, plot.title, size=15, width=right - x0)
    if plot.bounds:
        after = x0 + 10 + width_of(plot.title, 15)
        text = f"{plot.bounds[0]:.4g} to {plot.bounds[1]:.4g}"
        if width_of(text, 12) <= right - after:
            canvas.text(after, top + 8, text, size=12, colour=_BOUND)


def _legend(plot: Plot, width: float) -> list[tuple[str, Colour]]:
    """Names of the curves; their first letters where whole ones would leave the title no room."""
    found = [(item.name, item.colour) for item in plot.curves if item.name]
    needed = width_of(plot.title, 15) + sum(9 + width_of(name, 13) for name, _ in found)
    return found if needed <= width else [(name[:1], colour) for name, colour in found]


def _range(plot: Plot) -> tuple[float, float]:
    """Of the axis: all values, intervals, and the bounds where they are not far away."""
    parts = [curve.y for curve in plot.curves]
    parts += [np.array(item[:2], float) for item in plot.intervals]
    seen = np.concatenate([np.ravel(part) for part in parts]) if parts else np.zeros(1)
    seen = seen[np.isfinite(seen) & ((seen > 0) | (not plot.logarithmic))]
    if not len(seen):
        return (0.1, 1.0) if plot.logarithmic else (0.0, 1.0)
    low, high = float(seen.min()), float(seen.max())
    span = high - low
    if plot.logarithmic:
        return low / 1.15, max(high * 1.15, low * 1.4)
    for bound in plot.bounds:  # a bound within the span of the values is shown
        if low - max(span, 1e-12) <= bound <= high + max(span, 1e-12):
            low, high = min(low, bound), max(high, bound)
    margin = 0.06 * (high - low) or 0.05 * abs(high) or 0.5
    return low - margin, high + margin


def _thinned(points: np.ndarray, most: int = 400) -> np.ndarray:
    """Every n-th point and the last one, so that long fits draw as fast as short ones."""
    step = -(-len(points) // most)
    return points if step <= 1 else np.concatenate([points[::step], points[-1:]])
