# SPDX-License-Identifier: GPL-3.0-or-later
"""How sure a fit is of its values: the native report for result.json, and in plain words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..parameters import join_name
from .field_kinds import IN_PLACE_OF
from .plan import FitPlan
from .unknowns import Unknown

#: Between these a transmission beside an image of its own body may be the image's doing.
_PART_CLEAR = (0.05, 0.95)
#: What a parameter without a report says.
UNKNOWN: dict[str, Any] = {
    "standard_error": None,
    "interval_90": None,
    "determined": None,
    "at_bound": None,
    "correlated_with": None,
}


def entries(unknown: Unknown, result: dict[str, Any]) -> dict[str, Any]:
    """Keys of one parameter in result.json. Lists by channel for a colour, except `determined`:
    every channel is. Null where the photos do not tell: an interval is shown where it holds.
    """
    told = (result.get("report") or {}).get("parameters", {}).get(unknown.name)
    if not told:
        return dict(UNKNOWN)
    determined = list(told["determined"])

    def plain(values: Sequence[Any]) -> Any:  # noqa: ANN401 - a value or a list of them
        return values[0] if len(values) == 1 else list(values)

    def shown(values: Sequence[Any]) -> Any:  # noqa: ANN401
        return plain([v if ok else None for v, ok in zip(values, determined, strict=True)])

    return {
        "standard_error": shown(told["standard_error"]),
        "interval_90": shown(told["interval_90"]),
        "determined": all(determined),
        "at_bound": plain(told["at_bound"]),
        "correlated_with": plain(told["correlated_with"]),
    }


def misfit(result: dict[str, Any]) -> dict[str, Any] | None:
    """For result.json; None where nothing was verified."""
    report = result.get("report") or {}
    return dict(report["misfit"]) if report.get("passes") else None


def _has_fields(result: dict[str, Any]) -> bool:
    return bool(result.get("fields_best"))


def sure(result: dict[str, Any]) -> bool:
    """Whether a verification has determined every value."""
    told = (result.get("report") or {}).get("parameters", {})
    return bool(told) and all(all(entry["determined"]) for entry in told.values())


def rivals(result: dict[str, Any]) -> list[dict[str, list[float]]]:
    """For result.json: values far from the answer that explain the photos as well."""
    return list((result.get("report") or {}).get("rivals", ()))


def words(unknown: Unknown, result: dict[str, Any]) -> list[str]:
    """What a user should know about one value; where nothing was verified, what is known of its
    kind."""
    lines = _beside_an_image(unknown, result)
    told = (result.get("report") or {}).get("parameters", {}).get(unknown.name)
    if not told:
        return lines
    intervals = [
        f"{low:.3f} to {high:.3f}" if ok else "?"
        for (low, high), ok in zip(told["interval_90"], told["determined"], strict=True)
    ]
    if any(told["determined"]):
        left = misfit(result)
        # An interval knows of noise, and of the voxels beside it: it holds nine times of ten if
        # nothing else is wrong. What voxels leave of the photos may be that.
        sure = "90 %"
        if left is not None and not left["explained"]:
            of_grid = "90 %, if what is left is the grid's"
            sure = of_grid if _has_fields(result) else "noise alone would allow"
        lines.append(f"{sure}: {'; '.join(intervals)}")
    if not all(told["determined"]):
        lines.append(_undetermined(unknown, told, _contested_by(unknown, result)))
    bounds = {side for side in told["at_bound"] if side}
    for side in sorted(bounds):
        bound = unknown.minimum if side == "minimum" else unknown.maximum
        lines.append(f"at its {side} {bound:g}: widen the bound, or something else is wrong")
    return lines


def _beside_an_image(unknown: Unknown, result: dict[str, Any]) -> list[str]:
    """Of a transmission fitted beside the image of its own body. Measured:
    docs/measurements/fields.md."""
    image = join_name(unknown.owner, IN_PLACE_OF["base_color"])
    if unknown.parameter.name != "transmission" or image not in (result.get("fields_best") or {}):
        return []
    value = float(np.ravel(result["values_best"][unknown.name])[0])
    if not _PART_CLEAR[0] < value < _PART_CLEAR[1]:
        return []
    return [
        "the image can make up for it: a paler one on a body that lets some light through looks "
        "much like a darker one on an opaque body. If yours is opaque, set it to 0, leave it out "
        "and fit again"
    ]


def _contested_by(unknown: Unknown, result: dict[str, Any]) -> list[str]:
    """Its values in rivals, where it is determined but for them."""
    contested = {
        name.partition("[")[0] for name in (result.get("report") or {}).get("contested", ())
    }
    if unknown.name not in contested:
        return []
    return [_text(rival[unknown.name]) for rival in rivals(result)]


def _text(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.3g}" for value in values)


def _undetermined(unknown: Unknown, told: dict[str, Any], contested_by: list[str]) -> str:
    """Names what could make up for it."""
    channels = [c for c, ok in zip("RGB", told["determined"], strict=False) if not ok]
    which = "" if len(told["determined"]) == 1 else f" in {', '.join(channels)}"
    others = {
        name.partition("[")[0]
        for name, ok in zip(told["correlated_with"], told["determined"], strict=True)
        if name and not ok
    } - {unknown.name}
    text = f"not determined by these photos{which}"
    if contested_by:
        text += f": with other values of the rest {' or '.join(contested_by)} explains them as well"
    elif others:
        text += f": {' and '.join(sorted(others))} can make up for it"
    return text


def sentences(plan: FitPlan, result: dict[str, Any]) -> list[str]:
    """All of it for the terminal and the log, a line each."""
    lines = [f"{item.name}: {text}" for item in plan.unknowns for text in words(item, result)]
    if any("not determined" in line for line in lines):
        lines.append(
            "Where another photo would tell most: selenite next-camera RESULT_FOLDER, or "
            "Suggest Next Camera in the panel"
        )
    left = misfit(result)
    if plan.fields and left is None:
        lines.append(
            "How sure these values are is not known: with a grid or an image, few photos leave "
            "open what is its doing and what theirs. Compare fits from other starts or to other "
            "photos"
        )
    for rival in rivals(result):
        all_of_it = "; ".join(f"{item.name} {_text(rival[item.name])}" for item in plan.unknowns)
        lines.append(
            f"Other values explain the photos as well: {all_of_it}. Decide by eye, or take another "
            "photo, more samples or larger pictures"
        )
    if left is not None:
        share = max(left["value"], 0.0) ** 0.5
        if left["explained"]:
            lines.append("Misfit: the photos are explained within noise")
        else:
            lines.append(
                f"Misfit: a difference of {100 * share:.1f} % of the photos' brightness is left "
                + (
                    "by the grid or image, which is not quite found, or by something else"
                    if _has_fields(result)
                    else "that none of these parameters explains; check lights, camera and geometry"
                )
            )
    found = result.get("search") or {}
    if found.get("points"):
        went = "went on from another start" if found["moved"] else "kept the start"
        lines.append(f"Search: looked at {found['points']} starts and {went}")
    return lines
