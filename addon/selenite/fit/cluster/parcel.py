# SPDX-License-Identifier: GPL-3.0-or-later
"""What workers need of a fit, as bytes: scenes, unknowns, photos without pixels; see `opened`.

A scene is the calls that built it. A worker repeats them and needs neither Blender nor files.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

from ... import __version__, native
from ...scene_read.build import describe
from ...scene_read.values import SceneValues
from ..plan import FitPlan
from .opened import proof
from .plain import packed

if TYPE_CHECKING:
    from ..._core import SceneBuilder, Unknown
    from ...capture.prepared import Capture


@dataclass(frozen=True)
class Parcel:
    """digest: of the data. proof: of a picture of the first scene."""

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
    unknowns = [item.native() for item in plan.unknowns]
    unknowns += [item.native() for item in plan.fields]
    starts = {} if plan.stages else plan.starts
    data = packed({
        "version": __version__,
        "scenes": [_calls(scene) for scene in scenes],
        "vertices": [[item.owner, item.values] for item in plan.fields if item.kind.is_shape],
        "starts": [[*name, value] for name, value in starts.items()],
        "unknowns": [_unknown(item) for item in unknowns],
        "stages": stages,
    })  # fmt: skip
    first = plan.stages[0].scene if plan.stages else plan.scene
    return Parcel(data, hashlib.sha256(data).hexdigest(), proof(first))


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
