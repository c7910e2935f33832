# SPDX-License-Identifier: GPL-3.0-or-later
"""How certain fitted values are: the native report for result.json, and in words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import native
from ..parameters import join_name
from ..problems import listed
from .diagnosis.gauge import ENVIRONMENT, gauges
from .field_kinds import IN_PLACE_OF
from .plan import FitPlan
from .unknowns import Unknown

#: Between these an image of the same body can compensate for a transmission.
_PART_CLEAR = (0.05, 0.95)
#: Standard error of a misfit beyond which it says nothing: a fifth of the brightness, squared. And
#: standard errors below 0 that no noise explains which a render knows of.
_HIDDEN, _BELOW = 0.04, 3.0
#: Percent of the photos' brightness that a good match, and one that is close, leave unexplained.
GOOD, CLOSE = 1.0, 5.0
#: The loss that takes no notice of exposure, which is most of what it leaves unexplained.
_OF_ANY_EXPOSURE = "brightness-independent-mse"
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
    every channel is. Null where the photos do not determine it: an interval is given where it is
    valid. Beside an image of the world, a value that depends on its texels is not determined; its
    interval is that for these texels.
    """
    reported = _reported(unknown, result)
    if not reported:
        return dict(UNKNOWN)
    determined = list(reported["determined"])

    def plain(values: Sequence[Any]) -> Any:  # noqa: ANN401 - a value or a list of them
        return values[0] if len(values) == 1 else list(values)

    def shown(values: Sequence[Any]) -> Any:  # noqa: ANN401
        return plain([v if ok else None for v, ok in zip(values, determined, strict=True)])

    return {
        "standard_error": shown(reported["standard_error"]),
        "interval_90": shown(reported["interval_90"]),
        "determined": all(determined) and not depends_on_texels(unknown, result),
        "at_bound": plain(reported["at_bound"]),
        "correlated_with": plain(reported["correlated_with"]),
    }


def _report(result: dict[str, Any]) -> dict[str, Any]:
    """The native report; empty where there was no refinement."""
    return result.get("report") or {}


def _reported(unknown: Unknown, result: dict[str, Any]) -> dict[str, Any] | None:
    entry: dict[str, Any] | None = _report(result).get("parameters", {}).get(unknown.name)
    return entry


def misfit(result: dict[str, Any]) -> dict[str, Any] | None:
    """For result.json; None where there was no refinement. `hidden`: noise of the renders hides
    whether the photos are explained."""
    report = _report(result)
    if not report.get("passes"):
        return None
    found: dict[str, Any] = dict(report["misfit"])
    value, error = found["value"], found["standard_error"]
    return found | {"hidden": error > _HIDDEN or value < -_BELOW * error}


def explained(result: dict[str, Any]) -> bool:
    """Whether the photos are explained within noise, and noise does not hide whether they are."""
    left = misfit(result)
    return left is not None and bool(left["explained"]) and not left["hidden"]


def unconverged(plan: FitPlan) -> list[str]:
    """Ids of photos with much light in isolated bright pixels. Their noise has tails that no
    interval knows of: the light of rare paths may be missing from a photo, or be there twice."""
    return [item.id for item in plan.captures if item.isolated > 0]


def _fields(result: dict[str, Any]) -> str:
    """The names of the fitted grids and images; "" without one."""
    return " and ".join(result.get("fields_best") or ())


def sure(result: dict[str, Any]) -> bool:
    """Whether the refinement has determined every value."""
    reported = _report(result).get("parameters", {})
    return bool(reported) and all(all(entry["determined"]) for entry in reported.values())


def alternative_minima(result: dict[str, Any]) -> list[dict[str, list[float]]]:
    """For result.json: values far from the best ones that explain the photos equally well."""
    return list(_report(result).get("alternative_minima", ()))


def ambiguous(result: dict[str, Any]) -> list[str]:
    """For result.json: components, as "Body:base_color[1]", that only alternative minima leave
    undetermined."""
    return list(_report(result).get("ambiguous", ()))


