# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps as they stand at other frames of the scene: light states that are keyed.

Only lamps may move. What else is different at a frame would show in the photo and not in the fit,
which has one geometry: it is named.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import bpy
import numpy as np

from ...messages import thing
from ...problems import Problem, listed
from .. import camera as cameras
from .. import hosts
from ..geometry import mesh
from ..reading.render_depsgraph import GraphRead, Reading, at_once
from ..values import LampFrame, SceneValues
from .lights import is_portal

#: Of coordinates, relative to the largest of a matrix: two evaluations may differ by rounding.
_ROUNDING = 1e-5
#: Of a lamp, beside its place: what changes its light.
_LAMP = [
    "type",
    "energy",
    "color",
    "size",
    "size_y",
    "shape",
    "spread",
    "shadow_soft_size",
    "spot_size",
    "spot_blend",
    "angle",
    "exposure",
    "use_temperature",
    "temperature",
    "normalize",
]


@dataclass
class _Seen:
    """What renders at one frame. Lamps and objects by their objects' names, all places of each."""

    lamps: dict[str, list[np.ndarray]] = field(default_factory=dict)
    lights: dict[str, dict[str, object]] = field(default_factory=dict)
    objects: dict[str, list[np.ndarray]] = field(default_factory=dict)
    shapes: dict[str, str] = field(default_factory=dict)
    cameras: dict[str, np.ndarray] = field(default_factory=dict)


class LampFrames(dict[int, LampFrame]):
    """Frames of a scene, each read when it is asked for; the scene stays as it is."""

    def __init__(self, scene: bpy.types.Scene, values: SceneValues) -> None:
        """values: what was read of the scene."""
        super().__init__()
        self._scene, self._values = scene, values
        self._here: _Seen | Problem | None = None

    def __missing__(self, frame: int) -> LampFrame:
        at_once(self.reading(frame))
        return self[frame]

    def reading(self, frame: int) -> Reading[None]:
        """Reads a frame that was not asked for yet."""
        if frame in self:
            return
        if self._here is None:
            self._here = yield from _seeing(self._scene, None)
        here = self._here
        there = here if isinstance(here, Problem) else (yield from _seeing(self._scene, frame))
        if isinstance(there, Problem):
            found = LampFrame({}, (there,))
        else:
            assert isinstance(here, _Seen), here
            places = {name: matrices[0] for name, matrices in there.lamps.items()}
            problems = tuple(_differences(frame, here, there))
            found = LampFrame(places, problems, tuple(_animated(frame, self._values)))
        self[frame] = found


def reading_frames(values: SceneValues, frames: Iterable[int]) -> Reading[None]:
    """Has these frames in `values.lamp_frames` of a scene that was read."""
    known = values.lamp_frames
    assert isinstance(known, LampFrames), known
    for frame in frames:
        yield from known.reading(frame)


def _seeing(scene: bpy.types.Scene, frame: int | None) -> Reading[_Seen | Problem]:
    found = _Seen()
    named = cameras.named_cameras(scene)

    def read(depsgraph: bpy.types.Depsgraph, check: Callable[[], None]) -> None:
        for name, item in named.items():
            found.cameras[name] = np.array(item.evaluated_get(depsgraph).matrix_world, np.float64)
        scratch = SceneValues()  # what is to be said of the scene was said where it was read
        for instance in mesh.rendered_instances(depsgraph, scratch):
            check()
            name, data = instance.original.name, instance.object.data
            if isinstance(data, bpy.types.Light):
                if is_portal(data):
                    continue
                found.lamps.setdefault(name, []).append(instance.matrix)
                found.lights[name] = {key: _plain(getattr(data, key, None)) for key in _LAMP}
            elif instance.object.type in {"MESH", "VOLUME"}:
                found.objects.setdefault(name, []).append(instance.matrix)
                if name not in found.shapes:
                    found.shapes[name] = _shape_of(instance.object)

    problem = yield GraphRead(scene, list(named.values()), read, frame)
    return found if problem is None else problem


def _shape_of(evaluated: bpy.types.Object) -> str:
    """A digest of the vertices of a mesh after modifiers; "" of anything else."""
    if evaluated.type != "MESH":
        return ""
    with mesh.mesh_of(evaluated) as shape:
        positions = hosts.floats(shape.vertices, "co", 3)
    return hashlib.sha256(positions.tobytes()).hexdigest()


def _plain(value: str | float | Iterable[float] | None) -> object:
    return value if isinstance(value, (str, int, float, type(None))) else tuple(value)


def _differences(frame: int, here: _Seen, there: _Seen) -> list[Problem]:
    """What a frame changes beside the places of lamps."""
    problems = []
    only = "only lamps may move from frame to frame"
    for kind, before, now in (
        ("Object", here.objects, there.objects),
        (
            "Camera",
            {k: [m] for k, m in here.cameras.items()},
            {k: [m] for k, m in there.cameras.items()},
        ),
    ):
        cure = "clear its animation"
        if kind == "Camera":
            cure += ", and make a camera for each of its places"
        for name in dict.fromkeys([*before, *now]):
            if not _same_places(before.get(name, []), now.get(name, [])):
                how = "stands elsewhere" if now.get(name) else "does not render"
                cause = f"it {how} at frame {frame}, unlike in the scene, and {only}"
                problems.append(Problem(f"{kind} '{name}'", cause, cure))
    for name, shape in here.shapes.items():
        if there.shapes.get(name, shape) != shape:
            cause = f"its shape at frame {frame} is not that in the scene, and {only}"
            problems.append(
                Problem(thing("Object", name), cause, "clear the animation of its shape")
            )
    for name, lamp in there.lights.items():
        title = thing("Lamp", name)
        if name not in here.lights:
            cause = f"it renders at frame {frame} and not in the scene"
            cure = "let it render always, and say in the captures which lamps were on"
            problems.append(Problem(title, cause, cure))
            continue
        changed = [key for key in _LAMP if lamp[key] != here.lights[name][key]]
        if changed:
            cause = f"its {listed(changed)} at frame {frame} is not that in the scene, and {only}"
            cure = "clear that animation, and say in the captures which lamps were on"
            problems.append(Problem(title, cause, cure))
        if len(there.lamps[name]) > 1 and not _same_places(here.lamps[name], there.lamps[name]):
            cause = f"it stands at {len(there.lamps[name])} places that move"
            problems.append(Problem(title, cause, "make its instances real"))
    return problems


def _same_places(before: list[np.ndarray], now: list[np.ndarray]) -> bool:
    if len(before) != len(now):
        return False
    return all(
        np.abs(a - b).max() <= _ROUNDING * max(1.0, np.abs(a).max())
        for a, b in zip(before, now, strict=True)
    )


def _animated(frame: int, values: SceneValues) -> list[str]:
    """Materials and a world that are keyed are read where the scene is."""
    found = []
    for owner in values.owners.values():
        key = (owner.datablock, owner.library or None)
        block: bpy.types.Material | bpy.types.World | None = None
        if owner.kind == "material":
            block = bpy.data.materials.get(key)
        elif owner.kind == "world":
            block = bpy.data.worlds.get(key)
        trees = (block, block.node_tree) if block is not None else ()
        if any(tree is not None and any(hosts.animated_paths(tree)) for tree in trees):
            found.append(
                f"{owner.kind.capitalize()} '{owner.datablock}': it is animated; captures of frame "
                f"{frame} see it as it is in the scene"
            )
    return found
