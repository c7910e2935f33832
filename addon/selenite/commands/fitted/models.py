# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite fit --model`: one model of a body after the other. See fit/model_chain.py."""

from __future__ import annotations

import argparse
import json
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ... import grid_files
from ...atomic_files import write_json
from ...capture.captures_file import write_captures_file
from ...capture.request import with_ids
from ...capture.views import View
from ...fit import model_chain
from ...fit.diagnosis.unlit import is_lit_in_the_dark
from ...fit.model_chain import Chain, Fitted, Step
from ...fit.unknowns import candidates_of
from ...problems import BadInput, Problem, choice, listed
from ...report.fitted_scene import field_files
from ...report.hold_out import Comparison, SquaredError
from ...report.results import new_folder
from ...scene_read.options import ReadingOptions
from ...scene_read.values import GridValues, Owner, SceneValues
from ...write_back.voxels import sampled
from .. import arguments
from ..capture_arguments import captures_from, stored_captures, take_captures
from ..parser import build_parser
from ..scene import open_scene, reading_of
from ..terminal import part, say, say_saved, table
from . import compare

if TYPE_CHECKING:
    import bpy

    from ..fit_results import FitReport

SUFFIX = ".models"
#: Samples of the renders that judge, at first and at most: noise of a small lamp must not hide what
#: a model misses; the share of the error that its noise may be; samples of those in which dark
#: places are looked for.
_SAMPLES, _MOST_SAMPLES, _NOISE, _SEARCH_SAMPLES = 64, 512, 0.02, 64
#: Of a medium and its grids, unless others are asked for: more iterations change nothing.
_ITERATIONS, _PICTURE_SAMPLES = 12, 32


def run(
    args: argparse.Namespace, fit: Callable[[argparse.Namespace], FitReport]
) -> dict[str, object]:
    """The report of the best model's fit, with a row for each in `models`. fit: runs one."""
    problems: list[Problem] = []
    named, _, word = args.model.rpartition(":")
    if word not in model_chain.MODELS:
        title, cure = f"Argument --model {args.model}", choice(word, model_chain.MODELS)
        problems.append(Problem(title, f"'{word}' is no model", cure))
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
    identified = with_ids(asked, [camera.name for camera in values.cameras])
    captures = model_chain.with_hold_out(identified, "Argument --model", problems)
    arguments.stop_if(problems)
    assert owner is not None  # noqa: S101 - else there is a problem
    folder = new_folder(out, SUFFIX)
    folder.mkdir(parents=True)
    file = folder / "captures.json"
    write_captures_file(file, captures)
    from ...write_back import body_models

    image = body_models.has_uvs(_material(owner))
    bench = _Bench(args, fit, owner, folder, file)
    chain = Chain(bench)
    with _interrupts(chain):
        chain.run(word, image=image)
    if chain.is_opaque:
        say("The photos show no light through the body: it stays opaque")
    return _report(chain, bench, folder, save)