def words(unknown: Unknown, result: dict[str, Any]) -> list[str]:
    """What a user should know about one value; without a refinement, what is known of its kind."""
    lines = _fitted_with_an_image(unknown, result)
    reported = _reported(unknown, result)
    if not reported:
        return lines
    intervals = [
        f"{low:.3f} to {high:.3f}" if ok else "?"
        for (low, high), ok in zip(reported["interval_90"], reported["determined"], strict=True)
    ]
    if any(reported["determined"]):
        lines += [f"{_confidence(result)}: {'; '.join(intervals)}", *_under_texels(unknown, result)]
    if not all(reported["determined"]):
        lines.append(_undetermined(unknown, reported, _alternatives(unknown, result)))
    bounds = {side for side in reported["at_bound"] if side}
    for side in sorted(bounds):
        bound = unknown.minimum if side == "minimum" else unknown.maximum
        if side in unknown.range_ends:
            lines.append(f"at its {side} {bound:g}, where its range ends")
        else:
            lines.append(f"at its {side} {bound:g}: widen the bound, or something else is wrong")
    return lines


def reasons(unknown: Unknown, result: dict[str, Any]) -> list[str]:
    """As `words`, without the interval itself."""
    return [text for text in words(unknown, result) if not text.startswith(_confidence(result))]


def level_of_gains(plan: FitPlan) -> str:
    """The image of the world at whose level all gains hold: without a photo of known gain it has
    the level that the prior of the gains gives it. "" where there is none."""
    free = all(item.free_gain != "none" for item in plan.captures)
    return next((item.name for item in plan.fields if item.kind.is_environment and free), "")


def _confidence(result: dict[str, Any]) -> str:
    """What an interval is worth. It accounts for noise, for voxels fitted with the value, and for
    errors that pixels of a part or of a photo share: not for those that all photos share."""
    left = misfit(result)
    if left is not None and left["hidden"]:
        return "90 %, but noise of the renders hides whether the photos are explained"
    if left is None or left["explained"]:
        return "90 %"
    if fields := _fields(result):
        return f"90 %, provided that the misfit is that of {fields}"
    share = unexplained_percent(result)
    text = f"{share:.1f}" if share < 10 else f"{share:.0f}"
    return f"90 % by how photos and their parts differ, with {text} % unexplained"


def _fitted_with_an_image(unknown: Unknown, result: dict[str, Any]) -> list[str]:
    """Of a transmission fitted with the image of its own body, which can compensate for it.
    Measured: docs/measurements/fields.md."""
    image = join_name(unknown.owner, IN_PLACE_OF["base_color"])
    if unknown.parameter.name != "transmission" or image not in (result.get("fields_best") or {}):
        return []
    value = float(np.ravel(result["values_best"][unknown.name])[0])
    if not _PART_CLEAR[0] < value < _PART_CLEAR[1]:
        return []
    return [
        "the image can compensate for it: a paler image on a partly transmitting body renders much "
        "like a darker one on an opaque body. If yours is opaque, set it to 0, leave it out and "
        "fit again"
    ]


def depends_on_texels(unknown: Unknown, result: dict[str, Any]) -> bool:
    """Whether it shapes reflections, as a roughness or an IOR, beside an image of the world: how
    finely this tells directions apart moves it, and no interval knows of it. Measured:
    docs/measurements/fields.md."""
    of_gloss = unknown.parameter.name.rpartition("_")[2] in ("roughness", "ior")
    return of_gloss and ENVIRONMENT in (result.get("fields_best") or {})


def _under_texels(unknown: Unknown, result: dict[str, Any]) -> list[str]:
    if not depends_on_texels(unknown, result):
        return []
    rows, columns = np.shape(result["fields_best"][ENVIRONMENT])[:2]
    return [
        f"the interval takes the {rows * columns} texels of {ENVIRONMENT} for the light: fit "
        "again with another number of them, and do not rely on a value that changes"
    ]


def _alternatives(unknown: Unknown, result: dict[str, Any]) -> list[str]:
    """Its values in the alternative minima, where only these leave it undetermined."""
    if unknown.name not in {name.partition("[")[0] for name in ambiguous(result)}:
        return []
    return [_text(values[unknown.name]) for values in alternative_minima(result)]


def _text(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.3g}" for value in values)


def _undetermined(unknown: Unknown, reported: dict[str, Any], alternatives: list[str]) -> str:
    """Names what could compensate for it."""
    channels = [c for c, ok in zip("RGB", reported["determined"], strict=False) if not ok]
    which = "" if len(reported["determined"]) == 1 else f" in {', '.join(channels)}"
    others = {
        name.partition("[")[0]
        for name, ok in zip(reported["correlated_with"], reported["determined"], strict=True)
        if name and not ok
    } - {unknown.name}
    text = f"not determined by these photos{which}"
    if alternatives:
        text += f": {' or '.join(alternatives)} in an equivalent alternative minimum"
    elif others:
        text += f": {' and '.join(sorted(others))} can compensate for it, so it has no interval"
    else:
        text += ": values far apart render alike, so it has no interval"
    return text


