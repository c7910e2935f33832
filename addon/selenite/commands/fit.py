# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite fit`: from photos to a result folder, and to a .blend with the fitted values."""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from typing import Any

from ..fit_run.checkpoint import SUFFIX, Recorder, Unfinished, going_on, load
from ..fit_run.fields import ImageUnknown, fitted_grids
from ..fit_run.job import DESCENT, FitJob, fitted_values
from ..fit_run.plan import FitPlan, prepare
from ..fit_run.request import RunRequest, UnknownRequest, read_run
from ..fit_run.results import finished, new_folder, result_json, summary, write_results
from ..fit_run.settings import PRESETS, THESIS, FitSettings, with_overrides
from ..fit_run.staging.job import StagedJob, make_job
from ..fit_run.staging.request import AUTO, StageRequest, stages_by_name
from ..fit_run.staging.request import PRESETS as STAGE_PRESETS
from ..fit_run.unknowns import usual_requests
from ..information.conditioning import StageChoice
from ..parameters import join_name
from ..problems import BadInput, Problem
from ..scene_read.values import CaptureRequest, SceneValues, with_ids
from . import arguments
from .scene import open_scene
from .terminal import bar, say

#: Where the result folder goes without --out; a resumed run stays where it was.
DEFAULT_OUT = "selenite-fits"
# Arguments that replace a setting of the preset or of the run file.
_SETTINGS = tuple(field.name for field in fields(FitSettings))


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Fits, writes the result folder and, with --save, the scene. SCENE may be a run.json."""
    problems: list[Problem] = []
    out = arguments.output_folder(args.out or DEFAULT_OUT, problems)
    save = arguments.output_file(args.save, (".blend",), problems) if args.save else None
    if args.set_cycles and save is None:
        cause, cure = "there is no file to set it in", "add --save OUT.blend"
        problems.append(Problem("Argument --set-cycles", cause, cure))
    scene, values, plan, run = _resumed(args, problems) if args.resume else _new(args, problems)
    checks = args.check_in_cycles
    grids = [item.name for item in plan.fields if not item.kind.is_image]
    if grids and checks:
        from ..write_back import grids as grid_objects

        missing = grid_objects.why_not()
        checks = not missing
        if missing:
            say(f"warning: {grids[0]}: the check in Cycles is left out: {missing}")
    for text in plan.warnings:
        say(f"warning: {text}")
    say(f"model {plan.model}")
    if plan.request.staging:
        say(f"stages: {plan.request.staging}")
    if args.resume:
        unfinished = Path(args.resume).expanduser().resolve()
        out = out if args.out else unfinished.parent
    else:
        unfinished = new_folder(out, SUFFIX)
    job = make_job(plan, run.parts, run.state)
    if args.resume:
        say(f"going on after {job.progress().iteration} iterations")
    recorder = Recorder(unfinished, plan.request)
    result = _fit(job, recorder)

    import bpy

    with bar("writing") as shown:

        def note_progress(text: str, fraction: float) -> None:
            shown.update(fraction, note=text)

        result = finished(plan, result, note_progress)
        folder = write_results(plan, result, out, bpy.app.version_string, note_progress)
    recorder.finished()
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
    """Fitted grids as Volume objects, where that is possible, fitted images as image nodes; what
    was done, line by line."""
    if not plan.fields:
        return []
    from ..write_back import grids as grid_objects
    from ..write_back import images as image_nodes

    lines = []
    grids = fitted_grids(plan.fields, result["fields_best"])
    shows = [
        *(partial(grid_objects.show, scene, values, *item, folder) for item in grids.items()),
        *(partial(image_nodes.show, values, *item) for item in _images(plan, folder).items()),
    ]
    for show in shows:
        try:
            lines.append(show())
        except BadInput as error:
            lines += [f"not shown in the scene: {item.line()}" for item in error.problems]
    for line in lines:
        say(line)
    return lines


def _hide(scene: Any, plan: FitPlan) -> None:
    """Undoes `_show` in the open scene, so that the check finds what was fitted."""
    if plan.fields:
        from ..write_back import grids as grid_objects
        from ..write_back import images as image_nodes

        for item in plan.fields:
            if item.kind.is_image:
                image_nodes.restore(item.owner)
            else:
                grid_objects.restore(scene, item.owner)


def _images(plan: FitPlan, folder: Path) -> dict[str, str]:
    """Material -> file of its fitted image."""
    return {
        item.owner: str(folder / item.files[0])
        for item in plan.fields
        if isinstance(item, ImageUnknown)
    }


Planned = tuple[Any, SceneValues, FitPlan, Unfinished]  # bpy scene, its values


def _new(args: argparse.Namespace, problems: list[Problem]) -> Planned:
    """What the arguments ask for."""
    if args.scene is None:
        problems.append(Problem("Fit", "there is no scene", "give SCENE.blend, or --resume DIR"))
        raise BadInput(problems)
    base = read_run(Path(args.scene)) if args.scene.endswith(".json") else RunRequest(args.scene)
    scene, values = open_scene(base.scene)

    from ..scene_read.photos import captures_of, packed_photos

    settings = _settings(args, base, problems)
    stages = arguments.stages(args.stages, problems)
    unknowns = unknowns_of(args, base, values, stages, problems)
    names = [join_name(item.owner, item.parameter) for item in unknowns]
    request = RunRequest(
        scene=str(Path(base.scene).expanduser().resolve()),
        unknowns=unknowns,
        captures=captures_from(args, base.captures or captures_of(scene), values, problems),
        settings=settings,
        stages=stages or _preset_stages(args.stages, names, settings, problems),
    )
    if args.stages is None:
        request = replace(request, stages=base.stages, staging=base.staging)
    packed = packed_photos()
    try:
        plan = prepare(values, request, packed)
    except BadInput as error:
        problems += error.problems
    arguments.stop_if(problems)
    if args.stages == AUTO:
        plan = _choose_stages(plan, lambda chosen: prepare(values, chosen, packed))
    return scene, values, plan, Unfinished(plan.request, [])


def _choose_stages(plan: FitPlan, plan_of: Callable[[RunRequest], FitPlan]) -> FitPlan:
    """The plan with the stages that the Fisher information chooses."""
    choice = StageChoice(plan, plan_of)
    with bar("choosing stages") as shown:
        for step in choice.steps():
            shown.update(step.fraction, note=step.text)
    return choice.plan


def _resumed(args: argparse.Namespace, problems: list[Problem]) -> Planned:
    """What an unfinished run asked for, and the results of what it has done."""
    others = (
        "fit", "photo", "mask", "start", "bounds", "grid", "unseen", "preset", "stages", *_SETTINGS
    )  # fmt: skip
    for name in others:
        if name != "threads" and getattr(args, name):
            cause, cure = "the run has its own", "leave it out, or start a new run"
            problems.append(Problem(f"Argument --{name.replace('_', '-')}", cause, cure))
    run = going_on(load(Path(args.resume).expanduser()))
    request = replace(
        run.request,
        scene=args.scene or run.request.scene,
        settings=with_overrides(run.request.settings, {"threads": args.threads}),
    )
    scene, values = open_scene(request.scene)

    from ..scene_read.photos import packed_photos

    try:
        plan = prepare(values, request, packed_photos())
    except BadInput as error:
        problems += error.problems
    arguments.stop_if(problems)
    return scene, values, plan, run


def _check(scene: Any, plan: FitPlan, result: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Renders the fitted values with Cycles; pictures and numbers go into the result folder."""
    from ..cycles_check.job import CheckJob, lines
    from ..cycles_check.render_settings import Remark

    grids = fitted_grids(plan.fields, result["fields_best"])
    images = _images(plan, folder)
    job = CheckJob(scene, plan.request, fitted_values(plan, result), grids, images)
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


