# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite fit`: from photos to a result folder, and to a .blend with the fitted values."""

from __future__ import annotations

import argparse
import shlex
import time
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..capture.prepared import without_photo
from ..fit.checkpoint import SUFFIX, Recorder, Unfinished, load
from ..fit.inputs import changes, inputs_of
from ..fit.job import DESCENT, FitFailed, FitJob
from ..fit.overall import Overall, time_text
from ..fit.plan import FitPlan, prepare
from ..fit.request import RunRequest, UnknownRequest, read_run
from ..fit.settings import PRESETS, THESIS, FitSettings, with_overrides
from ..fit.staging.request import PRESETS as STAGE_PRESETS
from ..fit.staging.request import USUAL, StageRequest, stages_by_name
from ..fit.unknowns import WHICH_MATERIAL, candidates_of, fittable_usual, usual_requests
from ..parameters import join_name
from ..paths import absolute, why_not_folder
from ..problems import BadInput, Problem, meant
from ..report.finished_fit import FinishedFit
from ..report.results import new_folder, size_of
from ..scene_read.options import options_of
from ..scene_read.values import SceneValues
from . import arguments
from .capture_arguments import captures_from, given_for_captures, stored_captures
from .cluster_arguments import workers_for
from .environment_arguments import with_environment
from .fit_results import FitReport, deliver
from .fitted import models
from .fitted.start_result import begin_at, checked, start_folder, starting_there
from .grouping import grouped
from .scene import open_scene, reading_of
from .terminal import bar, say

if TYPE_CHECKING:
    from ..scene_read.hosts import BpyStruct

    Planned = tuple[BpyStruct, SceneValues, FitPlan, Unfinished]  # bpy scene, its values

#: Where the result folder goes without --out; a resumed run stays where it was.
DEFAULT_OUT = "selenite-fits"
# Arguments that replace a setting of the preset or of the run file.
_SETTINGS = tuple(field.name for field in fields(FitSettings))


def run(args: argparse.Namespace) -> dict[str, object]:
    """What is found, for --json."""
    return models.run(args, fitted) if args.model else fitted(args).as_json()


def fitted(args: argparse.Namespace) -> FitReport:
    """Fits, writes the result folder and, with --save, the scene. SCENE may be a run.json."""
    problems: list[Problem] = []
    resumes, out = args.resume is not None, args.out
    unfinished = absolute(args.resume) if resumes else None
    if out is None:
        out = DEFAULT_OUT if unfinished is None else str(unfinished.parent)
    out = arguments.output_folder(out, problems)
    save = arguments.optional_file(args.save, (".blend",), problems)
    if args.set_cycles and save is None:
        cause, cure = "there is no file to set it in", "add --save OUT.blend"
        problems.append(Problem("Argument --set-cycles", cause, cure))
    scene, values, plan, run = _resumed(args, problems) if resumes else _new(args, problems)
    checks = args.check_in_cycles
    grids = [item.name for item in plan.fields if item.kind.is_grid]
    if grids and checks:
        from ..write_back import grids as grid_objects

        missing = grid_objects.why_not()
        checks = not missing
        if missing:
            say(f"warning: {grids[0]}: the check in Cycles is left out: {missing}")
    for text in grouped(plan.warnings):
        say(f"warning: {text}")
    if unused := without_photo(values, plan.request.captures):
        say(unused)
    if why := why_not_folder(out, size_of(plan)):
        raise BadInput(Problem(f"Folder '{out}'", why, arguments.OTHER_FOLDER))
    unfinished = unfinished or new_folder(out, SUFFIX)
    with workers_for(args, plan) as workers:
        job = FitJob(plan, run.state, workers=workers)
        if resumes:
            say(f"going on after {job.progress().iteration} iterations")
        recorder = Recorder(unfinished, plan.request, run.inputs)
        result = _fit(job, recorder, keeps=resumes or workers is not None)
    del job  # fields of many texels take memory, as does what follows
    return deliver(args, scene, values, plan, result, out, save, recorder, checks)


def _new(args: argparse.Namespace, problems: list[Problem]) -> Planned:
    """What the arguments ask for."""
    if args.scene is None:
        problems.append(Problem("Fit", "there is no scene", "give SCENE.blend, or --resume DIR"))
        raise BadInput(problems)
    base = (
        read_run(absolute(args.scene)) if args.scene.endswith(".json") else RunRequest(args.scene)
    )
    begins_at, args.start = start_folder(args.start, problems)
    begins_at = begins_at or base.begins_at
    arguments.stop_if(problems)
    scene, values = open_scene(base.scene, base.reading | reading_of(args))

    from ..capture.scene_captures import packed_photos

    stored = base.captures or tuple(stored_captures(args, scene, problems))
    if begins_at:
        begin = checked(begins_at)
        values = begin_at(scene, values, begin)
        stored = stored or read_run(begin / "run.json").captures
    settings = _settings(args, base, problems)
    stages = arguments.stages(args.stages, problems)
    unknowns = unknowns_of(args, base, values, stages, problems)
    unknowns = starting_there(unknowns, Path(begins_at)) if begins_at else unknowns
    names = [join_name(item.owner, item.parameter) for item in unknowns]
    captures = captures_from(args, stored, values, problems)
    wanted = args.stages or USUAL
    if not stages and names and wanted in STAGE_PRESETS:
        stages = stages_by_name(wanted, names, settings.iterations, problems, captures)
    request = RunRequest(
        scene=str(absolute(base.scene)),
        unknowns=unknowns,
        captures=captures,
        settings=settings,
        stages=stages,
        reading=options_of(scene),
        begins_at=begins_at,
    )
    if args.stages is None and args.scene.endswith(".json"):
        request = replace(request, stages=base.stages)
    packed = packed_photos()
    try:
        plan = prepare(values, request, packed)
    except BadInput as error:
        problems += error.problems
    arguments.stop_if([_with_command(item, args, scene, values) for item in problems])
    inputs = inputs_of(values, plan.request, packed)
    return scene, values, plan, Unfinished(plan.request, None, inputs)


