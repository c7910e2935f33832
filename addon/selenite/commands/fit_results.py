# SPDX-License-Identifier: GPL-3.0-or-later
"""What becomes of a fit that has ended: result folder, saved scene, check in Cycles. The values
come out whatever of these fails."""

from __future__ import annotations

import argparse
import time
from functools import partial
from pathlib import Path
from typing import Any

from .. import native
from ..fit.capture_render import as_found
from ..fit.checkpoint import Recorder
from ..fit.field_kinds import IN_PLACE_OF
from ..fit.fields import EnvironmentUnknown, fitted_grids
from ..fit.job import fitted_values
from ..fit.plan import FitPlan
from ..parameters import Values, join_name
from ..problems import BadInput
from ..report.light_pairing import with_warnings
from ..report.results import finished, of_photos, result_json, seconds_of_pictures, write_results
from ..report.table import TITLES, lines, sentences
from ..scene_read.values import SceneValues
from .terminal import bar, say, say_saved, table

#: Seconds that pictures may take after Ctrl+C.
_PATIENCE = 2.0
#: What keeps results from being written, beside the user.
_UNWRITTEN = (OSError, MemoryError, ValueError)


def deliver(
    args: argparse.Namespace,
    scene: Any,  # noqa: ANN401 - a bpy scene
    values: SceneValues,
    plan: FitPlan,
    result: dict[str, Any],
    out: Path,
    save: Path | None,
    recorder: Recorder,
    checks: bool,
) -> dict[str, Any]:
    """The report of the command: values first, then what was written. Its key `error` says what
    could not be."""
    import bpy

    errors: list[str] = []
    known = set(result.get("notes", ()))
    with bar("writing") as shown:

        def note_progress(text: str, fraction: float) -> None:
            shown.update(fraction, note=text)

        try:
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
    for note in result["notes"]:
        if note not in known:
            say(f"warning: {note}")
    table(TITLES, [line.cells for line in lines(plan, result)])
    for text in (*sentences(plan, result), *of_photos(result)):
        say(text)
    place = "no result folder is written" if folder is None else f"results in {folder}"
    say(f"{result['stopped_because']} after {result['seconds']:.0f} s; {place}")
    report = result_json(plan, result, bpy.app.version_string)
    report["folder"] = None if folder is None else str(folder)
    if errors and not recorder.trouble:
        errors[-1] += f"; or write them later by --resume {recorder.folder} --out DIR"
    if save is not None:
        _save(args, scene, values, plan, result, folder, save, report, errors)
    if checks:  # last, so that a check that fails costs nothing but itself
        _check(scene, values, plan, result, folder, report, errors)
    return report | ({"error": "; ".join(errors)} if errors else {})


def _written(
    plan: FitPlan,
    result: dict[str, Any],
    out: Path,
    host: str,
    note_progress: Any,  # noqa: ANN401 - a function
    errors: list[str],
) -> Path | None:
    """The result folder; None where it could not be written."""
    seconds = seconds_of_pictures(plan, result)
    pictures = result.get("stopped") != native.core().StopReason.CANCELLED or seconds < _PATIENCE
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
    scene: Any,  # noqa: ANN401
    values: SceneValues,
    plan: FitPlan,
    result: dict[str, Any],
    folder: Path | None,
    save: Path,
    report: dict[str, Any],
    errors: list[str],
) -> None:
    """--save and --set-cycles. The open scene keeps the values for the check, not the fields."""
    from .. import write_back
    from ..cycles_check import render_settings

    try:
        write_back.write(scene, values.owners, _single_values(values, plan, result))
        report["shown"] = [] if folder is None else _show(scene, values, plan, result, folder)
        if args.set_cycles:
            changed = render_settings.set_for_fit(scene)
            say(f"set for Cycles: {', '.join(changed) or 'nothing, all was set already'}")
            report["set_for_cycles"] = changed
        kept = write_back.save_copy(str(save))
        _hide(scene, plan)
    except BadInput as error:
        errors += [problem.line() for problem in error.problems]
        return
    report["saved"] = str(save)
    say_saved(save, kept)


def _single_values(
    values: SceneValues, plan: FitPlan, result: dict[str, Any]
) -> dict[tuple[str, str], Values]:
    """What is written into sockets: all single values but a colour that an image feeds
    and in whose place a fitted image stands."""
    replaced = {item.name for item in plan.fields}

    def is_fed(key: tuple[str, str]) -> bool:
        owner, name = key
        field = join_name(owner, IN_PLACE_OF.get(name, ""))
        return field in replaced and name in values.owners[owner].fixed

    return {key: value for key, value in fitted_values(plan, result).items() if not is_fed(key)}


def _show(
    scene: Any,  # noqa: ANN401
    values: SceneValues,
    plan: FitPlan,
    result: dict[str, Any],
    folder: Path,
) -> list[str]:
    """Fitted grids as Volume objects, where that is possible, fitted images as image nodes, colours
    in their meshes; what was done, line by line."""
    if not plan.fields:
        return []
    from ..write_back import environments, surfaces
    from ..write_back import grids as grid_objects

    lines = []
    grids = fitted_grids(plan.fields, result["fields_best"])
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


def _hide(scene: Any, plan: FitPlan) -> None:  # noqa: ANN401
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
    scene: Any,  # noqa: ANN401
    values: SceneValues,
    plan: FitPlan,
    result: dict[str, Any],
    folder: Path | None,
    report: dict[str, Any],
    errors: list[str],
) -> None:
    """Renders the fitted values with Cycles; pictures and numbers go into the result folder."""
    from ..cycles_check import job as check
    from ..cycles_check.render_settings import Remark
    from ..scene_read.blender_process import ProcessFailed

    if folder is None:
        errors.append("The check in Cycles is left out, as its pictures have no folder")
        return
    grids = fitted_grids(plan.fields, result["fields_best"])
    try:
        found_on = _surfaces(plan, folder)
        taken = [as_found(item, result) for item in plan.captures]
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
    except (BadInput, ProcessFailed, OSError) as error:
        errors.append(f"The check in Cycles failed: {error}")
        return
    report["cycles"] = found
    say(check.verdict(found))
    for text in check.lines(found):
        say(text)
    for remark in found["render_settings"]:
        if remark["spoils"]:
            say(f"this scene's own renders differ: {Remark(**remark).line()}")
    say(f"wrote {sheet}")
