# SPDX-License-Identifier: GPL-3.0-or-later
"""Which parameters are fitted, from where and between which bounds."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from .. import native, parameters
from ..parameters import Parameter, Values
from ..problems import Problem, choice, listed
from ..scene_read.values import Owner, SceneValues
from .field_kinds import KINDS, kind_of
from .request import UnknownRequest
from .settings import FitSettings

if TYPE_CHECKING:
    from .. import _core

#: The kind of the Problem where several materials can be fitted and none is named.
WHICH_MATERIAL = "which-material"
USUAL = ("base_color", "roughness", "transmission", "ior")


@dataclass(frozen=True)
class Unknown:
    """One parameter of the fit; the bounds hold for each component."""

    owner: str
    parameter: Parameter
    start: Values
    minimum: float
    maximum: float
    learning_rate: float

    @property
    def name(self) -> str:
        """As in `Body:roughness`."""
        return parameters.join_name(self.owner, self.parameter.name)

    @property
    def by_ratio(self) -> bool:
        """Whether two values differ by a factor rather than by a difference: a wide range above 0
        that the optimiser walks in logarithms."""
        wide = 0 < self.minimum < 0.01 * self.maximum
        return wide and self.parameter.scale == "log"

    @property
    def range_ends(self) -> frozenset[str]:
        """Which of "minimum" and "maximum" nobody can widen: there the parameter's range ends."""
        ends = {"minimum": self.minimum <= self.parameter.lower}
        ends["maximum"] = self.maximum >= self.parameter.upper
        return frozenset(side for side, is_end in ends.items() if is_end)

    def native(self) -> _core.Unknown:
        """What the native module takes."""
        return native.core().Unknown(
            self.owner, self.parameter.name, self.minimum, self.maximum, list(self.start),
            self.learning_rate,
        )  # fmt: skip


def labels(unknowns: Sequence[Unknown]) -> dict[str, str]:
    """Name -> parameter in words, with its owner where another unknown has the same: "IOR",
    "Base Color of Body"."""
    words = [item.parameter.label for item in unknowns]
    return {
        item.name: label if words.count(label) == 1 else f"{label} of {item.owner}"
        for item, label in zip(unknowns, words, strict=True)
    }


def usual_requests(scene: SceneValues, problems: list[Problem]) -> list[UnknownRequest]:
    """The usual parameters of the only material that can be fitted."""
    candidates = candidates_of(scene)
    if len(candidates) != 1:
        names = listed(owner.name for owner in candidates)
        cause = f"which material to fit is not clear; candidates: {names}"
        cure = "name the parameters, as in --fit Body:base_color,roughness"
        problems.append(Problem("Fit", cause, cure, WHICH_MATERIAL))
        return []
    owner = candidates[0]
    return [UnknownRequest(owner.name, name) for name in fittable_usual(owner)]


def candidates_of(scene: SceneValues) -> list[Owner]:
    """Materials of which a usual parameter can be fitted."""
    materials = (owner for owner in scene.owners.values() if owner.kind == "material")
    return [owner for owner in materials if fittable_usual(owner)]


def fittable_usual(owner: Owner) -> list[str]:
    """Those of the usual parameters that can be fitted."""
    return _fittable(owner, usual_of(owner))


def usual_of(owner: Owner) -> Sequence[str]:
    """Names of what is fitted of a material unless others are asked for."""
    return owner.usual or USUAL


def choose(
    scene: SceneValues,
    requests: Sequence[UnknownRequest],
    settings: FitSettings,
    problems: list[Problem],
    warnings: list[str],
) -> list[Unknown]:
    """Requests -> unknowns with every default filled in; what is wrong goes to `problems`."""
    found: dict[tuple[str, str], Unknown] = {}
    for request in requests:
        unknown = _unknown(scene, request, settings, problems, warnings)
        if unknown is None:
            continue
        key = (unknown.owner, unknown.parameter.name)
        if key in found:
            problems.append(Problem(f"Parameter '{unknown.name}'", "given twice", "give it once"))
        found[key] = unknown
    return list(found.values())


