# SPDX-License-Identifier: GPL-3.0-or-later
"""What compensates for what in the brightness of the photos: light, reflectance and gains.

Photos show a product of the three. Where nothing holds one of them, the normal matrix has a
direction next to null in which they change together. The native report lists such directions.
What the scene and the request alone tell of it is said before a fit.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...capture.prepared import Capture
from ...messages import joined, message
from ...parameters import join_name, split_name
from ...problems import listed
from ...scene_read.values import SceneValues

if TYPE_CHECKING:
    from ..._core import FitResult

#: Parameters that brightness is proportional to, or nearly.
_LIGHT = ("power", "strength", "color", "emission_color", "emission_strength")
_REFLECTANCE = ("base_color", "albedo")
#: The same with a value at every place, of which the native report lists no directions.
ENVIRONMENT = join_name("World", "environment")
_COLOURS = (*_REFLECTANCE, "base_color_texture", "albedo_grid")


@dataclass(frozen=True)
class Gauge:
    """Values that compensate for each other: parameters as "Body:base_color", ids of captures."""

    lights: tuple[str, ...]
    reflectances: tuple[str, ...]
    captures: tuple[str, ...]

    @property
    def parameters(self) -> tuple[str, ...]:
        """All of them."""
        return self.lights + self.reflectances

    def as_json(self) -> dict[str, list[str]]:
        """For result.json."""
        return {"parameters": list(self.parameters), "captures": list(self.captures)}

    def text(self) -> str:
        """What it means and what to do, in one sentence."""
        names, cures = list(self.parameters), []
        if self.captures:
            photos = " and ".join(self.captures)
            if len(self.captures) > 1:
                names.append(message("gauge.gains", "the gains of {photos}", photos=photos))
            else:
                names.append(message("gauge.gain", "the gain of {photo}", photo=photos))
            cures.append(
                message(
                    "gauge.give-one-photo-gain",
                    "give one photo a gain of none, as of a known exposure",
                )
            )
        if self.reflectances:
            cures.append(
                message(
                    "gauge.leave-out-color-one",
                    "leave out the color of one material that is known, such as a grey card",
                )
            )
        if self.lights:
            cures.append(
                message(
                    "gauge.leave-out-power-one", "leave out the power of one lamp that is measured"
                )
            )
        *first, last = names
        return message(
            "gauge.compensate-each-other-photos",
            "{first} and {last} compensate for each other: photos show only their "
            "product, so the brightness of each is open; {cures}",
            first=joined(", ", first),
            last=last,
            cures=joined(message("gauge.or", ", or "), cures),
        )


def remarks(values: SceneValues, captures: Sequence[Capture], names: Sequence[str]) -> list[str]:
    """Before a fit: a sentence for each factor that nothing holds. names: of all that is fitted."""
    return [*_of_gains(values, captures, names), *_of_environment(values, names)]


def _of_gains(values: SceneValues, captures: Sequence[Capture], names: Sequence[str]) -> list[str]:
    """Where the gain of every photo is free."""
    bright = [n for n in names if n == ENVIRONMENT or n.rpartition(":")[2] in _LIGHT + _COLOURS]
    if not bright or not captures or any(item.free_gain == "none" for item in captures):
        return []
    bright.sort(key=lambda name: name.rpartition(":")[2] in _COLOURS)  # light, which nothing ties
    coloured = bright[0].rpartition(":")[2] in _COLOURS
    if coloured and (known := sorted(_seen(values) - _of_unknown_colour(values, names))):
        return [
            message(
                "gauge.gain-every-photo-free-2",
                "Every photo's gain is free: only the prior (about 1, within a factor of two) "
                "holds the brightness, or the color of {names} in the scene if it is right. "
                "Set the gain of one photo to none",
                names=listed(known),
            )
        ]
    return [
        message(
            "gauge.gain-every-photo-free",
            "The gain of every photo is free, and {name} can compensate for it: only the "
            "prior of a gain (about 1, within a factor of two) holds the brightness. Set "
            "the gain of one photo to none",
            name=bright[0],
        )
    ]


def _of_environment(values: SceneValues, names: Sequence[str]) -> list[str]:
    """Where the environment and the colours of all that is seen are unknown, and no lamp is
    known."""
    if ENVIRONMENT not in names:
        return []
    pairs = [split_name(name) for name in names]
    unknown, seen = _of_unknown_colour(values, names), _seen(values)
    fitted = {owner for owner, name in pairs if name == "power"}
    known = [
        item.name
        for item in values.lights
        if item.power > 0 and max(item.color) > 0 and item.name not in fitted
    ]
    if not unknown or seen - unknown or known:
        return []
    colours = [join_name(*pair) for pair in pairs if pair[0] in unknown and pair[1] in _COLOURS]
    return [
        message(
            "gauge.compensate-each-other-since",
            "{environment} and {colours} compensate for each other, since no material"
            " or lamp in the scene is known: a brighter room with darker surfaces "
            "looks the same. Add a grey card or another known material to photos "
            "and scene, or fit one of the two",
            environment=ENVIRONMENT,
            colours=" and ".join(colours),
        )
    ]


def _seen(values: SceneValues) -> set[str]:
    """Materials that cameras may see."""
    materials = {item.name for item in values.materials}
    shown = (item.materials for item in values.objects if item.visible_to_camera)
    return {name for names in shown for name in names} & materials


def _of_unknown_colour(values: SceneValues, names: Sequence[str]) -> set[str]:
    """Materials whose colour is fitted."""
    materials = {item.name for item in values.materials}
    pairs = (split_name(name) for name in names)
    return {owner for owner, name in pairs if owner in materials and name in _COLOURS}


def gauges(fit: FitResult) -> list[Gauge]:
    """Those that a fit reports: directions of light, reflectance and gain, two of them at least."""
    found: list[Gauge] = []
    for one in fit.report.weak_directions:
        names = [name.partition("[")[0] for name in one.components]
        lights, colors = _of(_LIGHT, names), _of(_REFLECTANCE, names)
        captures = tuple(one.captures)
        if bool(lights) + bool(colors) + bool(captures) > 1:
            found.append(Gauge(lights, colors, captures))
    return _merged(found)


def _of(kinds: Iterable[str], names: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(name for name in names if name.rpartition(":")[2] in kinds))


def _merged(found: Iterable[Gauge]) -> list[Gauge]:
    """Directions that share a value become one: the channels of a color are one thing to say."""
    groups: list[Gauge] = []
    for one in found:
        for other in [item for item in groups if _shares(item, one)]:
            groups.remove(other)
            one = Gauge(  # noqa: PLW2901
                _union(other.lights, one.lights),
                _union(other.reflectances, one.reflectances),
                _union(other.captures, one.captures),
            )
        groups.append(one)
    return groups


def _shares(one: Gauge, other: Gauge) -> bool:
    return bool({*one.parameters, *one.captures} & {*other.parameters, *other.captures})


def _union(one: tuple[str, ...], other: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(one + other))