def _fit(job: FitJob | StagedJob, recorder: Recorder) -> dict[str, Any]:
    """Runs to the end; Ctrl+C stops and keeps the best values so far."""
    job.start()
    stage = ""
    reported: set[str] = set()
    try:
        with bar("fitting") as shown:
            while (state := job.progress()).running:
                note = state.phase
                if state.phase == DESCENT:
                    note = f"{state.iteration}/{state.iterations}"
                    note += "" if math.isnan(state.loss) else f"  loss {state.loss:.3g}"
                if state.stage != stage:
                    stage = state.stage
                    say(f"stage {stage}")
                _warn(state.notes, reported)
                shown.update(state.fraction, state.seconds_left, note)
                recorder.update(job)
                time.sleep(0.05)
    except KeyboardInterrupt:
        say("stopping; the best values so far are kept")
        job.cancel()
    finally:
        job.join()
    recorder.update(job, now=True)
    result = job.result()
    _warn(result["notes"], reported)
    return result


def _warn(notes: Sequence[str], reported: set[str]) -> None:
    """Each kind of remark once: only its numbers change while a fit runs."""
    for note in notes:
        kind = "".join(c for c in note if not c.isdigit())
        if kind not in reported:
            reported.add(kind)
            say(f"warning: {note}")


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


