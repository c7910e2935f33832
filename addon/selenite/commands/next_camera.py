# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite next-camera`: where the next photo would add most information."""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..advice.information.fisher import EXPLAINED, ModelError
from ..advice.next_camera import report
from ..advice.next_camera.suggestion import Suggestion, suggestion_of
from ..fit.capture_render import as_reported
from ..fit.checkpoint import RESULT
from ..fit.old_names import renamed
from ..fit.request import RunRequest, UnknownRequest, read_run
from ..fit.settings import FitSettings, with_overrides
from ..json_text import read_json
from ..parameters import Values, join_name
from ..paths import absolute, is_folder
from ..problems import BadInput, Problem
from ..scene_read.values import SceneValues
from . import arguments
from .capture_arguments import captures_from, stored_captures
from .fit import unknowns_of
from .scene import find_constant, open_scene, reading_of
from .terminal import bar, say, say_saved, table

if TYPE_CHECKING:
    from ..json_text import JsonObject
    from ..scene_read.hosts import BpyStruct

_SETTINGS = ("height", "seed", "depth", "threads", "physical_refraction")


def run(args: argparse.Namespace) -> JsonObject:
    """Ranks the places and, with --save, puts a camera at the best one. SCENE may be a run.json or
    a result folder: then its fitted values count."""
    problems: list[Problem] = []
    save = arguments.optional_file(args.save, (".blend",), problems)
    base, fitted, model_error, of_fit = _asked(absolute(args.scene))
    settings = FitSettings()
    try:
        settings = with_overrides(base.settings, {name: getattr(args, name) for name in _SETTINGS})
    except BadInput as error:
        problems += error.problems
    scene, values = open_scene(base.scene, base.reading | reading_of(args))

    from ..capture.scene_captures import packed_photos

    unknowns = unknowns_of(args, base, values, (), problems)
    changes = _changes(args, values, problems)
    request = RunRequest(
        scene=str(absolute(base.scene)),
        unknowns=tuple(_at(item, {**fitted, **changes}) for item in unknowns),
        captures=captures_from(
            args, base.captures or stored_captures(args, scene, problems), values, problems
        ),
        settings=settings,
    )
    try:
        found = suggestion_of(
            values, request, packed_photos(), changes, model_error,
            lambda capture: as_reported(capture, of_fit),
        )  # fmt: skip
    except BadInput as error:
        problems += error.problems
    arguments.stop_if(problems)
    for text in found.plan.warnings:
        say(f"warning: {text}")
    if any(item.parameter.effect == "volume" for item in found.plan.unknowns):
        say("warning: errors of media are rough; use them only to compare places")
    with bar("evaluating") as shown:
        for step in found.steps():
            shown.update(step.fraction, note=step.text)
    content = report.as_json(found)
    table(*report.table_rows(found))
    for line in content["advice"]:
        say(line)
    if save is not None:
        try:
            content["saved"] = _save(scene, found, str(save))
        except BadInput as error:  # the table stands
            content["error"] = str(error)
    return content


def _asked(
    path: Path,
) -> tuple[RunRequest, dict[tuple[str, str], Values], ModelError, JsonObject]:
    """What was asked for, the values that were found, none for a scene, what they leave
    unexplained, and the report that says so. Raises BadInput."""
    if is_folder(path):
        path = path / "run.json"
    if path.suffix != ".json":
        return RunRequest(str(path)), {}, EXPLAINED, {}
    request = read_run(path)
    result = path.with_name(RESULT)
    if not result.is_file():
        return request, {}, EXPLAINED, {}
    try:
        content = renamed(read_json(result))
        rows = content["parameters"]
        found = {}
        for item in request.unknowns:
            value = rows[join_name(item.owner, item.parameter)]["value"]
            numbers = value if isinstance(value, list) else [value]
            found[item.owner, item.parameter] = tuple(float(x) for x in numbers)
            if not all(map(math.isfinite, found[item.owner, item.parameter])):
                raise ValueError(f"{item.owner}:{item.parameter} is {value}")
        left = (content.get("loss") or {}).get("model_error") or {}
        model_error = ModelError(**{name: float(size) for name, size in left.items()})
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        title, cause = f"File '{result}'", f"it has no fitted values ({error!r})"
        cure = "give the folder of a fit that has ended, or the scene with --set"
        raise BadInput(Problem(title, cause, cure)) from error
    return request, found, model_error, content


def _at(item: UnknownRequest, known: dict[tuple[str, str], Values]) -> UnknownRequest:
    """The request with the known value as its start, where there is one."""
    return replace(item, start=known.get((item.owner, item.parameter), item.start))


def _changes(
    args: argparse.Namespace, values: SceneValues, problems: list[Problem]
) -> dict[tuple[str, str], Values]:
    """--set, checked."""
    found = {}
    for (owner_name, name), numbers in arguments.assignments(args.set, problems).items():
        known = find_constant(values, owner_name, name, problems)
        if known is None:
            continue
        owner, parameter = known
        numbers = parameter.broadcast(numbers)
        complaint = parameter.complaint(numbers)
        if complaint:
            title = f"Parameter '{join_name(owner_name, name)}'"
            problems.append(Problem(title, complaint, "give a value inside"))
            continue
        found[owner.name, name] = numbers
    return found


def _save(scene: BpyStruct, found: Suggestion, path: str) -> str:  # a bpy scene
    """A copy of the file with the camera in it; where the best place has one, that one is the
    scene's camera."""
    from .. import write_back
    from ..scene_read.camera import named_cameras
    from ..write_back.cameras import add_camera

    place = found.rows[0].candidate
    if place.existing:
        scene.camera = named_cameras(scene)[place.camera.name]
        made = place.camera.name
    else:
        first = found.plan.captures[0].camera
        made = add_camera(scene, report.NEW_CAMERA, first, place.camera).name
    say_saved(f"{path} with camera '{made}'", write_back.save_copy(path))
    return path
