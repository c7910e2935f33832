# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite fit --model`: one model of a body after the other. See docs/guide/volumes.md.

Opaque, then rough glass over a medium, then a grid of albedos over that medium, coarse and fine. A
model is kept only if it explains photos better that no fit has seen; the first that does not ends
the sequence.
"""

from __future__ import annotations

import argparse
import json
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from ...atomic_files import write_json
from ...capture.captures_file import write_captures_file
from ...capture.request import CaptureRequest, with_ids
from ...capture.views import View
from ...fit.diagnosis.unlit import light_in_the_dark
from ...fit.trust import CLOSE
from ...fit.unknowns import candidates_of
from ...problems import BadInput, Problem, choice, listed
from ...report.hold_out import Comparison
from ...report.results import new_folder
from ...scene_read.options import ReadingOptions
from ...scene_read.values import Owner, SceneValues
from .. import arguments
from ..capture_arguments import captures_from, stored_captures, take_captures
from ..parser import build_parser
from ..scene import open_scene, reading_of
from ..terminal import say, say_saved, table
from . import compare

if TYPE_CHECKING:
    import bpy

    from ..fit_results import FitReport

MODELS = ("auto", "opaque", "medium")
SUFFIX = ".models"
#: One photo of so many is held out, of at least so many.
_EVERY, _FEWEST = 4, 3
#: A model is kept if its error is below this share of the best one's.
_BETTER = 0.98
#: Samples of the renders that judge: noise of a small lamp must not hide what a model misses; and
#: of those in which dark places are looked for.
_SAMPLES, _SEARCH_SAMPLES = 512, 64
#: Voxels along the longest side of the grids.
_COARSE, _FINE = 12, 24


@dataclass(frozen=True)
class Step:
    """A fit of the chain. form: the material becomes that first, "" for what the last fit has
    saved; grid: voxels along its longest side."""

    name: str
    parameters: tuple[str, ...]
    form: str = ""
    grid: int = 0


@dataclass(frozen=True)
class Tried:
    """How well a step explains what no fit has seen, or why there is no answer."""

    step: Step
    report: FitReport
    scene: Path
    error: float | None
    kept: bool = False

    def row(self) -> list[str]:
        """For people."""
        error = "" if self.error is None else f"{100 * self.error:.1f} %"
        seconds = f"{self.report.content.cpu_seconds:.0f} s"
        return [self.step.name, error, seconds, "kept" if self.kept else "left"]


def run(
    args: argparse.Namespace, fit: Callable[[argparse.Namespace], FitReport]
) -> dict[str, object]:
    """The report of the best model's fit, with a row for each in `models`. fit: runs one."""
    problems: list[Problem] = []
    named, _, word = args.model.rpartition(":")
    if word not in MODELS:
        title = f"Argument --model {args.model}"
        problems.append(Problem(title, f"'{word}' is no model", choice(word, MODELS)))
    for name in ("fit", "stages", "grid", "resume", "start"):
        if getattr(args, name):
            cause = "--model chooses what is fitted"
            problems.append(Problem(f"Argument --{name}", cause, "leave one of them out"))
    out = arguments.output_folder(args.out or "selenite-fits", problems)
    save = arguments.optional_file(args.save, (".blend",), problems)
    if args.scene is None or args.scene.endswith(".json"):
        problems.append(Problem("Argument --model", "there is no scene", "give SCENE.blend"))
    arguments.stop_if(problems)
    scene, values = open_scene(args.scene, reading_of(args))
    owner = _owner(named, values, problems)
    asked = captures_from(args, stored_captures(args, scene, problems), values, problems)
    captures = _with_hold_out(with_ids(asked, [camera.name for camera in values.cameras]), problems)
    arguments.stop_if(problems)
    assert owner is not None  # noqa: S101 - else there is a problem
    folder = new_folder(out, SUFFIX)
    folder.mkdir(parents=True)
    file = folder / "captures.json"
    write_captures_file(file, captures)
    chain = Chain(args, fit, owner, folder, file)
    with _interrupts(chain):
        for step in _steps(word, owner):
            if not chain.try_step(step):
                break
            if word == "auto" and step.form == "opaque" and chain.is_opaque():
                say("The opaque body explains the photos: it stays opaque")
                break
    return _report(chain, save)


