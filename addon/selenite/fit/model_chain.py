# SPDX-License-Identifier: GPL-3.0-or-later
"""Models of a body, one after the other: see docs/guide/volumes.md.

Opaque, with subsurface scattering, or rough glass over a medium with a grid of albedos, coarse and
fine. Each fit starts from the last one. A model is kept only if it explains photos better that no
fit has seen; the first that does not ends the sequence.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

from ..capture.request import CaptureRequest
from ..messages import control, joined, message, phrase
from ..problems import BadInput, Problem
from .trust import CLOSE

AUTO, OPAQUE, SUBSURFACE, MEDIUM = "auto", "opaque", "subsurface", "medium"
#: What a medium becomes before its albedo is a grid.
GRID = "grid"
MODELS = (AUTO, OPAQUE, SUBSURFACE, MEDIUM)
#: One photo of so many is held out, of at least so many.
_EVERY, _FEWEST = 4, 3
#: A model is kept if its error is below this share of the best one's.
_BETTER = 0.98
#: Voxels along the longest side of the grids.
_COARSE, _FINE = 12, 24


@dataclass(frozen=True)
class Step:
    """A fit of the chain. form: the material becomes that first, "" for what it was before the
    last fit; grid: voxels along its longest side."""

    name: str
    parameters: tuple[str, ...]
    form: str = ""
    grid: int = 0

    @property
    def title(self) -> str:
        """For the panel."""
        titles = {
            OPAQUE: message("model_chain.opaque", "opaque"),
            SUBSURFACE: message("model_chain.subsurface", "subsurface scattering"),
            MEDIUM: message("model_chain.medium", "medium"),
            "coarse grid": message("model_chain.coarse-grid", "coarse albedo grid"),
            "fine grid": message("model_chain.fine-grid", "fine albedo grid"),
        }
        return titles[self.name]


@dataclass(frozen=True)
class Fitted:
    """What a step has left. folder: of its result, None where it could not be written; error: of
    photos that no fit has seen, None where it is not known."""

    folder: Path | None
    scene: Path
    cpu_seconds: float
    error: float | None


@dataclass(frozen=True)
class Tried:
    """A step that has ended. kept: it is better than all before."""

    step: Step
    found: Fitted
    kept: bool = False

    def row(self) -> list[str]:
        """For people."""
        error = "" if self.found.error is None else f"{100 * self.found.error:.1f} %"
        seconds = f"{self.found.cpu_seconds:.0f} s"
        return [self.step.name, error, seconds, "kept" if self.kept else "left"]

    def as_json(self) -> dict[str, object]:
        """A row of models.json."""
        return {
            "model": self.step.name,
            "held_out": self.found.error,
            "cpu_seconds": self.found.cpu_seconds,
            "kept": self.kept,
            "folder": None if self.found.folder is None else str(self.found.folder),
            "scene": str(self.found.scene),
        }

    @staticmethod
    def of_json(row: Mapping[str, object]) -> Tried:
        """The inverse."""
        folder, error = row["folder"], row["held_out"]
        found = Fitted(
            None if folder is None else Path(str(folder)),
            Path(str(row["scene"])),
            float(str(row["cpu_seconds"])),
            None if error is None else float(str(error)),
        )
        return Tried(Step(str(row["model"]), ()), found, bool(row["kept"]))


class Bench(Protocol):
    """Who fits and compares for a chain."""

    def fit(self, step: Step, best: Fitted | None) -> Fitted:
        """best: what the step starts from. Raises BadInput, KeyboardInterrupt."""

    def is_lit_in_the_dark(self, found: Fitted) -> bool | None:
        """Whether photos are bright where its renders are dark; None: no place is dark."""

    def leave_out(self, step: Step, error: BadInput) -> None:
        """It cannot be fitted."""


class Chain:
    """Fits one after the other; the best so far. stopped: no other begins."""

    def __init__(self, bench: Bench) -> None:
        self.stopped = False
        self.tried: list[Tried] = []
        self.best: Tried | None = None
        #: Whether the opaque body was enough for `auto`.
        self.is_opaque = False
        self._bench = bench

    def run(self, word: str, *, image: bool) -> None:
        """word: one of MODELS. image: whether the surface may have one. Raises BadInput of the
        first step alone: of a later one the best before it stays."""
        for step in _steps(word, image=image):
            if not self._try(step):
                return
            if word == AUTO and step.form == OPAQUE and not self._lets_light_through():
                self.is_opaque = True
                return

    def _lets_light_through(self) -> bool:
        """Where no place is dark, the error decides."""
        assert self.best is not None  # noqa: S101 - a step comes first
        found = self.best.found
        lit = self._bench.is_lit_in_the_dark(found)
        if lit is None:
            return found.error is not None and 100 * found.error > CLOSE
        return lit

    def _try(self, step: Step) -> bool:
        """Whether the chain goes on."""
        best = self.best.found if self.best is not None else None
        try:
            found = self._bench.fit(step, best)
        except BadInput as error:
            if best is None:
                raise
            self._bench.leave_out(step, error)
            return False
        except KeyboardInterrupt:
            if best is None:
                raise
            return False
        off, before = found.error, best.error if best is not None else None
        kept = best is None or (off is not None and before is not None and off < _BETTER * before)
        one = Tried(step, found, kept)
        self.tried.append(one)
        if kept:
            self.best = one
        return kept and not self.stopped


def _steps(word: str, *, image: bool) -> Iterator[Step]:
    """Of a model, or of all."""
    colour = "base_color_texture" if image else "base_color"
    if word != MEDIUM:
        yield Step(OPAQUE, (colour, "roughness"), OPAQUE)
    if word == SUBSURFACE:
        inside = ("subsurface_weight", "subsurface_radius")
        yield Step(SUBSURFACE, (colour, "roughness", *inside), SUBSURFACE)
    if word in (AUTO, MEDIUM):
        yield Step(MEDIUM, ("extinction", "albedo", "roughness"), MEDIUM)
        yield Step("coarse grid", ("albedo_grid",), GRID, _COARSE)
        yield Step("fine grid", ("albedo_grid",), grid=_FINE)


def with_hold_out(
    captures: Sequence[CaptureRequest], title: str, problems: list[Problem]
) -> list[CaptureRequest]:
    """With some that no fit sees: those that the user has chosen, or every fourth. title: of what
    asks for it."""
    if any(item.hold_out for item in captures):
        return list(captures)
    if len(captures) < _FEWEST:
        cause = f"it judges models by a photo that no fit sees, and there are {len(captures)}"
        words = f"give at least {_FEWEST} photos, or fit one model with {{fit}}"
        cure = phrase(words, fit=control("fit-one-model", "--fit"))
        problems.append(Problem(title, cause, cure))
    return [
        replace(item, hold_out=at % _EVERY == min(_EVERY, len(captures)) // 2)
        for at, item in enumerate(captures)
    ]


def in_short(tried: Sequence[Tried]) -> str:
    """By how much each step has helped, in a sentence."""
    first = tried[0]
    if first.found.error is None:
        return "The photos held out were not compared"
    parts = [
        message(
            "model_chain.off-by",
            "Photos held out: {model} off by {percent} %",
            model=first.step.title,
            percent=f"{100 * first.found.error:.3g}",
        )
    ]
    best = first.found.error
    for one in tried[1:]:
        if not one.kept or one.found.error is None:
            parts.append(
                message("model_chain.no-better", "{model} no better", model=one.step.title)
            )
            continue
        parts.append(
            message(
                "model_chain.times-better",
                "{model} {times} times better",
                model=one.step.title,
                times=f"{best / max(one.found.error, 1e-9):.2g}",
            )
        )
        best = one.found.error
    return joined(", ", parts)