def sentences(plan: FitPlan, result: dict[str, Any], *, intervals: bool = True) -> list[str]:
    """All of it, a line each. intervals: not where a table has them."""
    said = words if intervals else reasons
    lines = [f"{item.name}: {text}" for item in plan.unknowns for text in said(item, result)]
    if any("not determined" in line for line in lines):
        lines.append(
            "The most informative next photo: selenite next-camera RESULT_FOLDER, or Suggest Next "
            "Camera in the panel"
        )
    lines += [gauge.text() for gauge in gauges(result)]
    left = misfit(result)
    if plan.fields and left is None:
        names = " and ".join(item.name for item in plan.fields)
        lines.append(
            "The errors of these values are not known: few photos cannot separate them from "
            f"{names}. Compare fits from other starts or to other photos"
        )
    for values in alternative_minima(result):
        all_of_it = "; ".join(f"{item.name} {_text(values[item.name])}" for item in plan.unknowns)
        lines.append(
            f"Alternative minimum, equivalent within noise: {all_of_it}. Decide by eye, or take "
            "another photo, more samples or larger pictures"
        )
    if result.get("kept_start"):
        advice = "" if explained(result) else ". Check lights, cameras and masks"
        lines.append(
            "No values were found whose loss is below that of the start: these are the start's"
            + advice
        )
    if left is not None:
        lines.append(_misfit_text(left, unexplained_percent(result), _fields(result)))
    elif not plan.fields and (share := unexplained_percent(result)) > 0:
        counts = plan.request.settings.loss != _OF_ANY_EXPOSURE
        lines += [_unexplained(share)] if counts else []
    noisy = unconverged(plan)
    if noisy:
        lines.append(
            f"Much light of {listed(noisy)} is in isolated bright pixels: values may be wrong by "
            "more than their intervals say"
        )
    if text := of_search(result):
        lines.append(text)
    return lines


def of_search(result: dict[str, Any]) -> str:
    """What a multi-start has done, "" where there was none."""
    found = result.get("search") or {}
    points = found.get("points")
    if stopped_in_search(result):
        if not points:
            return "Stopped before the first iteration: values are the start's"
        which = "the best of them" if found["moved"] else "the start's: none is clearly better"
        return (
            f"Stopped in the multi-start after {points} starting points: the values are {which}, "
            "not refined"
        )
    if not points:
        return ""
    went = "continued from another one" if found["moved"] else "kept the given one"
    return f"Multi-start: evaluated {points} starting points and {went}"


def stopped_in_search(result: dict[str, Any]) -> bool:
    """Whether a fit was stopped in its multi-start, so that no step has followed."""
    history = result.get("history") or {}
    rows = len(history.get("iteration", ()))
    return result.get("stopped") == native.core().StopReason.CANCELLED and not rows


def unexplained_percent(result: dict[str, Any]) -> float:
    """Percent of the photos' brightness, where they are not explained. The misfit has the weights
    of the loss, whose tails make little of what is very wrong in places: then that of the photos
    themselves is the larger one."""
    left = misfit(result)
    of_fit = max(left["value"], 0.0) if left else 0.0
    shares = [item.get("unexplained") or 0.0 for item in (result.get("captures") or {}).values()]
    of_photos = sum(share**2 for share in shares) / max(len(shares), 1)
    return float(100 * max(of_fit, of_photos) ** 0.5)


def _misfit_text(left: dict[str, Any], share: float, fields: str) -> str:
    if left["hidden"]:
        return (
            f"Misfit: not known ({left['value']:.3g} +- {left['standard_error']:.2g} of squared "
            "brightness): few bright paths make most of the renders; take more samples, or larger "
            "lamps"
        )
    if left["explained"]:
        return "Misfit: the photos are explained within noise"
    return _unexplained(share, fields)


def _unexplained(share: float, fields: str = "") -> str:
    text = f"Misfit: {share:.1f} % of the photos' brightness is not explained"
    if fields:
        return f"{text}: {fields} has not converged, or there is another cause"
    if share <= GOOD:
        return f"{text} by these parameters"
    if share <= CLOSE:
        return f"{text} by these parameters; compare the pictures"
    return f"{text} by these parameters; check lights, camera and geometry"
