# SPDX-License-Identifier: GPL-3.0-or-later
"""A request and a scene -> everything a fit needs, or every reason why it cannot start."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from .. import native
from ..capture import light_states, suspicion
from ..capture.prepared import Capture, read_captures
from ..capture.request import CaptureRequest, with_ids
from ..capture.silhouette import Silhouettes
from ..capture.value_kinds import PACKED
from ..messages import remark, thing
from ..parameters import Values
from ..paths import MISSING, why_not_file
from ..problems import BadInput, Problem, refused
from ..scene_read.build import build
from ..scene_read.finite import not_finite
from ..scene_read.values import SceneValues
from . import fields as all_fields
from .diagnosis import gauge
from .diagnosis.darkness import problems_of_darkness
from .fields import FieldUnknown, vertex_positions
from .request import RunRequest, UnknownRequest
from .staging import plan as stage_plan
from .staging import shape_apart
from .staging.colour_first import with_colours
from .staging.plan import Stage
from .unknowns import Unknown, choose, fitted_owners, usual_requests

if TYPE_CHECKING:
    from .._core import Scene


@dataclass(frozen=True)
class FitPlan:
    """A fit that can start. `request` has every default filled in, so it reproduces the run;
    `scene` is the native scene with the start values. Without stages everything is fitted at once.
    """

    request: RunRequest
    scene: Scene
    captures: list[Capture]
    unknowns: list[Unknown]
    fields: list[FieldUnknown]
    warnings: list[str]
    model: str
    millimetres: float | None  # in one Blender unit, None where the scene has no units
    stages: tuple[Stage, ...] = ()
    transmits: bool = False  # a fitted material refracts, or may
    opaque: bool = False  # no light passes through any fitted material
    hold_out: tuple[Capture, ...] = ()  # photos that the fit does not see
    #: What `scene` was built of, and the start values that it was given then.
    source: SceneValues = field(default_factory=SceneValues)
    starts: Mapping[tuple[str, str], Values] = field(default_factory=dict)
    #: By photo the angle of its camera about the vertical axis; empty where their lights differ.
    azimuths: Mapping[str, float] = field(default_factory=dict)


def prepare(
    values: SceneValues,
    request: RunRequest,
    packed: Mapping[str, bytes] | None = None,
    captures_at: Callable[[int], list[Capture]] | None = None,
    *,
    go_on: Callable[[], None] = lambda: None,
) -> FitPlan:
    """Checks everything, reads the photos, builds the native scene; writes nothing.

    `captures_at`: gives the captures of a height in place of the request's photos. `go_on`: called
    before each photo and before the scene is built; raises if nobody wants the plan any more.
    Raises BadInput with all problems at once, and NativeUnavailable.
    """
    problems = list(values.problems)
    warnings = list(values.warnings)
    requests = request.unknowns or tuple(usual_requests(values, problems))
    values.physical_refraction = request.settings.physical_refraction
    values = with_colours(values, requests, request.stages, warnings)
    single, many = all_fields.split(requests)
    unknowns = choose(values, single, request.settings, problems, warnings)
    names = [all_fields.name_of(values, item) for item in requests]
    asked = shape_apart.apart(names, request.stages, request.settings.iterations, warnings)
    wanted = stage_plan.named(values, asked, problems)
    fitted_with = stage_plan.fitted_with_fields(unknowns, wanted)
    fields = all_fields.choose(values, many, fitted_with, request.settings, problems)
    fields = stage_plan.starting_at_colour(fields, unknowns, problems)
    warnings += all_fields.remarks(fields, unknowns)
    warnings += vertex_positions.remarks(fields, request.settings, request.captures)
    if not wanted and any(item.kind.is_shape for item in fields):
        request = replace(request, settings=vertex_positions.with_loss(request.settings))
    names = [*(item.name for item in unknowns), *(item.name for item in fields)]
    settings = stage_plan.settings_of(wanted, names, request.settings, problems)

    cameras = [camera.name for camera in values.cameras]
    request = replace(request, captures=with_ids(request.captures, cameras))
    seen = [item for item in request.captures if not item.hold_out]
    if request.captures and not seen and captures_at is None:
        cause, cure = "every photo is held out", "let it see one at least"
        problems.append(Problem("Fit", cause, cure))

    def photos(
        height: int, warn: list[str], asked: Sequence[CaptureRequest] = seen
    ) -> list[Capture]:
        if captures_at is not None:
            return captures_at(height)
        good = [item for item in asked if not _not_files(item)]
        sizes = [size for camera in values.cameras for size in (camera.width, camera.height)]
        if (request.captures and not good) or min(sizes, default=1) < 1:
            return []  # it has been told why
        owners = fitted_owners(values, requests)
        return read_captures(
            values, good, height, problems, warn, packed or {}, owners, go_on=go_on
        )

    for item in request.captures:
        problems += _not_files(item)

    captures = photos(request.settings.height, warnings)
    unseen = [item for item in request.captures if item.hold_out and captures_at is None]
    hold_out = photos(request.settings.height, [], unseen) if unseen and seen else []
    warnings += light_states.remarks(values, request.captures)
    if problems:
        raise BadInput(problems)
    values = values.without_shut({(item.owner, item.parameter.name) for item in unknowns})
    go_on()
    source = all_fields.with_fields(values, fields)
    scene = _with_shapes(build_scene(source), fields)
    if dark := problems_of_darkness(values, captures, unknowns, fields):
        raise BadInput(dark)
    warnings += gauge.remarks(values, captures, names)
    if captures_at is None:
        warnings += _suspicions(values, replace(request, unknowns=requests), captures, scene)
    starts = stage_plan.constants({item.name: item.start for item in unknowns}, unknowns, fields)
    by_height = {request.settings.height: captures}
    stages = []
    for stage, own in zip(wanted, settings, strict=True):
        if any(shape_apart.is_shape(name) for name in stage.parameters):
            own = vertex_positions.with_loss(own)
        if own.height not in by_height:
            by_height[own.height] = photos(own.height, [])
        active = stage_plan.active_fields(stage.name, wanted, unknowns, fields)
        base, base_source = scene, source
        if len(active) < len(fields):
            base_source = all_fields.with_fields(values, active)
            base = _with_shapes(build_scene(base_source), fields)
        stages.append(Stage(stage, own, by_height[own.height], base, tuple(active), base_source))
    return FitPlan(
        request=replace(
            request,
            unknowns=(*(_filled(item) for item in unknowns), *(item.request for item in fields)),
            stages=tuple(wanted),
        ),
        scene=scene.with_values(starts),
        captures=captures,
        unknowns=unknowns,
        fields=fields,
        warnings=warnings,
        model=model_name(unknowns, fields),
        millimetres=values.millimetres,
        stages=tuple(stages),
        transmits=_transmits(values, requests),
        opaque=not (_transmits(values, requests) or _has_medium(values, requests)),
        hold_out=tuple(hold_out),
        azimuths=_azimuths(values, captures),
        source=source,
        starts=starts,
    )


def _with_shapes(scene: Scene, fields: Sequence[FieldUnknown]) -> Scene:
    """The native scene with the vertices where they start."""
    for item in fields:
        if item.kind.is_shape:
            scene = item.placed(scene, item.values)
    return scene


def _azimuths(values: SceneValues, captures: Sequence[Capture]) -> dict[str, float]:
    if len({light_states.key_of(item.lights) for item in captures}) > 1:
        return {}
    ahead = {camera.name: -np.asarray(camera.matrix, float)[:3, 2] for camera in values.cameras}
    return {
        item.id: float(np.arctan2(*ahead[item.camera][1::-1]))
        for item in captures
        if item.camera in ahead
    }


def _transmits(values: SceneValues, requests: Sequence[UnknownRequest]) -> bool:
    """Whether light passes through a fitted material, or a fit may find that it does."""
    owners = fitted_owners(values, requests)
    return any(item.parameter == "transmission" for item in requests) or any(
        "transmission" in item.maps or item.values.get("transmission", (0.0,))[0] > 0
        for item in values.materials
        if item.name in owners
    )


def _has_medium(values: SceneValues, requests: Sequence[UnknownRequest]) -> bool:
    """Whether a fitted material holds a medium."""
    owners = fitted_owners(values, requests)
    return any(
        item.grids or max(item.values.get("extinction", (0.0,))) > 0
        for item in values.materials
        if item.name in owners
    )


def _suspicions(
    values: SceneValues, request: RunRequest, captures: Sequence[Capture], scene: Scene
) -> list[str]:
    """Of the photos without a mask, beside what the scene renders at its start values."""
    asked = with_ids(request.captures, (camera.name for camera in values.cameras))
    unmasked = {
        item.id for item in asked if not (item.mask or item.background) and item.silhouette is None
    }
    free = {item.id for item in asked if item.gain not in ("", "none")}
    owners = fitted_owners(values, request.unknowns)
    silhouettes = Silhouettes(values, owners)
    lit = not owners <= {item.name for item in values.materials}
    depth, threads = request.settings.depth, request.settings.threads
    found = (
        suspicion.remark(
            item, scene, silhouettes, depth, threads, black_only=lit or item.id in free
        )
        for item in captures
        if item.id in unmasked
    )
    return [text for text in found if text]


def _not_files(capture: CaptureRequest) -> list[Problem]:
    """Folders, pipes and names that no file can have; what merely does not exist is told by who
    reads it."""
    found = []
    for title, name in capture.files().items():
        why = "" if not name or name.startswith(PACKED) else why_not_file(name)
        if why and why != MISSING:
            found.append(Problem(title, f"cannot be read ({why})", "give a file"))
    return found


def build_scene(values: SceneValues) -> Scene:
    """Builds the native scene; what the native side refuses becomes a Problem. What else is wrong
    with a scene without a camera is told with that."""
    problems = [*values.problems, *not_finite(values)]
    if any(item not in values.camera_problems for item in problems):
        raise BadInput(problems)
    try:
        with refused("Scene", "correct the scene"):
            scene = build(values)
    except BadInput as error:
        raise BadInput([*problems, *error.problems]) from error
    triangles: dict[str, int] = {}
    for mesh in values.meshes:
        triangles[mesh.name] = triangles.get(mesh.name, 0) + len(mesh.triangles)
    for name, count in scene.dropped_triangles.items():
        if count >= triangles.get(name, 0):
            cause = f"none of its {count} triangles has an area"
            cure = "scale its faces up, hide it from renders or delete it"
            problems.append(Problem(thing("Mesh", name), cause, cure))
        else:
            values.warn(remark(thing("Mesh", name), f"{count} degenerate triangles are left out"))
    if problems:
        raise BadInput(problems)
    return scene


def paths_traced(scene: Scene) -> str:
    """How many paths of the scene a thread traces together, and why."""
    obstacle = native.core().lanes_obstacle(scene)
    return f"one at a time: {obstacle}" if obstacle else "eight at a time"


def model_name(unknowns: list[Unknown], fields: Sequence[FieldUnknown] = ()) -> str:
    """Which model the ticked parameters need, and why."""
    if any(item.kind.is_grid for item in fields):
        return "volume: a ticked parameter is a grid"
    if any(item.kind.is_shape for item in fields):
        return "shape: the vertices of an object are fitted" + (
            ", and in other stages all else" if unknowns or len(fields) > 1 else ""
        )
    effects = {item.parameter.effect for item in unknowns}
    if "visibility" in effects:
        return "visibility: a ticked parameter moves silhouettes"
    if "volume" in effects:
        return "volume: a ticked parameter belongs to a medium"
    return "surface: no ticked parameter belongs to a medium or moves silhouettes"


def _filled(unknown: Unknown) -> UnknownRequest:
    return UnknownRequest(
        unknown.owner,
        unknown.parameter.name,
        unknown.start,
        unknown.minimum,
        unknown.maximum,
        unknown.learning_rate,
    )
