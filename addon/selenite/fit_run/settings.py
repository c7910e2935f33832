# SPDX-License-Identifier: GPL-3.0-or-later
"""How to fit: the settings, the presets, and what the 2022 thesis tool did."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

from .. import native
from ..problems import BadInput, Problem


@dataclass(frozen=True)
class FitSettings:
    """Settings that hold for all unknowns.

    height: pixels of the pictures that are compared, their width follows the photo's aspect.
    depth: bounces, 0 = unlimited. threads: 0 = all. accumulate: one step per iteration over all
    cameras, otherwise one per camera. picture_spp: samples of the pictures in the result folder.
    physical_refraction: see SceneValues. search: whether multi-start comes before the first step,
    "on", "off" or "auto" (where Gauss-Newton fits).
    """

    loss: str = "dual-buffer"
    optimiser: str = "auto"
    iterations: int = 40
    spp: int = 4
    learning_rate: float = 0.03
    tolerance: float = 0.0
    height: int = 256
    seed: int = 0
    depth: int = 0
    threads: int = 0
    accumulate: bool = True
    picture_spp: int = 128
    physical_refraction: bool = False
    search: str = "auto"

    def problems(self) -> list[Problem]:
        """What is out of range. Losses and optimisers are listed natively."""
        found = []
        for name, low, high in _RANGES:
            value = getattr(self, name)
            if not (math.isfinite(value) and low <= value <= high):
                cause = f"{value} lies outside [{low:g}, {high:g}]"
                found.append(Problem(f"Setting '{name}'", cause, "give a value inside"))
        core = native.core()
        losses = {row["name"]: row for row in core.losses()}
        optimisers = ["auto", *(row["name"] for row in core.optimisers())]
        for name, choices in (("loss", list(losses)), ("optimiser", optimisers)):
            if getattr(self, name) not in choices:
                cause = f"'{getattr(self, name)}' is not known"
                cure = f"use one of {', '.join(choices)}"
                found.append(Problem(f"Setting '{name}'", cause, cure))
        if self.search not in SEARCHES:
            cure = f"use one of {', '.join(SEARCHES)}"
            found.append(Problem("Setting 'search'", f"'{self.search}' is not known", cure))
        least = losses.get(self.loss, {}).get("least_spp", 1)
        if self.spp < least:
            cause = f"loss '{self.loss}' needs {least} samples per pixel"
            found.append(Problem("Setting 'spp'", cause, f"give at least {least}"))
        return found

    def as_json(self) -> dict[str, Any]:
        """A dict of plain values."""
        return asdict(self)

    @staticmethod
    def from_json(data: dict[str, Any]) -> FitSettings:
        """The inverse of `as_json`; keys left out take their default. Raises BadInput."""
        kinds = {field.name: type(field.default) for field in fields(FitSettings)}
        found: list[Problem] = []
        values: dict[str, Any] = {}
        for name, value in data.items():
            kind = kinds.get(name)
            if kind is None:
                cure = f"use one of {', '.join(kinds)}"
                found.append(Problem(f"Setting '{name}'", "it does not exist", cure))
            elif kind is float and type(value) is int:
                values[name] = float(value)
            elif type(value) is not kind:
                cure = f"give a value of type {kind.__name__}"
                found.append(Problem(f"Setting '{name}'", f"{value!r} is of another type", cure))
            else:
                values[name] = value
        settings = FitSettings(**values)
        found += settings.problems()
        if found:
            raise BadInput(found)
        return settings

    def native(self) -> dict[str, Any]:
        """What the native Fit takes."""
        names = ("loss", "optimiser", "iterations", "spp", "tolerance", "seed", "depth", "threads")
        return {name: getattr(self, name) for name in (*names, "accumulate", "search")}


SEARCHES = ("auto", "on", "off")
_RANGES = (
    ("iterations", 1, 1_000_000),
    ("spp", 1, 65536),
    ("learning_rate", 1e-6, 1),
    ("tolerance", 0, 1e9),
    ("height", 1, 16384),
    ("seed", 0, 2**31 - 1),
    ("depth", 0, 1_000_000),
    ("threads", 0, 4096),
    ("picture_spp", 1, 1_000_000),
)

PRESETS = {
    "draft": FitSettings(iterations=25, height=128, picture_spp=32),
    "balanced": FitSettings(),
    "accurate": FitSettings(iterations=60, spp=16, picture_spp=512),
}
#: What `--optimiser adam` starts from: the thesis tool's run.
THESIS = FitSettings(optimiser="adam", iterations=100, tolerance=0.001)


def with_overrides(base: FitSettings, overrides: dict[str, Any]) -> FitSettings:
    """`base` with the settings that are not None replaced. Raises BadInput."""
    given = {name: value for name, value in overrides.items() if value is not None}
    settings = replace(base, **given)
    found = settings.problems()
    if found:
        raise BadInput(found)
    return settings
