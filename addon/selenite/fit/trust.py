# SPDX-License-Identifier: GPL-3.0-or-later
"""How certain fitted values are: the native report, and in words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from .. import native
from ..messages import control, joined, message
from ..parameters import join_name, plain
from ..problems import listed
from . import pattern
from .diagnosis.gauge import ENVIRONMENT, gauges
from .field_kinds import IN_PLACE_OF
from .plan import FitPlan
from .unknowns import Unknown

if TYPE_CHECKING:
    from .._core import FitResult, ParameterConfidence

#: Between these an image of the same body can compensate for a transmission.
_PART_CLEAR = (0.05, 0.95)
#: Standard error of a misfit beyond which it says nothing: a fifth of the brightness, squared. And
#: standard errors below 0 that no noise explains which a render knows of.
_HIDDEN, _BELOW = 0.04, 3.0
#: Percent of the photos' brightness that a good match, and one that is close, leave unexplained.
GOOD, CLOSE = 1.0, 5.0
#: Factor of samples without a digit behind the point.
_MANY = 3
#: The loss that takes no notice of exposure, which is most of what it leaves unexplained.
_OF_ANY_EXPOSURE = "brightness-independent-mse"
T = TypeVar("T")
#: Ends of the bounds, in a sentence.
BOUNDS = {
    "minimum": message("word.minimum", "minimum"),
    "maximum": message("word.maximum", "maximum"),
}


@dataclass(frozen=True)
class Certainty:
    """How sure a parameter is, by component: None where the photos do not determine it, or no
    bound is met. `determined`: of all components; None without a refinement, where the others are
    empty. Beside an image of the world, a value that depends on its texels is not determined; its
    interval is that for these texels."""

    standard_error: tuple[float | None, ...] = ()
    interval_90: tuple[tuple[float, float] | None, ...] = ()
    determined: bool | None = None
    at_bound: tuple[str | None, ...] = ()
    correlated_with: tuple[str | None, ...] = ()

    def as_json(self) -> dict[str, object]:
        """Keys of one parameter in result.json: lists by channel for a colour."""
        return {
            "standard_error": _plain(self.standard_error),
            "interval_90": _plain(self.interval_90),
            "determined": self.determined,
            "at_bound": _plain(self.at_bound),
            "correlated_with": _plain(self.correlated_with),
        }


@dataclass(frozen=True)
class Misfit:
    """Squared brightness that no values explain. `hidden`: noise of the renders hides whether the
    photos are explained."""

    value: float
    standard_error: float
    explained: bool
    hidden: bool

    def as_json(self) -> dict[str, object]:
        """For result.json."""
        return asdict(self)


def certainty(unknown: Unknown, fit: FitResult) -> Certainty:
    """Of one parameter."""
    reported = fit.report.parameters.get(unknown.name)
    if reported is None:
        return Certainty()
    determined = reported.determined

    def shown(values: Sequence[T]) -> tuple[T | None, ...]:
        return tuple(v if ok else None for v, ok in zip(values, determined, strict=True))

    return Certainty(
        shown(reported.standard_error),
        shown(reported.interval_90),
        all(determined) and not depends_on_texels(unknown, fit),
        tuple(reported.at_bound),
        tuple(reported.correlated_with),
    )


def _plain(values: Sequence[object]) -> object:
    """A value, or a list of them; None where there is none."""
    return plain(values) if values else None


def misfit(fit: FitResult) -> Misfit | None:
    """None where there was no refinement."""
    if not fit.report.passes:
        return None
    found = fit.report.misfit
    value, error = found.value, found.standard_error
    return Misfit(value, error, found.explained, error > _HIDDEN or value < -_BELOW * error)


def explained(fit: FitResult) -> bool:
    """Whether the photos are explained within noise, and noise does not hide whether they are."""
    left = misfit(fit)
    return left is not None and left.explained and not left.hidden


def cancelled(fit: FitResult) -> bool:
    """Whether the user has stopped it."""
    return fit.stopped == native.core().StopReason.CANCELLED


def matches(fit: FitResult) -> bool:
    """Whether the photos are known to be explained but for `GOOD` percent of their brightness."""
    left = misfit(fit)
    if left is None or left.hidden:
        return False
    return left.explained or unexplained_percent(fit) <= GOOD


def unconverged(plan: FitPlan) -> list[str]:
    """Ids of photos with much light in isolated bright pixels. Their noise has tails that no
    interval knows of: the light of rare paths may be missing from a photo, or be there twice."""
    return [item.id for item in plan.captures if item.isolated > 0]


def _fields(fit: FitResult) -> str:
    """The names of the fitted grids and images; "" without one."""
    return " and ".join(fit.fields_best)


def sure(fit: FitResult) -> bool:
    """Whether the refinement has determined every value."""
    reported = fit.report.parameters
    return bool(reported) and all(all(entry.determined) for entry in reported.values())


def words(unknown: Unknown, fit: FitResult, *, intervals: bool = True) -> list[str]:
    """What a user should know about one value; without a refinement, what is known of its kind.
    intervals: not where a table has them."""
    reported = fit.report.parameters.get(unknown.name)
    if reported is None:
        return _fitted_with_an_image(unknown, fit)
    lines: list[str] = []
    if any(reported.determined):
        ends = [
            f"{low:.3f} to {high:.3f}" if ok else "?"
            for (low, high), ok in zip(reported.interval_90, reported.determined, strict=True)
        ]
        lines += [joined(": ", (_confidence(fit), "; ".join(ends)))] if intervals else []
        lines += _under_texels(unknown, fit)
    if not all(reported.determined):
        lines.append(_undetermined(unknown, reported, _alternatives(unknown, fit)))
    factor = max(reported.samples_factor)
    if math.isinf(factor):
        lines.append(
            message(
                "trust.photos-differ-more-than-asked",
                "less sure than asked, as the photos differ: more samples of them would not "
                "help, more photos or a better model may",
            )
        )
    elif factor > 1:
        lines.append(
            message(
                "trust.less-sure-than-asked",
                "less sure than asked: it would take about {factor} times the samples of these "
                "photos, at the precision Exact or the quality Accurate, or more photos",
                factor=f"{factor:.0f}" if factor > _MANY else f"{factor:.1f}",
            )
        )
    bounds = {side for side in reported.at_bound if side}
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


def _confidence(fit: FitResult) -> str:
    """What an interval is worth. It accounts for noise, for voxels fitted with the value, and for
    errors that pixels of a part or of a photo share: not for those that all photos share."""
    left = misfit(fit)
    if left is not None and left.hidden:
        return message(
            "trust.but-noise-renders-hides",
            "90 %, but noise of the renders hides whether the photos are explained",
        )
    if left is None or left.explained:
        return "90 %"
    if fields := _fields(fit):
        return message(
            "trust.provided-misfit",
            "90 %, provided that the misfit is that of {fields}",
            fields=fields,
        )
    share = unexplained_percent(fit)
    text = f"{share:.1f}" if share < 10 else f"{share:.0f}"
    return message(
        "trust.how-photos-their-parts",
        "90 % by how photos and their parts differ, with {text} % unexplained",
        text=text,
    )


def _fitted_with_an_image(unknown: Unknown, fit: FitResult) -> list[str]:
    """Of a transmission fitted with the image of its own body, which can compensate for it.
    Measured: docs/measurements/fields.md."""
    image = join_name(unknown.owner, IN_PLACE_OF["base_color"])
    if unknown.parameter.name != "transmission" or image not in fit.fields_best:
        return []
    value = float(np.ravel(fit.values_best[unknown.name])[0])
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


def depends_on_texels(unknown: Unknown, fit: FitResult) -> bool:
    """Whether it shapes reflections, as a roughness or an IOR, beside an image of the world: the
    resolution of directions moves it, and no interval knows of it. Measured:
    docs/measurements/fields.md."""
    of_gloss = unknown.parameter.name.rpartition("_")[2] in ("roughness", "ior")
    return of_gloss and ENVIRONMENT in fit.fields_best


def _under_texels(unknown: Unknown, fit: FitResult) -> list[str]:
    if not depends_on_texels(unknown, fit):
        return []
    rows, columns = np.shape(fit.fields_best[ENVIRONMENT])[:2]
    return [
        message(
            "trust.interval-takes-texels-light",
            "the interval holds for the {count} texels of {environment}: fit again with "
            "another number of them, and do not rely on a value that changes",
            count=rows * columns,
            environment=ENVIRONMENT,
        )
    ]


def _alternatives(unknown: Unknown, fit: FitResult) -> list[str]:
    """Its values in the alternative minima, where only these leave it undetermined."""
    if unknown.name not in {name.partition("[")[0] for name in fit.report.ambiguous}:
        return []
    return [_text(values[unknown.name]) for values in fit.report.alternative_minima]


def _text(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.3g}" for value in values)


def _undetermined(unknown: Unknown, reported: ParameterConfidence, alternatives: list[str]) -> str:
    """Names what could compensate for it."""
    channels = [c for c, ok in zip("RGB", reported.determined, strict=False) if not ok]
    which = f" in {', '.join(channels)}" if len(reported.determined) > 1 else ""
    others = {
        name.partition("[")[0]
        for name, ok in zip(reported.correlated_with, reported.determined, strict=True)
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


def sentences(plan: FitPlan, fit: FitResult, *, intervals: bool = True) -> list[str]:
    """All of it, a line each. intervals: not where a table has them."""
    lines: list[str] = [
        joined(": ", (item.name, text))
        for item in plan.unknowns
        for text in words(item, fit, intervals=intervals)
    ]
    reports = [fit.report.parameters.get(item.name) for item in plan.unknowns]
    if not all(all(one.determined) for one in reports if one is not None):
        lines.append(
            message(
                "trust.most-informative-next-photo",
                "{next_camera} reports the most informative next photo",
                next_camera=control("next-camera", "selenite next-camera RESULT_FOLDER"),
            )
        )
    lines += [gauge.text() for gauge in gauges(fit)]
    left = misfit(fit)
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
    for values in fit.report.alternative_minima:
        all_of_it = "; ".join(f"{item.name} {_text(values[item.name])}" for item in plan.unknowns)
        lines.append(
            message(
                "trust.alternative-minimum-equivalent-within",
                "Alternative minimum, equivalent within noise: {values}. Decide by "
                "eye, or take another photo, more samples or larger pictures",
                values=all_of_it,
            )
        )
    if fit.kept_start:
        text = message(
            "trust.no-values-found-whose",
            "No values were found whose loss is below that of the start: these are the start's",
        )
        if not matches(fit):
            cure = message("trust.check-lights-cameras-masks", "Check lights, cameras and masks")
            text = joined(". ", (text, cure))
        lines.append(text)
    for one in plan.fields:
        if (found := pattern.of_field(fit, one.name)) is not None:
            lines.append(found.sentence(one.name))
    if left is not None:
        lines.append(_misfit_text(left, unexplained_percent(fit), _fields(fit)))
    elif not plan.fields and (share := unexplained_percent(fit)) > 0:
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
    if text := of_search(fit):
        lines.append(text)
    return lines


def of_search(fit: FitResult) -> str:
    """What a multi-start has done, "" where there was none."""
    points, moved = fit.search.points, fit.search.moved
    if stopped_in_search(fit):
        if not points:
            return message(
                "trust.stopped-before-first-iteration",
                "Stopped before the first iteration: values are the start's",
            )
        which = (
            message("trust.best-them", "the best of them")
            if moved
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
        if moved
        else message("trust.kept-given-one", "kept the given one")
    )
    return message(
        "trust.multi-start-evaluated-starting",
        "Multi-start: evaluated {points} starting points and {went}",
        points=points,
        went=went,
    )


def stopped_in_search(fit: FitResult) -> bool:
    """Whether a fit was stopped in its multi-start, so that no step has followed."""
    return cancelled(fit) and not len(fit.history.iteration)


def unexplained_percent(fit: FitResult) -> float:
    """Percent of the photos' brightness, where they are not explained. The misfit has the weights
    of the loss, whose tails make little of what is very wrong in places: then that of the photos
    themselves is the larger one."""
    left = misfit(fit)
    of_fit = max(left.value, 0.0) if left else 0.0
    shares = [item.unexplained for item in fit.captures.values()]
    of_photos = sum(share**2 for share in shares) / max(len(shares), 1)
    return float(100 * max(of_fit, of_photos) ** 0.5)


def _misfit_text(left: Misfit, share: float, fields: str) -> str:
    if left.hidden:
        return message(
            "trust.misfit-not-known-squared",
            "Misfit: not known ({value} +- {standard_error} of squared brightness):"
            " few bright paths make most of the renders; take more samples, or "
            "larger lamps",
            value=f"{left.value:.3g}",
            standard_error=f"{left.standard_error:.2g}",
        )
    if left.explained:
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
