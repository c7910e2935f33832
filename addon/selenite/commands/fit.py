# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite fit`: from photos to a result folder, and to a .blend with the fitted values."""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..fit_run.fields import fitted_grids
from ..fit_run.job import FitJob, fitted_values
from ..fit_run.plan import FitPlan, prepare
from ..fit_run.request import RunRequest, UnknownRequest, read_run
from ..fit_run.results import result_json, summary, write_results
from ..fit_run.settings import PRESETS, THESIS, FitSettings, with_overrides
from ..fit_run.unknowns import usual_requests
from ..problems import BadInput, Problem
from ..scene_read.values import CaptureRequest, SceneValues
from . import arguments
from .scene import open_scene
from .terminal import bar, say

# Arguments that replace a setting of the preset or of the run file.
_SETTINGS = (
    "loss",
    "optimiser",
    "iterations",
    "spp",
    "height",
    "learning_rate",
    "tolerance",
    "seed",
    "depth",
    "threads",
    "physical_refraction",
    "search",
)


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Fits, writes the result folder and, with --save, the scene. SCENE may be a run.json."""
    problems: list[Problem] = []
    out = arguments.output_folder(args.out, problems)
    save = arguments.output_file(args.save, (".blend",), problems) if args.save else None
    if args.set_cycles and save is None:
        cause, cure = "there is no file to set it in", "add --save OUT.blend"
        problems.append(Problem("Argument --set-cycles", cause, cure))
    base = read_run(Path(args.scene)) if args.scene.endswith(".json") else RunRequest(args.scene)
    scene, values = open_scene(base.scene)

    from ..scene_read.photos import captures_of, packed_photos

    request = RunRequest(
        scene=str(Path(base.scene).expanduser().resolve()),
        unknowns=_unknowns(args, base, values, problems),
        captures=_captures(args, base.captures or tuple(captures_of(scene)), problems),
        settings=_settings(args, base, problems),
    )
    try:
        plan = prepare(values, request, packed_photos())
    except BadInput as error:
        problems += error.problems
    arguments.stop_if(problems)
    checks = args.check_in_cycles
    if plan.fields and checks:
        from ..write_back import grids as grid_objects

        missing = grid_objects.why_not()
        checks = not missing
        if missing:
            say(f"warning: {plan.fields[0].name}: the check in Cycles is left out: {missing}")
    for text in plan.warnings:
        say(f"warning: {text}")
    say(f"model {plan.model}")
    result = _fit(plan)

    import bpy

    with bar("writing") as shown:
        folder = write_results(
            plan,
            result,
            out,
            bpy.app.version_string,
            lambda text, fraction: shown.update(fraction, note=text),
        )
    for line in summary(plan, result):
        say(line)
    say(f"stopped because: {result['stopped_because']}; results in {folder}")
    report = result_json(plan, result, bpy.app.version_string) | {"folder": str(folder)}
    if save is not None:
        from .. import write_back
        from ..cycles_check import render_settings

        write_back.write(scene, values.owners, fitted_values(plan, result))
        report["shown"] = _show(scene, values, plan, result, folder)
        if args.set_cycles:
            changed = render_settings.set_for_fit(scene)
            say(f"set for Cycles: {', '.join(changed) or 'nothing, all was set already'}")
            report["set_for_cycles"] = changed
        write_back.save_copy(str(save))
        _hide(scene, plan)
        report["saved"] = str(save)
        say(f"wrote {save}")
    if checks:  # last, so that a check that fails costs nothing but itself
        report["cycles"] = _check(scene, plan, result, folder)
    return report


def _show(
    scene: Any, values: SceneValues, plan: FitPlan, result: dict[str, Any], folder: Path
) -> list[str]:
    """Fitted grids as Volume objects, where that is possible; what was done, line by line."""
    if not plan.fields:
        return []
    from ..write_back import grids as grid_objects

    lines = []
    for name, grids in fitted_grids(plan.fields, result["fields_best"]).items():
        try:
            lines.append(grid_objects.show(scene, values, name, grids, folder))
        except BadInput as error:
            lines += [f"not shown in the scene: {item.line()}" for item in error.problems]
    for line in lines:
        say(line)
    return lines


def _hide(scene: Any, plan: FitPlan) -> None:
    """Undoes `_show` in the open scene, so that the check finds what was fitted."""
    if plan.fields:
        from ..write_back import grids as grid_objects

        for item in plan.fields:
            grid_objects.restore(scene, item.owner)


def _check(scene: Any, plan: FitPlan, result: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Renders the fitted values with Cycles; pictures and numbers go into the result folder."""
    from ..cycles_check.job import CheckJob, lines
    from ..cycles_check.render_settings import Remark

    grids = fitted_grids(plan.fields, result["fields_best"])
    job = CheckJob(scene, plan.request, fitted_values(plan, result), grids)
    try:
        job.start()
        with bar("Cycles") as shown:
            while (state := job.progress()).running:
                shown.update(state.fraction, note=state.text)
                time.sleep(0.1)
        report = job.result()
        sheet = job.keep(report, folder)
    finally:
        job.close()
    for text in lines(report):
        say(text)
    for remark in report["render_settings"]:
        if remark["spoils"]:
            say(f"this scene's own renders differ: {Remark(**remark).line()}")
    say(f"wrote {sheet}")
    return report