def _resumed(args: argparse.Namespace, problems: list[Problem]) -> Planned:
    """What an unfinished run asked for, and the results of what it has done."""
    others = (
        "fit", "start", "bounds", "grid", "unseen",
        "environment", "environment_size", "environment_projection", "preset", "stages", *_SETTINGS,
    )  # fmt: skip
    given = [name for name in others if name != "threads" and getattr(args, name)]
    for name in [*given_for_captures(args), *given]:
        cause, cure = "the run has its own", "leave it out, or start a new run"
        problems.append(Problem(f"Argument --{name.replace('_', '-')}", cause, cure))
    run = load(absolute(args.resume))
    request = replace(
        run.request,
        scene=args.scene or run.request.scene,
        settings=with_overrides(run.request.settings, {"threads": args.threads}),
    )
    scene, values = open_scene(request.scene, request.reading | reading_of(args))
    if request.begins_at:
        values = begin_at(scene, values, checked(request.begins_at))

    from ..capture.scene_captures import packed_photos

    packed = packed_photos()
    try:
        plan = prepare(values, request, packed)
    except BadInput as error:
        problems += error.problems
    now = inputs_of(values, request, packed)
    if run.inputs is not None:
        problems += changes(run.inputs, now, request.scene)
    arguments.stop_if(problems)
    return scene, values, plan, replace(run, inputs=run.inputs or now)


def _fit(job: FitJob, recorder: Recorder, *, keeps: bool) -> FinishedFit:
    """Runs to the end; Ctrl+C stops and keeps the best values so far. Of a fit that fails before
    its first iteration no folder stays, unless it `keeps` it; then raises BadInput, else FitFailed.
    """
    job.start()
    stage, trouble = "", ""
    overall = Overall(job.plan)
    reported: set[str] = set()
    try:
        with bar("fitting") as shown:
            while (state := job.progress()).running:
                note = state.phase
                if state.phase == DESCENT:
                    note = f"iteration {state.iteration} of {state.iterations}"
                if job.stage_title(state) != stage:
                    stage = job.stage_title(state)
                    say(f"stage {stage}")
                _warn(job.newest_notes, reported)
                whole = overall.update(state)
                note = "  ".join(part for part in (note, time_text(whole.left)) if part)
                shown.update(whole.fraction, note=note)
                recorder.update(job)
                trouble = _say_trouble(recorder, trouble)
                time.sleep(0.05)
    except KeyboardInterrupt:
        say("stopping; the best values so far are kept")
        job.cancel()
    except FitFailed as error:
        if keeps or job.so_far().iterations:
            raise
        recorder.finished()
        raise BadInput(error.problems) from error
    finally:
        job.join()
    recorder.update(job, now=True)
    _say_trouble(recorder, trouble)
    fit = job.result()
    notes = job.closing_notes(fit)
    _warn(notes, reported)
    return FinishedFit(fit, (*notes, *recorder.notes()))


def _say_trouble(recorder: Recorder, said: str) -> str:
    """Says what has changed about whether the run is kept on disk; returns what is known now."""
    if recorder.trouble and recorder.trouble != said:
        say(f"warning: {recorder.trouble}")
    elif said and not recorder.trouble:
        say(f"the run is kept in '{recorder.folder}' again")
    return recorder.trouble


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


def unknowns_of(
    args: argparse.Namespace,
    base: RunRequest,
    values: SceneValues,
    stages: Sequence[StageRequest],
    problems: list[Problem],
) -> tuple[UnknownRequest, ...]:
    """--fit, or what the stages name, or the run file's, or the usual ones; with --start, --bounds,
    --grid, --unseen and those of the environment."""
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
    return tuple(with_environment(args, values, found, problems).values())


def _with_command(
    problem: Problem,
    args: argparse.Namespace,
    scene: BpyStruct,
    values: SceneValues,
) -> Problem:
    """Where the material is not named: a command that names that of the active object, to be
    copied."""
    if problem.kind != WHICH_MATERIAL:
        return problem
    candidates = candidates_of(values)
    if not candidates:
        return problem
    active = scene.view_layers[0].objects.active
    slots = [slot.material for slot in active.material_slots] if active is not None else []
    own = [slot.name for slot in slots if slot is not None]
    owner = next((item for item in candidates if item.datablock in own), candidates[0])
    wanted = join_name(owner.name, ",".join(fittable_usual(owner)))
    words = ["selenite", "fit", args.scene, "--fit", wanted]
    words += [word for photo in args.photo or () for word in ("--photo", photo)]
    return replace(problem, cure=f"name one, as in: {shlex.join(words)}")


def _known(
    key: tuple[str, str], found: dict[tuple[str, str], UnknownRequest], problems: list[Problem]
) -> bool:
    if key not in found:
        name = f"{key[0]}:{key[1]}"
        near = meant(name, (join_name(*other) for other in found))
        cause, cure = "it is not fitted", f"{near}add --fit {name}"
        problems.append(Problem(f"Parameter '{name}'", cause, cure))
    return key in found
