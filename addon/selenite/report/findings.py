# SPDX-License-Identifier: GPL-3.0-or-later
"""A result in short: each value with its interval and how sure it is, and one sentence for all."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from .. import native
from ..fit import trust
from ..fit.diagnosis.course import still_falling
from ..fit.job import fitted_values
from ..fit.plan import FitPlan
from ..fit.unknowns import Unknown
from ..parameters import Values

SURE, WEAK, OPEN, UNKNOWN = "SURE", "WEAK", "OPEN", "UNKNOWN"
#: Half an interval that is longer than this share of the bounds, on the scale of the parameter, is
#: a weak answer.
_WEAK = 0.1
#: Where a scale by ratio begins, for it has no 0.
_LEAST = 1e-6


@dataclass(frozen=True)
class Finding:
    """One fitted parameter. low and high: ends of the 90 % interval, () where there is none.

    sureness: SURE; WEAK for a long interval, a value at its bound, a roughness beside an unknown
    image of the world, or photos that are far from explained or have not converged;
    OPEN where the photos do not determine it; UNKNOWN where no interval was computed.
    bar: both ends, and place: the value, between 0 and 1 of the bounds, means over channels.
    """

    owner: str
    parameter: str
    unit: str
    value: Values
    low: Values
    high: Values
    sureness: str
    bar: tuple[float, float]
    place: float


@dataclass(frozen=True)
class InShort:
    """sentence: about the whole, and what to do next. is_wrong: the pictures are to be compared
    before the values are used."""

    sentence: str
    icon: str
    is_wrong: bool = False


def findings(plan: FitPlan, result: dict[str, Any]) -> list[Finding]:
    """In the order of the plan, without grids and images."""
    values = fitted_values(plan, result)
    trusted = left_open(result) <= trust.CLOSE and not trust.unconverged(plan)
    return [
        _finding(item, values[item.owner, item.parameter.name], result, trusted=trusted)
        for item in plan.unknowns
    ]


def in_short(plan: FitPlan, result: dict[str, Any]) -> InShort:
    """Whether the photos are explained, which values are open, and the next thing to do."""
    icon, text = _verdict(plan, findings(plan, result), result)
    kept = bool(result.get("kept_start")) and not trust.explained(result)
    return InShort(text, icon, kept or _is_wrong(plan, result))


def left_open(result: dict[str, Any]) -> float:
    """Percent of the photos' brightness that is not explained, beyond noise; infinite where that is
    not known."""
    left = trust.misfit(result)
    if left is None or left["hidden"]:
        return math.inf
    return 0.0 if left["explained"] else trust.unexplained_percent(result)


def _is_wrong(plan: FitPlan, result: dict[str, Any]) -> bool:
    share = left_open(result)
    return trust.CLOSE < share < math.inf and not plan.fields


def _verdict(plan: FitPlan, found: Sequence[Finding], result: dict[str, Any]) -> tuple[str, str]:
    """(icon, sentence)"""
    fields = bool(plan.fields)
    if result.get("kept_start") and not trust.explained(result):  # else the start was right
        return OPEN, (
            "Nothing better than the start was found: check lights, cameras and masks, then fit "
            "again."
        )
    if still_falling(result):
        return WEAK, (
            "The loss was still falling when the iterations ended: fit again with more iterations."
        )
    left = trust.misfit(result)
    if left is None:
        if result.get("stopped") == native.core().StopReason.CANCELLED and not fields:
            return UNKNOWN, (
                "Stopped before intervals were computed: let a fit end to know how sure the "
                "values are."
            )
        why = "with a grid or image" if fields else "by this kind of fit"
        return UNKNOWN, (
            f"How sure the values are is not known {why}: compare the pictures, or fit from "
            "another start."
        )
    if left["hidden"]:
        return WEAK, (
            "Noise of the renders hides whether the photos are explained: fit again with more "
            "samples."
        )
    if trust.unconverged(plan):
        return WEAK, (
            "Isolated bright pixels have much of the photos' light: values may be wrong by more "
            "than their intervals say. Render the photos with more samples and fit again."
        )
    share = left_open(result)
    if _is_wrong(plan, result):
        return OPEN, (
            f"Wrong camera or light? {share:.0f} % of the photos' brightness is not explained: "
            "compare the pictures before you apply the values."
        )
    if trust.alternative_minima(result):
        return OPEN, (
            "Other values explain the photos equally well: decide by eye, or add a photo "
            "(Suggest Next Camera)."
        )
    undecided = [item for item in found if item.sureness == OPEN]
    if undecided:
        count = f"{len(undecided)} of {len(found)} values are" if len(found) > 1 else "the value is"
        return OPEN, (
            f"{_match(share)}, but {count} not determined by the photos: add a photo (Suggest Next "
            "Camera)."
        )
    if share > trust.GOOD:
        return WEAK, (
            f"{_match(share)}: {share:.1f} % of the photos' brightness is not explained. See the "
            "pictures, then apply the values."
        )
    if any(item.sureness == WEAK for item in found):
        return WEAK, (
            f"{_match(share)}; some values are known roughly only: apply them, or add a photo."
        )
    why = "the photos are explained within noise"
    if share > 0:
        why = f"{share:.1f} % of the photos' brightness is not explained"
    return SURE, f"{_match(share)}: {why}. Apply the values."


def _match(share: float) -> str:
    return "Good match" if share <= trust.GOOD else "Close"


def _finding(unknown: Unknown, value: Values, result: dict[str, Any], *, trusted: bool) -> Finding:
    entry = trust.entries(unknown, result)
    name = unknown.parameter
    place = _mean([_place(unknown, x) for x in value])
    known = entry["determined"] is not None
    if not known:
        return Finding(
            unknown.owner, name.name, name.unit, value, (), (), UNKNOWN, (place, place), place
        )
    rows = entry["interval_90"]
    rows = [rows] if len(value) == 1 else rows
    ends = [row for row in rows if row is not None]
    if len(ends) < len(value):
        return Finding(unknown.owner, name.name, name.unit, value, (), (), OPEN, (0.0, 1.0), place)
    low, high = (tuple(float(row[side]) for row in ends) for side in (0, 1))
    bar = (
        _mean([_place(unknown, x) for x in low]),
        _mean([_place(unknown, x) for x in high]),
    )
    long = any(
        _place(unknown, b) - _place(unknown, a) > 2 * _WEAK for a, b in zip(low, high, strict=True)
    )
    bounds = entry["at_bound"]
    at_bound = any(bounds if isinstance(bounds, list) else [bounds])
    weak = long or at_bound or trust.depends_on_texels(unknown, result)
    sureness = SURE if trusted and not weak else WEAK
    return Finding(unknown.owner, name.name, name.unit, value, low, high, sureness, bar, place)


def _place(unknown: Unknown, value: float) -> float:
    """Where a value lies between its bounds, 0 to 1; by ratio where that is the scale."""
    low, high = unknown.minimum, unknown.maximum
    if unknown.by_ratio:
        low, high, value = (math.log(max(x, _LEAST)) for x in (low, high, value))
    if not high > low:
        return 0.5
    return min(max((value - low) / (high - low), 0.0), 1.0)


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values)