def _preset_stages(
    text: str | None, names: Sequence[str], settings: FitSettings, problems: list[Problem]
) -> tuple[StageRequest, ...]:
    """--stages by name, of the parameters `names`; none without it."""
    if text not in STAGE_PRESETS or not names:
        return ()
    return stages_by_name(text, names, settings.iterations, problems)


def unknowns_of(
    args: argparse.Namespace,
    base: RunRequest,
    values: SceneValues,
    stages: Sequence[StageRequest],
    problems: list[Problem],
) -> tuple[UnknownRequest, ...]:
    """--fit, or what the stages name, or the run file's, or the usual ones; with --start, --bounds,
    --grid and --unseen."""
    requests = [UnknownRequest(*key) for key in arguments.names(args.fit, problems)]
    named = [text for stage in stages for text in stage.parameters]
    requests = requests or [UnknownRequest(*key) for key in arguments.names(named, problems)]
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
    for key, word in arguments.words(args.unseen, "--unseen", "keep|fill", problems).items():
        if _known(key, found, problems):
            found[key] = replace(found[key], unseen=word)
    return tuple(found.values())


def _known(
    key: tuple[str, str], found: dict[tuple[str, str], UnknownRequest], problems: list[Problem]
) -> bool:
    if key not in found:
        name = f"{key[0]}:{key[1]}"
        cause, cure = "it is not fitted", f"add --fit {name}"
        problems.append(Problem(f"Parameter '{name}'", cause, cure))
    return key in found


def captures_from(
    args: argparse.Namespace,
    stored: Sequence[CaptureRequest],
    values: SceneValues,
    problems: list[Problem],
) -> tuple[CaptureRequest, ...]:
    """--photo, or else what is stored; --mask adds to either, by the id of a photo."""
    cameras = [*(camera.name for camera in values.cameras), *values.unusable_cameras]
    given = [CaptureRequest(*pair) for pair in arguments.files(args.photo, problems, cameras)]
    captures = with_ids(given or stored, (camera.name for camera in values.cameras))
    masks: dict[str, str] = {}
    ids = [item.id for item in captures]
    for name, mask in arguments.files(args.mask, problems, ids):
        if name in masks:
            problems.append(Problem(f"Photo '{name}'", "it has two masks", "keep one"))
        elif name not in {item.id for item in captures}:
            camera = name.partition("#")[0]
            cause, cure = "a mask is given but no photo", f"add --photo {camera}=FILE"
            problems.append(Problem(f"Photo '{name}'", cause, cure))
        masks[name] = mask
    return tuple(replace(item, mask=masks.get(item.id, item.mask)) for item in captures)