class _Bench:
    """Fits and compares by the commands of that name."""

    def __init__(
        self,
        args: argparse.Namespace,
        fit: Callable[[argparse.Namespace], FitReport],
        owner: Owner,
        folder: Path,
        captures: Path,
    ) -> None:
        self.reports: dict[Path, FitReport] = {}  # by the saved scene
        self.material = owner.datablock
        self._folder = self._begin = folder
        self._quoted = json.dumps(owner.name, ensure_ascii=False)
        self._args, self._fit, self._owner, self._captures = args, fit, owner, captures

    def fit(self, step: Step, best: Fitted | None) -> Fitted:
        """See model_chain.Bench."""
        say(f"model: {step.name}")
        with part(step.title):
            saved = self._folder / f"{step.name}_fitted.blend"
            report = self.reports[saved] = self._fit(self._arguments(step, best, saved))
            error = self._error_of(report)
        return Fitted(report.folder, saved, report.content.cpu_seconds, error)

    def is_lit_in_the_dark(self, found: Fitted) -> bool | None:
        """See model_chain.Bench."""
        if found.folder is None:
            return False
        captures = ("--captures", str(self._captures))
        rows = self._compared(found.folder, _SEARCH_SAMPLES, *captures).rows
        views = [
            View(row.capture.id, row.capture.reference, row.capture.weight, row.render)
            for row in rows
        ]
        return is_lit_in_the_dark(views)

    def leave_out(self, step: Step, error: BadInput) -> None:
        """See model_chain.Bench."""
        say(f"The model '{step.name}' is left out:")
        for problem in error.problems:
            say(problem.line())

    def _arguments(self, step: Step, best: Fitted | None, saved: Path) -> argparse.Namespace:
        """Of the fit of one step."""
        args = argparse.Namespace(**vars(self._args))
        if step.form:
            self._begin = self._folder / f"{step.name}.blend"
            self._form(step.form, self._begin, best)
        args.scene, args.model = str(self._begin), None
        args.fit = [f"{self._quoted}:{','.join(step.parameters)}"]
        take_captures(args, str(self._captures))
        args.save, args.out = str(saved), str(self._folder)
        args.check_in_cycles = args.set_cycles = False
        if step.grid:
            start = str(step.grid) if step.form else self._refined(step.grid, best)
            args.grid = [f"{self._quoted}:albedo_grid={start}"]
        if step.form == model_chain.MEDIUM or step.grid:
            args.search = args.search or "off"  # plain steps lead to the same place
            args.iterations = args.iterations or _ITERATIONS
            args.picture_spp = args.picture_spp or _PICTURE_SAMPLES
        args.checks_lights = step.form == model_chain.OPAQUE  # of the same photos once
        return args

    def _refined(self, voxels: int, best: Fitted | None) -> str:
        """A file with the grid of the fit before in more voxels."""
        assert best is not None and best.folder is not None  # noqa: S101 - its error is known
        coarse = grid_files.read(str(field_files(best.folder)[f"{self._owner.name}:albedo_grid"]))
        sizes = np.array(coarse.shape[2::-1])
        fine = np.maximum(1, np.round(voxels * sizes / sizes.max())).astype(int)
        path = self._folder / f"start_{voxels}.npy"
        grid = GridValues("coarse", coarse, np.eye(4))
        grid_files.write_npy(path, sampled(grid, np.zeros(3), np.ones(3), fine))
        return str(path)

    def _compared(
        self,
        folder: Path,
        samples: int,
        *more: str,
        wants_more: Callable[[Comparison, int], bool] | None = None,
    ) -> Comparison:
        words = ["compare", str(folder), "--spp", str(samples), *more]
        found, _ = compare.compared(build_parser().parse_args(words), wants_more)
        return found

    def _error_of(self, report: FitReport) -> float | None:
        """Relative error of the photos that were held out, by gains of their own where gains are
        free; its upper limit where noise hides it; None without a result folder."""
        if report.folder is None:
            return None

        def error_of(found: Comparison) -> SquaredError:
            free = any(row.capture.free_gain != "none" for row in found.rows)
            return found.own if free else found.error

        def wants_more(found: Comparison, samples: int) -> bool:
            return error_of(found).noise > _NOISE and samples < _MOST_SAMPLES

        error = error_of(self._compared(report.folder, _SAMPLES, wants_more=wants_more))
        return error.at_most if error.relative is None else error.relative

    def _form(self, form: str, path: Path, best: Fitted | None) -> None:
        """Saves a copy of the scene whose body has that model. Subsurface scattering has the image
        of the opaque body, a grid lies in the fitted medium."""
        from ...write_back import body_models, save_copy

        make = {
            model_chain.OPAQUE: body_models.make_opaque,
            model_chain.SUBSURFACE: body_models.make_subsurface,
            model_chain.MEDIUM: body_models.make_medium,
            model_chain.GRID: body_models.make_grey,
        }[form]
        follows = form in (model_chain.SUBSURFACE, model_chain.GRID)
        begin = str(best.scene) if follows and best is not None else self._args.scene
        open_scene(begin, reading_of(self._args))
        make(_material(self._owner))
        save_copy(str(path))


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


def _report(chain: Chain, bench: _Bench, folder: Path, save: Path | None) -> dict[str, object]:
    best = chain.best
    assert best is not None  # noqa: S101 - else the first fit has raised
    table(["model", "held out", "CPU", ""], [one.row() for one in chain.tried])
    sentence = model_chain.in_short(chain.tried)
    say(sentence)
    say(f"The best model is '{best.step.name}'; all are in {folder}")
    rows = [one.as_json() for one in chain.tried]
    write_json(folder / "models.json", {"schema": 1, "models": rows})
    report = bench.reports[best.found.scene].as_json()
    report |= {"models": rows, "model_folder": str(folder), "model_of": bench.material}
    if save is not None:
        from ...write_back import save_copy

        open_scene(str(best.found.scene), ReadingOptions())
        kept = save_copy(str(save))
        report["saved"] = str(save)
        say_saved(save, kept)
    return report
