# SPDX-License-Identifier: GPL-3.0-or-later
"""What becomes of a fit that has ended: result folder, saved scene, check in Cycles. The values
come out whatever of these fails."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ..fit import trust
from ..fit.capture_render import as_found
from ..fit.checkpoint import Recorder
from ..fit.field_kinds import IN_PLACE_OF
from ..fit.fields import EnvironmentUnknown, fitted_grids
from ..fit.job import fitted_values
from ..fit.plan import FitPlan
from ..parameters import Values, join_name
from ..problems import BadInput
from ..report.finished_fit import FinishedFit
from ..report.light_pairing import with_warnings
from ..report.result_file import ResultFile
from ..report.results import finished, of_photos, seconds_of_pictures, write_results
from ..report.table import TITLES, lines, sentences
from ..scene_read.values import SceneValues
from .terminal import bar, say, say_saved, table

if TYPE_CHECKING:
    from ..cycles_check.report import CheckReport
    from ..scene_read.hosts import BpyStruct

#: Seconds that pictures may take after Ctrl+C.
_PATIENCE = 2.0
#: What keeps results from being written, beside the user.
_UNWRITTEN = (OSError, MemoryError, ValueError)


@dataclass
class FitReport:
    """What the command prints by --json. errors: what could not be written; the others: None where
    they were not asked for."""

    content: ResultFile
    folder: Path | None
    errors: list[str] = field(default_factory=list)
    shown: list[str] | None = None
    set_for_cycles: list[str] | None = None
    saved: Path | None = None
    cycles: CheckReport | None = None

    def as_json(self) -> dict[str, object]:
        """result.json, and what became of it."""
        folder = None if self.folder is None else str(self.folder)
        further = {
            "shown": self.shown,
            "set_for_cycles": self.set_for_cycles,
            "saved": None if self.saved is None else str(self.saved),
            "cycles": self.cycles,
            "error": "; ".join(self.errors) or None,
        }
        known = {name: value for name, value in further.items() if value is not None}
        return {**self.content.as_json(), "folder": folder, **known}


def deliver(
    args: argparse.Namespace,
    scene: BpyStruct,
    values: SceneValues,
    plan: FitPlan,
    result: FinishedFit,
    out: Path,
    save: Path | None,
    recorder: Recorder,
    checks: bool,
) -> FitReport:
    """Values first, then what was written."""
    import bpy

    errors: list[str] = []
    known = set(result.notes)
    with bar("writing") as shown:

        def note_progress(text: str, fraction: float) -> None:
            shown.update(fraction, note=text)

        try:
            if args.checks_lights:
                result = with_warnings(plan, result, note_progress)
        except (*_UNWRITTEN, KeyboardInterrupt) as error:
            errors.append(f"Whether each photo has its own lights is not known ({_why(error)})")
        try:
            result = finished(plan, result, note_progress)
        except (*_UNWRITTEN, KeyboardInterrupt) as error:
            errors.append(f"What the photos see of the images is not known ({_why(error)})")
        folder = _written(plan, result, out, bpy.app.version_string, note_progress, errors)
    if folder is not None and (trouble := recorder.finished()):
        say(f"warning: {trouble}")
    for note in result.notes:
        if note not in known:
            say(f"warning: {note}")
    table(TITLES, [line.cells for line in lines(plan, result)])
    for text in (*sentences(plan, result.fit), *of_photos(result)):
        say(text)
    place = "no result folder is written" if folder is None else f"results in {folder}"
    say(f"{result.fit.stopped_because} after {result.fit.seconds:.0f} s; {place}")
    content = ResultFile.of(plan, result, bpy.app.version_string)
    if errors and not recorder.trouble:
        errors[-1] += f"; or write them later by --resume {recorder.folder} --out DIR"
    report = FitReport(content, folder, errors)
    if save is not None:
        _save(args, scene, values, plan, result, save, report)
    if checks:  # last, so that a check that fails costs nothing but itself
        _check(scene, values, plan, result, report)
    return report


def _written(
    plan: FitPlan,
    result: FinishedFit,
    out: Path,
    host: str,
    note_progress: Callable[[str, float], None],
    errors: list[str],
) -> Path | None:
    """The result folder; None where it could not be written."""
    seconds = seconds_of_pictures(plan, result.fit)
    pictures = not trust.cancelled(result.fit) or seconds < _PATIENCE
    if not pictures:
        say(
            f"The pictures are left out: they would take about {seconds / 60:.1f} min. "
            "selenite render --result FOLDER --capture ID makes one"
        )
    try:
        return write_results(plan, result, out, host, note_progress, pictures=pictures)
    except (*_UNWRITTEN, KeyboardInterrupt) as error:
        errors.append(
            f"Folder '{out}': the results cannot be written ({_why(error)}); the values are "
            "printed here and by --json; make room or choose another --out"
        )
    return None


def _why(error: BaseException) -> str:
    kinds = {MemoryError: "memory does not suffice", KeyboardInterrupt: "interrupted"}
    return kinds.get(type(error), str(error))


def _save(
    args: argparse.Namespace,
    scene: BpyStruct,
    values: SceneValues,
    plan: FitPlan,
    result: FinishedFit,
    save: Path,
    report: FitReport,
) -> None:
    """--save and --set-cycles. The open scene keeps the values for the check, not the fields."""
    from .. import write_back
    from ..cycles_check import render_settings

    try:
        write_back.write(scene, values.owners, _single_values(values, plan, result))
        folder = report.folder
        report.shown = [] if folder is None else _show(scene, values, plan, result, folder)
        if args.set_cycles:
            changed = render_settings.set_for_fit(scene)
            say(f"set for Cycles: {', '.join(changed) or 'nothing, all was set already'}")
            report.set_for_cycles = changed
        kept = write_back.save_copy(str(save))
        _hide(scene, plan)
    except BadInput as error:
        report.errors += [problem.line() for problem in error.problems]
        return
    except KeyboardInterrupt as error:
        report.errors.append(f"File '{save}': it is not saved ({_why(error)})")
        return
    report.saved = save
    say_saved(save, kept)


def _single_values(
    values: SceneValues, plan: FitPlan, result: FinishedFit
) -> dict[tuple[str, str], Values]:
    """What is written into sockets: all single values but a colour that an image feeds
    and in whose place a fitted image stands."""
    replaced = {item.name for item in plan.fields}

    def is_fed(key: tuple[str, str]) -> bool:
        owner, name = key
        field = join_name(owner, IN_PLACE_OF.get(name, ""))
        return field in replaced and name in values.owners[owner].fixed

    return {key: value for key, value in fitted_values(plan, result.fit).items() if not is_fed(key)}


def _show(
    scene: BpyStruct,
    values: SceneValues,
    plan: FitPlan,
    result: FinishedFit,
    folder: Path,
) -> list[str]:
    """Fitted grids as Volume objects, where that is possible, fitted images as image nodes, colours
    in their meshes; what was done, line by line."""
    if not plan.fields:
        return []
    from ..write_back import environments, surfaces
    from ..write_back import grids as grid_objects

    lines = []
    grids = fitted_grids(plan.fields, result.fields)
    shows = [
        *(partial(grid_objects.show, scene, values, *item, folder) for item in grids.items()),
        *(partial(surfaces.show, values, *item) for item in _surfaces(plan, folder).items()),
        *(partial(environments.show, scene, values, path) for path in _environment(plan, folder)),
    ]
    for show in shows:
        try:
            lines.append(show())
        except BadInput as error:
            lines += [f"not shown in the scene: {item.line()}" for item in error.problems]
    for line in lines:
        say(line)
    return lines


def _hide(scene: BpyStruct, plan: FitPlan) -> None:
    """Undoes `_show` in the open scene, so that the check finds what was fitted."""
    if plan.fields:
        from ..write_back import environments, surfaces
        from ..write_back import grids as grid_objects

        for item in plan.fields:
            if item.kind.is_of_body:
                surfaces.restore(item.name)
            elif item.kind.is_environment:
                environments.restore(scene)
            else:
                grid_objects.restore(scene, item.owner)


def _surfaces(plan: FitPlan, folder: Path) -> dict[str, str]:
    """Name -> file of each fitted image, and of what is fitted of each mesh."""
    return {item.name: str(folder / item.files[0]) for item in plan.fields if item.kind.is_of_body}


def _environment(plan: FitPlan, folder: Path) -> list[str]:
    """The file of the fitted image of the world, if that is fitted."""
    found = (item for item in plan.fields if isinstance(item, EnvironmentUnknown))
    return [str(folder / item.files[0]) for item in found]


def _check(
    scene: BpyStruct,
    values: SceneValues,
    plan: FitPlan,
    result: FinishedFit,
    report: FitReport,
) -> None:
    """Renders the fitted values with Cycles; pictures and numbers go into the result folder."""
    from ..cycles_check import job as check
    from ..cycles_check.render_settings import Remark
    from ..scene_read.blender_process import ProcessFailed

    folder = report.folder
    if folder is None:
        report.errors.append("The check in Cycles is left out, as its pictures have no folder")
        return
    grids = fitted_grids(plan.fields, result.fields)
    try:
        found_on = _surfaces(plan, folder)
        taken = [as_found(item, result.fit) for item in plan.captures]
        written = _single_values(values, plan, result)
        environment = next(iter(_environment(plan, folder)), "")
        job = check.CheckJob(scene, plan.request, written, grids, found_on, taken, environment)
        try:
            job.start()
            with bar("Cycles") as shown:
                while (state := job.progress()).running:
                    shown.update(state.fraction, note=state.text)
                    time.sleep(0.1)
            found = job.result()
            sheet = job.keep(found, folder)
        finally:
            job.close()
    except (BadInput, ProcessFailed, OSError, KeyboardInterrupt) as error:
        report.errors.append(f"The check in Cycles failed: {_why(error)}")
        return
    report.cycles = found
    say(check.verdict(found))
    for text in check.lines(found):
        say(text)
    for remark in found["render_settings"]:
        if remark["spoils"]:
            say(f"this scene's own renders differ: {Remark(**remark).line()}")
    say(f"wrote {sheet}")
