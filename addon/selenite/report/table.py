# SPDX-License-Identifier: GPL-3.0-or-later
"""A result as a table: parameter, start, fitted, 90 % interval, verdict. The terminal and the panel
have the same lines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from .. import mean_free_path
from ..capture.prepared import Capture
from ..fit import trust
from ..fit.diagnosis.gauge import gauges
from ..fit.fields import FieldUnknown
from ..fit.job import fitted_values
from ..fit.plan import FitPlan
from ..fit.unknowns import Unknown
from ..messages import joined, message
from ..parameters import Values
from .findings import Finding, findings, in_short
from .finished_fit import FinishedFit
from .result_file import photo_row

if TYPE_CHECKING:
    from .._core import FitResult

TITLES = ("parameter", "start", "fitted", "90 % interval", "verdict")
#: What a sureness is called.
WORDS = {"SURE": "determined", "WEAK": "weak", "OPEN": "not determined", "UNKNOWN": ""}
#: Decimals of a number of which no interval is known, by its size, and at most.
_DIGITS, _MOST = 4, 5
#: Of a logarithm: half of 0.29 to 0.31 is 0.01.
_ROUNDING = 1e-6
_CHANNELS = ("red", "green", "blue")


@dataclass(frozen=True)
class Line:
    """One number. interval: "" where there is none; verdict: of WORDS."""

    name: str
    start: str
    fitted: str
    interval: str = ""
    verdict: str = ""

    @property
    def cells(self) -> tuple[str, str, str, str, str]:
        """In the order of TITLES."""
        return self.name, self.start, self.fitted, self.interval, self.verdict


def lines(plan: FitPlan, result: FinishedFit) -> list[Line]:
    """Every number that was fitted: parameters by channel, means of fields, gains and shifts."""
    values = fitted_values(plan, result.fit)
    found = []
    for unknown, finding in zip(plan.unknowns, findings(plan, result.fit), strict=True):
        found += _of_parameter(unknown, values[unknown.owner, unknown.parameter.name], finding)
        if unknown.parameter.name == "extinction":
            found.append(_length(unknown, values[unknown.owner, "extinction"], plan))
    for field in plan.fields:
        found += _of_field(field, result)
    for capture in plan.captures:
        found += _of_photo(capture, result)
    return found


def sentences(plan: FitPlan, fit: FitResult) -> list[str]:
    """At most three: what is explained, why a value is open, and what to do. log.txt has all."""
    found = [trust.of_search(fit)] if trust.stopped_in_search(fit) else []
    found += [in_short(plan, fit).sentence]
    found += [gauge.text() for gauge in gauges(fit)]
    for unknown in plan.unknowns:
        why = trust.words(unknown, fit, intervals=False)
        found += [joined(": ", (unknown.name, text)) for text in why]
    light = trust.level_of_gains(plan)
    if light:
        found.append(
            message(
                "table.gains-hold",
                "The gains hold at this level of {light}: give one photo a gain of none",
                light=light,
            )
        )
    return [joined("", (text, "" if text.endswith(".") else ".")) for text in found[:3]]


def decimals(half: float) -> int:
    """Of a number that is known to +-half: two digits of that."""
    if not (math.isfinite(half) and half > 0):
        return _DIGITS
    return min(max(1 - math.floor(math.log10(half) + _ROUNDING), 0), _MOST)


def number(value: float, half: float | None = None) -> str:
    """With as many digits as are known."""
    return f"{value:.{_DIGITS}g}" if half is None else f"{value:.{decimals(half)}f}"


def with_half(values: Sequence[float], half: float) -> str:
    """ "0.303 \u00b1 0.004": half of an interval in one digit, the values alike."""
    places = min(max(decimals(half) - 1, 0), _MOST)
    return " ".join(f"{value:.{places}f}" for value in values) + half_text(half)


def half_text(half: float) -> str:
    """ " \u00b1 0.004" """
    return f" \u00b1 {half:.{min(max(decimals(half) - 1, 0), _MOST)}f}"


def interval(low: float, high: float) -> str:
    """ "0.299 to 0.307" """
    half = (high - low) / 2
    return f"{number(low, half)} to {number(high, half)}"


def _of_parameter(unknown: Unknown, value: Values, finding: Finding) -> list[Line]:
    names = [""] if len(value) == 1 else [f" {channel}" for channel in _CHANNELS]
    unit = "" if unknown.parameter.unit in ("", "1") else f" [{unknown.parameter.unit}]"
    found = []
    for at, channel in enumerate(names[: len(value)]):
        half = (finding.high[at] - finding.low[at]) / 2 if finding.low else None
        between = interval(finding.low[at], finding.high[at]) if finding.low else ""
        word = WORDS[finding.sureness] if at == 0 else ""
        name = f"{unknown.name}{channel}{unit}"
        found.append(Line(name, number(unknown.start[at]), number(value[at], half), between, word))
    return found


def _length(unknown: Unknown, value: Values, plan: FitPlan) -> Line:
    """What an extinction means."""
    start = mean_free_path.of(unknown.start, plan.millimetres).text()
    return Line("  mean free path", start, mean_free_path.of(value, plan.millimetres).text())


def _of_field(field: FieldUnknown, result: FinishedFit) -> list[Line]:
    """Means over voxels or texels."""
    start, fitted = field.mean(field.values), result.mean(field)
    names = [""] if len(fitted) == 1 else [f" {channel}" for channel in field.CHANNELS]
    return [
        Line(f"{field.name}, mean{name}", number(a), number(b))
        for name, a, b in zip(names, start, fitted, strict=True)
    ]


def _of_photo(capture: Capture, result: FinishedFit) -> list[Line]:
    """Gain and shift, where the fit has found them."""
    found, lines = photo_row(capture, result), []
    if found.gain_interval_90 is not None:
        names = [""] if capture.free_gain == "scalar" else [f" {name}" for name in _CHANNELS]
        for at, name in enumerate(names):
            low, high = found.gain_interval_90[at]
            known = math.isfinite(high) and math.isfinite(low)
            lines.append(
                Line(
                    f"Photo {capture.id}: gain{name}",
                    number(capture.gain[at]),
                    number(found.gain[at], (high - low) / 2 if known else None),
                    interval(low, high) if known else "",
                )
            )
    if found.shift_believed is not None:
        across, down, roll = found.shift
        title = f"Photo {capture.id}: shift"
        doubt = "" if found.shift_believed else "not to be believed"
        moved = f"{across:.2f}, {down:.2f}"
        lines.append(Line(f"{title} [pixels]", "0, 0", moved, verdict=doubt))
        lines.append(Line(f"{title}, roll [degrees]", "0", f"{roll:.2f}"))
    return lines