class Chain:
    """Fits one after the other; the best so far. stopped: Ctrl+C was pressed."""

    def __init__(
        self,
        args: argparse.Namespace,
        fit: Callable[[argparse.Namespace], FitReport],
        owner: Owner,
        folder: Path,
        captures: Path,
    ) -> None:
        self.stopped = False
        self.tried: list[Tried] = []
        self.best: Tried | None = None
        self.folder = folder
        self._quoted = json.dumps(owner.name, ensure_ascii=False)
        self._args, self._fit, self._owner, self._captures = args, fit, owner, captures

    def try_step(self, step: Step) -> bool:
        """Whether the chain goes on. Raises BadInput of the first step alone: of a later one the
        reason is said, and the best so far stays."""
        say(f"model: {step.name}")
        try:
            report, scene = self._run(step)
        except BadInput as error:
            if self.best is None:
                raise
            say(f"The model '{step.name}' is left out:")
            for problem in error.problems:
                say(problem.line())
            return False
        off = self._error_of(report)
        best = self.best.error if self.best is not None else None
        kept = self.best is None or (off is not None and best is not None and off < _BETTER * best)
        one = Tried(step, report, scene, off, kept)
        self.tried.append(one)
        if kept:
            self.best = one
        return kept and not self.stopped

    def is_opaque(self) -> bool:
        """Whether the best model explains the held-out photos closely, and no photo is bright where
        its renders are dark."""
        assert self.best is not None  # noqa: S101 - a step comes first
        if self.best.error is None or self.best.report.folder is None:
            return True
        if 100 * self.best.error > CLOSE:
            return False
        found = self._compared(
            self.best.report.folder, _SEARCH_SAMPLES, "--captures", str(self._captures)
        )
        return not (
            light_in_the_dark(
                [
                    View(row.capture.id, row.capture.reference, row.capture.weight, row.render)
                    for row in found.rows
                ]
            )
        )

    def _compared(self, folder: Path, samples: int, *more: str) -> Comparison:
        words = ["compare", str(folder), "--spp", str(samples), *more]
        found, _ = compare.compared(build_parser().parse_args(words))
        return found

    def _run(self, step: Step) -> tuple[FitReport, Path]:
        args = argparse.Namespace(**vars(self._args))
        begin = self.folder / f"{step.name}.blend"
        if step.form:
            self._form(step.form, begin)
            args.scene = str(begin)
        else:
            assert self.best is not None  # noqa: S101 - a grid follows a medium
            args.scene = str(self.best.scene)
        saved = self.folder / f"{step.name}_fitted.blend"
        args.model = None
        args.fit = [f"{self._quoted}:{','.join(step.parameters)}"]
        take_captures(args, str(self._captures))
        args.save, args.out = str(saved), str(self.folder)
        args.check_in_cycles = args.set_cycles = False
        args.grid = [f"{self._quoted}:albedo_grid={step.grid}"] if step.grid else []
        if step.form == "medium" or step.grid:
            args.search = args.search or "off"  # plain steps lead to the same place
        return self._fit(args), saved

    def _error_of(self, report: FitReport) -> float | None:
        """Relative error of the photos that were held out, by gains of their own where gains are
        free; its upper limit where noise hides it; None without a result folder."""
        if report.folder is None:
            return None
        found = self._compared(report.folder, _SAMPLES)
        free = any(row.capture.free_gain != "none" for row in found.rows)
        error = found.own if free else found.error
        return error.at_most if error.relative is None else error.relative

    def _form(self, form: str, path: Path) -> None:
        """Saves a copy of the scene whose body has that model."""
        from ...write_back import body_models, save_copy

        open_scene(self._args.scene, reading_of(self._args))
        make = {"opaque": body_models.make_opaque, "medium": body_models.make_medium}[form]
        make(_material(self._owner))
        save_copy(str(path))