def find_parameter(
    scene: SceneValues,
    owner_name: str,
    name: str,
    problems: list[Problem],
    *,
    fields: bool = False,
) -> tuple[Owner, Parameter] | None:
    """Looks a parameter up; a world may also be called by its datablock's name. fields: whether
    grids and images are permitted in its place, for the list of names."""
    owner = scene.owners.get(owner_name)
    if owner is None:
        named = (
            o for o in scene.owners.values() if o.kind == "world" and o.datablock == owner_name
        )
        owner = next(named, None)
    title = f"Parameter '{parameters.join_name(owner_name, name)}'"
    if owner is None:
        cause = f"no material, light or world of the scene is called '{owner_name}'"
        cure = of_object(scene, owner_name) or choice(owner_name, scene.owners)
        problems.append(Problem(title, cause, cure))
        return None
    parameter = owner.find(name)
    if parameter is None:
        names = [item.name for item in owner.listed()]
        names += [kind.parameter for kind in KINDS.values() if fields and kind.of == owner.kind]
        cause = f"a {owner.kind} has no parameter '{name}'"
        problems.append(Problem(title, cause, choice(name, names)))
        return None
    return owner, parameter


def fitted_owners(scene: SceneValues, requests: Iterable[UnknownRequest]) -> set[str]:
    """Materials, lights and the world of which something is fitted; of an object, all its
    materials."""
    found: set[str] = set()
    for item in requests:
        kind = kind_of(item.parameter)
        if kind is None or kind.of != "object":
            found.add(item.owner)
            continue
        for part in scene.objects:
            if part.name == item.owner:
                found.update(part.materials)
    return found


def of_object(scene: SceneValues, name: str) -> str:
    """The cure where an object is named in place of its material or lamp; "" for any other name."""
    owners = {owner for item in scene.objects if item.name == name for owner in item.materials}
    owners |= {item.name for item in scene.lights if item.object == name}
    found = [owner for owner in scene.owners if owner in owners]
    return f"use one of {listed(found)}, which the object of that name has" if found else ""


def _fittable(owner: Owner, names: Sequence[str]) -> list[str]:
    return [name for name in names if name in owner.values and name not in owner.fixed]


def _unknown(
    scene: SceneValues,
    request: UnknownRequest,
    settings: FitSettings,
    problems: list[Problem],
    warnings: list[str],
) -> Unknown | None:
    found = find_parameter(scene, request.owner, request.parameter, problems, fields=True)
    if found is None:
        return None
    owner, parameter = found
    title = f"Parameter '{parameters.join_name(owner.name, parameter.name)}'"
    reason = owner.fixed.get(parameter.name)
    if reason or parameter.name not in owner.values:
        cause, _, cure = (reason or "its value could not be read").partition(": ")
        problems.append(Problem(title, cause, cure or "fit another parameter"))
        return None
    current = owner.values[parameter.name]
    bounds = _bounds(parameter, request, current, title, problems)
    rate = settings.learning_rate if request.learning_rate is None else request.learning_rate
    if not (math.isfinite(rate) and 0 < rate <= 1):
        cure = "give a number above 0 and at most 1"
        problems.append(Problem(title, f"its learning rate is {rate}", cure))
        return None
    if bounds is None:
        return None
    low, high = bounds
    start = current
    if request.start is not None:
        start = parameter.broadcast(request.start)
        complaint = parameter.complaint(start)
        if not complaint and not all(low <= value <= high for value in start):
            complaint = f"{_text(start)} lies outside its bounds [{low:g}, {high:g}]"
        if complaint:
            cure = "give a start inside or wider bounds"
            if len(start) != parameter.width:
                cure = "give one number, or one for each channel"
            problems.append(Problem(title, f"start: {complaint}", cure))
            return None
    clamped = tuple(min(max(value, low), high) for value in start)
    if max(abs(a - b) for a, b in zip(clamped, start, strict=True)) > 0.01 * (high - low):
        warnings.append(f"{title} starts at {_text(clamped)}, the nearest value inside its bounds")
    return Unknown(owner.name, parameter, clamped, low, high, rate)


def _bounds(
    parameter: Parameter,
    request: UnknownRequest,
    current: Values,
    title: str,
    problems: list[Problem],
) -> tuple[float, float] | None:
    low, high = parameter.fit_lower, parameter.fit_upper
    if parameter.effect == "emission":  # lights have no natural upper bound
        high = min(max(high, 10 * max(current)), parameter.upper)
    low = low if request.minimum is None else request.minimum
    high = high if request.maximum is None else request.maximum
    inside = parameter.lower <= low < high <= parameter.upper  # False for NaN
    if not inside:
        cause = f"its bounds [{low:g}, {high:g}] are not an interval inside the permitted range"
        cure = f"give bounds inside [{parameter.lower:g}, {parameter.upper:g}]"
        problems.append(Problem(title, cause, cure))
        return None
    return low, high


def _text(values: Values) -> str:
    return ", ".join(f"{value:.6g}" for value in values)
