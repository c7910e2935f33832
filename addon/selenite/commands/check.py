# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite check`: what was understood of a scene, and what stands in the way."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from .. import mean_free_path
from ..capture import light_states
from ..capture.light_states import described
from ..capture.prepared import read_captures
from ..capture.request import PACKED, CaptureRequest, with_ids
from ..fit.plan import build_scene, paths_traced
from ..fit.unknowns import USUAL, usual_requests
from ..problems import BadInput, Problem, listed
from ..scene_read.values import Owner, SceneValues
from .capture_arguments import captures_from, stored_captures
from .grouping import grouped
from .scene import open_scene, reading_of
from .terminal import say

if TYPE_CHECKING:
    from ..json_text import JsonObject

#: Photos are read whole and kept small: what is wrong with them does not depend on the size.
PHOTO_HEIGHT = 64


def run(args: argparse.Namespace) -> JsonObject:
    """Reads and builds the scene; exit status 2 if anything stands in the way. A render does
    without the photos that the scene names, so that those which are gone do not count."""
    from ..capture.scene_captures import packed_photos
    from ..cycles_check import render_settings

    scene, values = open_scene(args.scene, reading_of(args))
    problems: list[Problem] = []
    dropped: dict[str, int] = {}
    paths = None
    try:
        built = build_scene(values)
        dropped = dict(built.dropped_triangles)
        paths = paths_traced(built)
    except BadInput as error:
        problems = list(error.problems)
    captures: Sequence[CaptureRequest] = ()
    with suppress(BadInput):  # its problems are in `problems`
        captures = captures_from(args, stored_captures(args, scene, problems), values, problems)
    warnings = list(values.warnings)
    remarks_of: dict[str, list[str]] = {}
    lights_of: dict[str, str] = {}
    asked_for = args.captures or args.photo or args.mask or args.exclude
    gone = [] if asked_for else [item for item in captures if _is_gone(item)]
    present = [item for item in captures if item not in gone]
    photo_problems: list[Problem] = []
    if gone:
        read_captures(values, gone, PHOTO_HEIGHT, photo_problems, [], packed_photos())
    if present:
        owners = {item.owner for item in usual_requests(values, [])}
        read = read_captures(
            values, present, PHOTO_HEIGHT, problems, warnings, packed_photos(), owners
        )
        remarks_of = {item.id: list(item.warnings) for item in read}
        lights_of = {item.id: described(item.lights) for item in read}
        warnings += light_states.remarks(values, present)
    remarks = render_settings.remarks(scene, render_settings.contents_of(scene))
    report = {
        "scene": args.scene,
        "cameras": [
            {"name": item.name, "kind": item.kind, "width": item.width, "height": item.height}
            for item in values.cameras
        ],
        "captures": [
            {
                "id": item.id,
                "camera": item.camera,
                "photo": item.photo,
                "mask": item.mask,
                "lights": lights_of.get(item.id),
                "warnings": remarks_of.get(item.id, []),
            }
            for item in with_ids(captures, (item.name for item in values.cameras))
        ],
        "objects": len(values.objects),
        "triangles": values.triangle_count(),
        "dropped_triangles": dropped,
        "lights": [
            {"name": item.name, "object": item.object, "kind": item.kind} for item in values.lights
        ],
        "owners": {
            owner.name: _owner(owner, values.millimetres) for owner in values.owners.values()
        },
        "bodies": [body.as_json() for body in values.bodies],
        "flavour": sorted({item.flavour for item in values.materials}),
        "model": _model(values),
        "paths": paths,
        "problems": [problem.as_json() for problem in problems],
        "photo_problems": [problem.as_json() for problem in photo_problems],
        "warnings": warnings,
        "render_settings": [item.as_json() for item in remarks],
    }
    _say(report, values)
    for remark in remarks:
        say(f"{'render setting' if remark.spoils else 'remark'}: {remark.line()}")
    return report


def _is_gone(request: CaptureRequest) -> bool:
    path = request.photo
    return bool(path) and not path.startswith(PACKED) and not Path(path).is_file()


def _model(values: SceneValues) -> str:
    """Which model a render of the scene needs, and why."""
    media = [item.name for item in values.materials if "extinction" in item.values]
    if media:
        return f"volume: there is a medium in {listed(media)}"
    return "surface: the scene has no medium"


def _owner(owner: Owner, millimetres: float | None) -> JsonObject:
    rows: dict[str, JsonObject] = {}
    for parameter in owner.rows():
        value = owner.values.get(parameter.name)
        rows[parameter.name] = {
            "value": list(value) if value is not None else None,
            "unit": parameter.unit,
            "minimum": parameter.fit_lower,
            "maximum": parameter.fit_upper,
            "fixed": owner.fixed.get(parameter.name),
        }
    if "extinction" in owner.values:
        path = mean_free_path.of(owner.values["extinction"], millimetres)
        rows["extinction"]["mean_free_path"] = path.as_json()
    return {"kind": owner.kind, "datablock": owner.datablock, "parameters": rows}


def _say(report: JsonObject, values: SceneValues) -> None:
    say(f"{report['objects']} objects, {report['triangles']} triangles; model {report['model']}")
    if report["paths"]:
        say(f"paths are traced {report['paths']}")
    for camera in report["cameras"]:
        say(f"camera '{camera['name']}': {camera['width']} x {camera['height']}")
    if report["captures"]:
        masked = sum(bool(item["mask"]) for item in report["captures"])
        say(f"captures with a photo: {len(report['captures'])}, with a mask: {masked}")
    for light in report["lights"]:
        say(f"light '{light['name']}' ({light['kind'].lower()})")
    for owner in values.owners.values():
        free = [name for name in owner.values if name not in owner.fixed]
        say(f"{owner.kind} '{owner.name}': can be fitted: {', '.join(free) or 'nothing'}")
        for name in () if owner.parameters else USUAL:
            if name in owner.fixed:
                say(f"  not {name}: {owner.fixed[name]}")
        if "extinction" in owner.values:
            path = mean_free_path.of(owner.values["extinction"], values.millimetres)
            say(f"  mean free path in the medium: {path.text()}")
    for body in values.bodies:
        state = "closed" if body.found.encloses else "not closed"
        count = f"triangles: {body.found.triangles}, bodies: {body.found.bodies}"
        say(f"object '{body.object}' with {body.need} '{body.material}' is {state} ({count})")
    for text in grouped(report["warnings"]):
        say(f"warning: {text}")
    for line in grouped(Problem(**problem).line() for problem in report["photo_problems"]):
        say(f"photo: {line}; a fit needs that, a render does not")
