# SPDX-License-Identifier: GPL-3.0-or-later
"""What workers need of a fit, as bytes: its scenes, unknowns and photos without their pixels.

A scene is the calls that built it. A worker repeats them, so it needs neither Blender nor the files.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np

from ... import __version__, native
from ...scene_read.build import describe
from ...scene_read.values import SceneValues
from ..plan import FitPlan
from .plain import packed, unpacked

if TYPE_CHECKING:
    from ..._core import Scene, SceneBuilder, StageWorker, Unknown
    from ...capture.prepared import Capture

#: Size and samples of the picture by which a worker shows that it computes the same numbers.
_PROOF_SIZE, _PROOF_SPP = 24, 8


@dataclass(frozen=True)
class Parcel:
    """data: see `opened`. digest: of the data. proof: of a picture of the first scene."""

    data: bytes
    digest: str
    proof: str


def parcel_of(plan: FitPlan) -> Parcel:
    """What workers need of a plan."""
    scenes: list[SceneValues] = [plan.source]
    stages = []
    if plan.stages:
        for stage in plan.stages:
            if not any(stage.source is scene for scene in scenes):
                scenes.append(stage.source)
            index = next(i for i, scene in enumerate(scenes) if scene is stage.source)
            request = stage.request
            stages.append({
                "name": request.name, "parameters": request.parameters,
                "fields": [item.name for item in stage.fields], "scene": index,
                "photos": _photos(stage.captures), "settings": stage.settings.native(),
            })  # fmt: skip
    else:
        fields = [item.name for item in plan.fields]
        stages.append({
            "name": "", "parameters": [*(item.name for item in plan.unknowns), *fields],
            "fields": fields, "scene": 0,
            "photos": _photos(plan.captures), "settings": plan.request.settings.native(),
        })  # fmt: skip
    starts = {} if plan.stages else plan.starts
    data = packed({
        "version": __version__,
        "scenes": [_calls(scene) for scene in scenes],
        "starts": [[*name, value] for name, value in starts.items()],
        "unknowns": [_unknown(item.native()) for item in (*plan.unknowns, *plan.fields)],
        "stages": stages,
    })  # fmt: skip
    first = plan.stages[0].scene if plan.stages else plan.scene
    return Parcel(data, hashlib.sha256(data).hexdigest(), proof(first))


def opened(data: bytes, threads: int) -> tuple[StageWorker, str]:
    """Who answers the questions of the fit, and its proof. Raises ValueError, KeyError."""
    found = cast("Mapping[str, list]", unpacked(data))
    core = native.core()
    scenes = [_built(calls) for calls in found["scenes"]]
    starts = {(owner, name): value for owner, name, value in found["starts"]}
    scenes[0] = scenes[0].with_values(starts)
    stages = [
        core.Stage(
            item["name"], item["parameters"], item["fields"], scenes[item["scene"]],
            [core.Photo(reference=np.ones((1, 1, 3), np.float32), **photo) for photo in item["photos"]],
            item["settings"],
        )
        for item in found["stages"]
    ]  # fmt: skip
    unknowns = [core.Unknown(**item) for item in found["unknowns"]]
    first = scenes[found["stages"][0]["scene"]]
    return core.StageWorker(unknowns, stages, threads=threads), proof(first)


def proof(scene: Scene) -> str:
    """Digest of a small picture, with what rounding makes of it: of the same scene, build and kind of
    processor it is the same."""
    photo = native.core().Photo(scene.cameras[0], size=(_PROOF_SIZE, _PROOF_SIZE))
    film = native.core().Evaluator(scene, threads=1).picture(photo, _PROOF_SPP)
    return hashlib.sha256(np.ascontiguousarray(film.image).tobytes()).hexdigest()


def _photos(captures: Sequence[Capture]) -> list[dict[str, object]]:
    return [
        {"camera": one.camera, "id": one.id, "lights": one.lights, "gain": one.gain, **one.of_fit}
        for one in captures
    ]


def _unknown(item: Unknown) -> dict[str, object]:
    names = ("owner", "parameter", "minimum", "maximum", "start", "learning_rate")
    return {name: getattr(item, name) for name in names}


class _Recorder:
    """A builder of scenes that notes what it is called with."""

    def __init__(self) -> None:
        self.calls: list[list[object]] = []
        self._builder = native.core().SceneBuilder()

    def __getattr__(self, name: str) -> Callable[..., object]:
        method = getattr(self._builder, name)

        def noted(*args: object, **named: object) -> object:
            self.calls.append([name, args, named])
            return method(*args, **named)

        return noted


def _calls(values: SceneValues) -> list[list[object]]:
    recorder = _Recorder()
    describe(values, cast("SceneBuilder", recorder))
    return recorder.calls


def _built(calls: Sequence[tuple[str, Sequence[object], Mapping[str, object]]]) -> Scene:
    builder = native.core().SceneBuilder()
    for name, args, named in calls:
        if not name.startswith(("add_", "set_")):
            raise ValueError(f"'{name}' describes no scene")
        getattr(builder, name)(*args, **named)
    return builder.build()