def _fit(plan: FitPlan) -> dict[str, Any]:
    """Runs to the end; Ctrl+C stops and keeps the best values so far."""
    job = FitJob(plan)
    job.start()
    try:
        with bar("fitting") as shown:
            while (state := job.progress()).running:
                note = f"{state.iteration}/{state.iterations}  loss {state.loss:.3g}"
                note = note if state.phase == "fitting" else state.phase
                shown.update(state.fraction, state.seconds_left, note)
                time.sleep(0.05)
    except KeyboardInterrupt:
        say("stopping; the best values so far are kept")
        job.cancel()
    finally:
        job.join()
    return job.result()


def _settings(args: argparse.Namespace, base: RunRequest, problems: list[Problem]) -> FitSettings:
    given = {name: getattr(args, name) for name in _SETTINGS}
    start = base.settings
    if args.preset:
        start = PRESETS[args.preset]
    elif args.optimiser == "adam" and not args.scene.endswith(".json"):
        start = THESIS
    try:
        return with_overrides(start, given)
    except BadInput as error:
        problems += error.problems
        return FitSettings()


def _unknowns(
    args: argparse.Namespace, base: RunRequest, values: SceneValues, problems: list[Problem]
) -> tuple[UnknownRequest, ...]:
    """--fit, or the run file's, or the usual ones; with --start and --bounds."""
    requests = [UnknownRequest(*key) for key in arguments.names(args.fit, problems)]
    requests = requests or list(base.unknowns) or usual_requests(values, problems)
    found = {(item.owner, item.parameter): item for item in requests}
    for key, numbers in arguments.assignments(args.start, problems).items():
        if _known(key, found, problems):
            found[key] = replace(found[key], start=numbers)
    for key, numbers in arguments.assignments(args.bounds, problems).items():
        if len(numbers) != 2:
            title = f"Argument --bounds {key[0]}:{key[1]}"
            problems.append(Problem(title, f"it has {len(numbers)} numbers", "give LO,HI"))
        elif _known(key, found, problems):
            found[key] = replace(found[key], minimum=numbers[0], maximum=numbers[1])
    for key, grid in arguments.grids(args.grid, problems).items():
        if _known(key, found, problems):
            found[key] = replace(found[key], grid=grid)
    return tuple(found.values())


def _known(
    key: tuple[str, str], found: dict[tuple[str, str], UnknownRequest], problems: list[Problem]
) -> bool:
    if key not in found:
        name = f"{key[0]}:{key[1]}"
        cause, cure = "it is not fitted", f"add --fit {name}"
        problems.append(Problem(f"Parameter '{name}'", cause, cure))
    return key in found


def _captures(
    args: argparse.Namespace, stored: tuple[CaptureRequest, ...], problems: list[Problem]
) -> tuple[CaptureRequest, ...]:
    """--photo, or else what is stored; --mask adds to either."""
    photos = arguments.files(args.photo, problems)
    masks = arguments.files(args.mask, problems)
    captures = [CaptureRequest(name, photo) for name, photo in photos.items()] or list(stored)
    for name in masks:
        if name not in {item.camera for item in captures}:
            cause, cure = "a mask is given but no photo", f"add --photo {name}=FILE"
            problems.append(Problem(f"Camera '{name}'", cause, cure))
    return tuple(replace(item, mask=masks.get(item.camera, item.mask)) for item in captures)
