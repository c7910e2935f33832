# SPDX-License-Identifier: GPL-3.0-or-later
"""How to fit: the settings, the presets, and what the 2022 thesis tool did."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace

from .. import native
from ..problems import BadInput, Problem, choice


@dataclass(frozen=True)
class FitSettings:
    """Settings that hold for all unknowns.

    until_converged: where scalars have not converged after the iterations, they go on to at most
    MOST_TIMES as many. height: pixels of the pictures that are compared, their width follows the
    photo's aspect.
    depth: bounces, 0 = unlimited. threads: 0 = all. accumulate: one step per iteration over all
    cameras, otherwise one per camera. picture_spp: samples of the pictures in the result folder.
    physical_refraction: see SceneValues. search: whether multi-start comes before the first step,
    "on", "off" or "auto" (where Gauss-Newton fits). precision: of PRECISIONS, where refinement may
    end. prior: of PRIORS, what holds back the pattern of grids and images.
    """

    loss: str = "robust"
    optimiser: str = "auto"
    iterations: int = 40
    until_converged: bool = True
    spp: int = 4
    learning_rate: float = 0.03
    tolerance: float = 0.0
    height: int = 256
    seed: int = 0
    depth: int = 0
    threads: int = 0
    accumulate: bool = True
    picture_spp: int = 32
    physical_refraction: bool = False
    search: str = "auto"
    precision: str = "usual"
    prior: str = "agreement"

    def problems(self) -> list[Problem]:
        """What is out of range. Losses and optimisers are listed natively."""
        found = []
        for name, (low, high) in ranges().items():
            value = getattr(self, name)
            if not low <= value <= high:  # NaN is not
                cause = f"{value} lies outside [{number(low)}, {number(high)}]"
                found.append(Problem(f"Setting '{name}'", cause, "give a value inside"))
        core = native.core()
        losses = {row["name"]: row["least_spp"] for row in core.losses()}
        optimisers = ["auto", *(row["name"] for row in core.optimisers())]
        for name, choices in (("loss", list(losses)), ("optimiser", optimisers)):
            if getattr(self, name) not in choices:
                cause = f"'{getattr(self, name)}' is not known"
                cure = choice(getattr(self, name), choices)
                found.append(Problem(f"Setting '{name}'", cause, cure))
        for name, words in (
            ("search", SEARCHES), ("precision", tuple(PRECISIONS)), ("prior", PRIORS),
        ):  # fmt: skip
            value = getattr(self, name)
            if value not in words:
                cause = f"'{value}' is not known"
                found.append(Problem(f"Setting '{name}'", cause, choice(value, words)))
        least = losses.get(self.loss, 1)
        if self.spp < least:
            cause = f"loss '{self.loss}' needs {least} samples per pixel"
            found.append(Problem("Setting 'spp'", cause, f"give at least {least}"))
        return found

    def as_json(self) -> dict[str, object]:
        """A dict of plain values."""
        return asdict(self)

    @staticmethod
    def from_json(data: object) -> FitSettings:
        """The inverse of `as_json`; keys left out take their default, as it was when there
        was no such key. Raises BadInput."""
        if not isinstance(data, dict):
            cure = "write an object, as run.json has it"
            raise BadInput(Problem("Settings", f"they are {data!r}", cure))
        kinds = {field.name: type(field.default) for field in fields(FitSettings)}
        found: list[Problem] = []
        # Files from before these existed: fits ended with their iterations and took all samples.
        values: dict[str, object] = {"until_converged": False, "precision": "exact"}
        for name, value in data.items():
            kind = kinds.get(name)
            if kind is None:
                cure = choice(name, kinds)
                found.append(Problem(f"Setting '{name}'", "it does not exist", cure))
            elif kind is float and type(value) is int:
                values[name] = float(value) if abs(value) <= 2**1000 else math.inf
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

    def native(self) -> dict[str, object]:
        """What the native Fit takes."""
        names = ("loss", "optimiser", "iterations", "spp", "tolerance", "seed", "depth", "threads")
        most = MOST_TIMES * self.iterations if self.until_converged else 0
        own = {name: getattr(self, name) for name in (*names, "accumulate", "search", "prior")}
        return own | {"most_iterations": most, "precision": PRECISIONS[self.precision]}


SEARCHES = ("auto", "on", "off")
#: The residual by which the prior of a grid or image counts: beside what photos agree on, or all.
PRIORS = ("agreement", "misfit")
#: Half of a 90 % interval that suffices, as a share of the bounds' distance, or twice that of the
#: value; 0: refinement takes all its samples.
PRECISIONS = {"draft": 0.03, "usual": 0.01, "exact": 0.0}
#: See `until_converged`.
MOST_TIMES = 3
#: Ranges of what the native fit does not know. A seed fits into a property of Blender's.
_OWN = {"learning_rate": (1e-6, 1.0), "seed": (0.0, 2.0**31 - 1)}


def ranges() -> dict[str, tuple[float, float]]:
    """(lowest, highest) of every setting that is a number, as the native module has them."""
    tables = native.core().setting_ranges()
    fit, render = tables["fit"], tables["render"]
    names = ("iterations", "spp", "tolerance", "depth", "threads")
    of_render = {"height": render["height"], "picture_spp": render["spp"]}
    return {name: fit[name] for name in names} | of_render | _OWN


def number(value: float) -> str:
    """For a message: 1048576, not 1.04858e+06."""
    return f"{value:.0f}" if value == int(value) else f"{value:g}"


PRESETS = {
    "draft": FitSettings(iterations=25, until_converged=False, height=128, precision="draft"),
    "balanced": FitSettings(),
    "accurate": FitSettings(iterations=60, spp=16, picture_spp=512, precision="exact"),
}
#: What `--optimiser adam` starts from: the thesis tool's run.
THESIS = FitSettings(
    loss="dual-buffer", optimiser="adam", iterations=100, tolerance=0.001, until_converged=False
)


def with_overrides(base: FitSettings, overrides: Mapping[str, object]) -> FitSettings:
    """`base` with the settings that are not None replaced. Raises BadInput.

    A number of iterations that is asked for is the most there are, unless `until_converged` is too.
    """
    given = {name: value for name, value in overrides.items() if value is not None}
    if "iterations" in given:
        given = {"until_converged": False} | given
    settings = replace(base, **given)
    found = settings.problems()
    if found:
        raise BadInput(found)
    return settings