def _steps(word: str, owner: Owner) -> Iterator[Step]:
    """Of a model, or of all."""
    from ...write_back import body_models

    if word != "medium":
        image = body_models.has_uvs(_material(owner))
        surface = ("base_color_texture", "roughness") if image else ("base_color", "roughness")
        yield Step("opaque", surface, "opaque")
    if word != "opaque":
        yield Step("medium", ("extinction", "albedo", "roughness"), "medium")
        yield Step("coarse grid", ("albedo_grid",), grid=_COARSE)
        yield Step("fine grid", ("albedo_grid",), grid=_FINE)


def _owner(named: str, values: SceneValues, problems: list[Problem]) -> Owner | None:
    """The material that is fitted."""
    owners = {item.name: item for item in values.owners.values() if item.kind == "material"}
    candidates = candidates_of(values)
    if named in owners:
        return owners[named]
    if named:
        cure = choice(named, owners)
        problems.append(Problem("Argument --model", f"'{named}' is no material", cure))
    elif len(candidates) == 1:
        return candidates[0]
    else:
        cause = f"which material it is for is not clear; candidates: {listed(owners)}"
        problems.append(Problem("Argument --model", cause, "name one, as in --model NAME:auto"))
    return None


def _material(owner: Owner) -> bpy.types.Material:
    """Of the open file."""
    import bpy

    from ... import write_back

    found = write_back.datablock(bpy.data.materials, owner)
    assert found is not None  # noqa: S101 - it was read from this file
    return found


def _with_hold_out(
    captures: Sequence[CaptureRequest], problems: list[Problem]
) -> Sequence[CaptureRequest]:
    """With some that no fit sees: those that the user has chosen, or every fourth."""
    if any(item.hold_out for item in captures):
        return captures
    if len(captures) < _FEWEST:
        cause = f"it judges models by a photo that no fit sees, and there are {len(captures)}"
        cure = f"give at least {_FEWEST} photos, or fit one model with --fit"
        problems.append(Problem("Argument --model", cause, cure))
    return [
        replace(item, hold_out=at % _EVERY == min(_EVERY, len(captures)) // 2)
        for at, item in enumerate(captures)
    ]


@contextmanager
def _interrupts(chain: Chain) -> Iterator[None]:
    """Ctrl+C ends the fit that runs, which keeps its best values, and no other begins."""
    before = signal.getsignal(signal.SIGINT)

    def interrupt(_number: int, _frame: object) -> None:
        chain.stopped = True
        raise KeyboardInterrupt

    signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _report(chain: Chain, save: Path | None) -> dict[str, object]:
    best = chain.best
    assert best is not None  # noqa: S101 - else the first fit has raised
    table(["model", "held out", "CPU", ""], [one.row() for one in chain.tried])
    say(f"The best model is '{best.step.name}'; all are in {chain.folder}")
    rows = [
        {
            "model": one.step.name,
            "held_out": one.error,
            "cpu_seconds": one.report.content.cpu_seconds,
            "kept": one.kept,
            "folder": None if one.report.folder is None else str(one.report.folder),
            "scene": str(one.scene),
        }
        for one in chain.tried
    ]
    write_json(chain.folder / "models.json", {"schema": 1, "models": rows})
    report = best.report.as_json() | {"models": rows, "model_folder": str(chain.folder)}
    if save is not None:
        from ...write_back import save_copy

        open_scene(str(best.scene), ReadingOptions())
        kept = save_copy(str(save))
        report["saved"] = str(save)
        say_saved(save, kept)
    return report
