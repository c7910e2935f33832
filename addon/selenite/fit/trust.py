# SPDX-License-Identifier: GPL-3.0-or-later
"""How certain fitted values are: the native report for result.json, and in words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import native
from ..messages import control, joined, message
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
#: Ends of the bounds, in a sentence.
BOUNDS = {
    "minimum": message("word.minimum", "minimum"),
    "maximum": message("word.maximum", "maximum"),
}
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


def matches(result: dict[str, Any]) -> bool:
    """Whether the photos are known to be explained but for `GOOD` percent of their brightness."""
    left = misfit(result)
    if left is None or left["hidden"]:
        return False
    return bool(left["explained"]) or unexplained_percent(result) <= GOOD


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


def words(unknown: Unknown, result: dict[str, Any], *, intervals: bool = True) -> list[str]:
    """What a user should know about one value; without a refinement, what is known of its kind.
    intervals: not where a table has them."""
    lines = _fitted_with_an_image(unknown, result)
    reported = _reported(unknown, result)
    if not reported:
        return lines
    if any(reported["determined"]):
        ends = [
            f"{low:.3f} to {high:.3f}" if ok else "?"
            for (low, high), ok in zip(reported["interval_90"], reported["determined"], strict=True)
        ]
        lines += [joined(": ", (_confidence(result), "; ".join(ends)))] if intervals else []
        lines += _under_texels(unknown, result)
    if not all(reported["determined"]):
        lines.append(_undetermined(unknown, reported, _alternatives(unknown, result)))
    bounds = {side for side in reported["at_bound"] if side}
    for side in sorted(bounds):
        bound = unknown.minimum if side == "minimum" else unknown.maximum
        if side in unknown.range_ends:
            lines.append(
                message(
                    "trust.at-where-range-ends",
                    "at its {side} {bound}, where its range ends",
                    side=BOUNDS[side],
                    bound=f"{bound:g}",
                )
            )
        else:
            lines.append(
                message(
                    "trust.at-widen-bound-something",
                    "at its {side} {bound}: widen the bound, or something else is wrong",
                    side=BOUNDS[side],
                    bound=f"{bound:g}",
                )
            )
    return lines


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
        return message(
            "trust.but-noise-renders-hides",
            "90 %, but noise of the renders hides whether the photos are explained",
        )
    if left is None or left["explained"]:
        return "90 %"
    if fields := _fields(result):
        return message(
            "trust.provided-misfit",
            "90 %, provided that the misfit is that of {fields}",
            fields=fields,
        )
    share = unexplained_percent(result)
    text = f"{share:.1f}" if share < 10 else f"{share:.0f}"
    return message(
        "trust.how-photos-their-parts",
        "90 % by how photos and their parts differ, with {text} % unexplained",
        text=text,
    )


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
        message(
            "trust.image-can-compensate-paler",
            "the image can compensate for it: a paler image on a partly "
            "transmitting body renders much like a darker one on an opaque body. If"
            " yours is opaque, set it to 0, leave it out and fit again",
        )
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
        message(
            "trust.interval-takes-texels-light",
            "the interval holds for the {count} texels of {environment}: fit again with "
            "another number of them, and do not rely on a value that changes",
            count=rows * columns,
            environment=ENVIRONMENT,
        )
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
    which = f" in {', '.join(channels)}" if len(reported["determined"]) > 1 else ""
    others = {
        name.partition("[")[0]
        for name, ok in zip(reported["correlated_with"], reported["determined"], strict=True)
        if name and not ok
    } - {unknown.name}
    text = message(
        "trust.not-determined-photos", "not determined by these photos{which}", which=which
    )
    if alternatives:
        why = message(
            "trust.equivalent-alternative-minimum",
            "{names} in an equivalent alternative minimum",
            names=joined(message("trust.or", " or "), alternatives),
        )
    elif others:
        why = message(
            "trust.can-compensate-so-no",
            "{names} can compensate for it, so it has no interval",
            names=joined(message("trust.and", " and "), sorted(others)),
        )
    else:
        why = message(
            "trust.values-far-apart-render",
            "values far apart render alike, so it has no interval",
        )
    return joined(": ", (text, why))


def sentences(plan: FitPlan, result: dict[str, Any], *, intervals: bool = True) -> list[str]:
    """All of it, a line each. intervals: not where a table has them."""
    lines: list[str] = [
        joined(": ", (item.name, text))
        for item in plan.unknowns
        for text in words(item, result, intervals=intervals)
    ]
    reports = [_reported(item, result) for item in plan.unknowns]
    if not all(all(one["determined"]) for one in reports if one):
        lines.append(
            message(
                "trust.most-informative-next-photo",
                "{next_camera} reports the most informative next photo",
                next_camera=control("next-camera", "selenite next-camera RESULT_FOLDER"),
            )
        )
    lines += [gauge.text() for gauge in gauges(result)]
    left = misfit(result)
    if plan.fields and left is None:
        names = " and ".join(item.name for item in plan.fields)
        lines.append(
            message(
                "trust.errors-values-not-known",
                "The errors of these values are not known: few photos cannot separate "
                "them from {names}. Compare fits from other starts or to other photos",
                names=names,
            )
        )
    for values in alternative_minima(result):
        all_of_it = "; ".join(f"{item.name} {_text(values[item.name])}" for item in plan.unknowns)
        lines.append(
            message(
                "trust.alternative-minimum-equivalent-within",
                "Alternative minimum, equivalent within noise: {values}. Decide by "
                "eye, or take another photo, more samples or larger pictures",
                values=all_of_it,
            )
        )
    if result.get("kept_start"):
        text = message(
            "trust.no-values-found-whose",
            "No values were found whose loss is below that of the start: these are the start's",
        )
        if not matches(result):
            cure = message("trust.check-lights-cameras-masks", "Check lights, cameras and masks")
            text = joined(". ", (text, cure))
        lines.append(text)
    if left is not None:
        lines.append(_misfit_text(left, unexplained_percent(result), _fields(result)))
    elif not plan.fields and (share := unexplained_percent(result)) > 0:
        counts = plan.request.settings.loss != _OF_ANY_EXPOSURE
        lines += [_unexplained(share)] if counts else []
    noisy = unconverged(plan)
    if noisy:
        lines.append(
            message(
                "trust.much-light-isolated-bright",
                "Much light of {names} is in isolated bright pixels: values may be "
                "wrong by more than their intervals say",
                names=listed(noisy),
            )
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
            return message(
                "trust.stopped-before-first-iteration",
                "Stopped before the first iteration: values are the start's",
            )
        which = (
            message("trust.best-them", "the best of them")
            if found["moved"]
            else message("trust.start-none-clearly-better", "the start's: none is clearly better")
        )
        return message(
            "trust.stopped-multi-start-after",
            "Stopped in the multi-start after {points} starting points: the values "
            "are {which}, not refined",
            points=points,
            which=which,
        )
    if not points:
        return ""
    went = (
        message("trust.continued-from-another-one", "continued from another one")
        if found["moved"]
        else message("trust.kept-given-one", "kept the given one")
    )
    return message(
        "trust.multi-start-evaluated-starting",
        "Multi-start: evaluated {points} starting points and {went}",
        points=points,
        went=went,
    )


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
        return message(
            "trust.misfit-not-known-squared",
            "Misfit: not known ({value} +- {standard_error} of squared brightness):"
            " few bright paths make most of the renders; take more samples, or "
            "larger lamps",
            value=f"{left['value']:.3g}",
            standard_error=f"{left['standard_error']:.2g}",
        )
    if left["explained"]:
        return message(
            "trust.misfit-photos-explained-within", "Misfit: the photos are explained within noise"
        )
    return _unexplained(share, fields)


def _unexplained(share: float, fields: str = "") -> str:
    text = message(
        "trust.misfit-photos-brightness-not",
        "Misfit: {share} % of the photos' brightness is not explained",
        share=f"{share:.1f}",
    )
    if fields:
        return message(
            "trust.not-converged-there-another",
            "{text}: {fields} has not converged, or there is another cause",
            text=text,
            fields=fields,
        )
    if share <= GOOD:
        return message("trust.parameters", "{text} by these parameters", text=text)
    if share <= CLOSE:
        return message(
            "trust.parameters-compare-pictures",
            "{text} by these parameters; compare the pictures",
            text=text,
        )
    return message(
        "trust.parameters-check-lights-camera",
        "{text} by these parameters; check lights, camera and geometry",
        text=text,
    )
