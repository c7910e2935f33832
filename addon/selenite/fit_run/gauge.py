# SPDX-License-Identifier: GPL-3.0-or-later
"""What makes up for what in the brightness of the photos: light, reflectance and gains.

Photos show a product of the three. Where nothing holds one of them, the normal matrix has a
direction next to null in which they change together. The native report lists such directions.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

#: Parameters that brightness is proportional to, or nearly.
_LIGHT = ("power", "strength", "color", "emission_color", "emission_strength")
_REFLECTANCE = ("base_color", "albedo")


@dataclass(frozen=True)
class Gauge:
    """Values that make up for each other: parameters as "Body:base_color", ids of captures."""

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
            many = "s" if len(self.captures) > 1 else ""
            names.append(f"the gain{many} of {' and '.join(self.captures)}")
            cures.append("give one photo a gain of none, as of a known exposure")
        if self.reflectances:
            cures.append("leave out the color of one material that is known, such as a grey card")
        if self.lights:
            cures.append("leave out the power of one lamp that is measured")
        *first, last = names
        return (
            f"{', '.join(first)} and {last} make up for each other: photos show only their "
            f"product, so the brightness of each is open; {', or '.join(cures)}"
        )


def gauges(result: dict[str, Any]) -> list[Gauge]:
    """Those of a native result: directions of light, reflectance and gain, two of them at least."""
    found: list[Gauge] = []
    for one in (result.get("report") or {}).get("weak_directions", ()):
        names = [name.partition("[")[0] for name in one["components"]]
        lights, colors = _of(_LIGHT, names), _of(_REFLECTANCE, names)
        captures = tuple(one["captures"])
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
