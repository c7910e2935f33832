# SPDX-License-Identifier: GPL-3.0-or-later
"""Which lights were on when a photo was taken, and where: from a request to what the native scene
takes. See docs/guide/lights_of_captures.md."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ..problems import Problem, choice, listed
from ..scene_read.lamps import places as lamp_places
from ..scene_read.values import LightValues, SceneValues
from .request import CaptureRequest

#: What the native `Scene.with_lights` and a photo's `lights` take: {lamps: names of objects that
#: are on, or None for all; world: bool; places: {name: (matrix, radiance scale)}}.
LightState = Mapping[str, Any]
#: All as in the scene.
AS_IN_SCENE: LightState = {"lamps": None, "world": True, "places": {}}


def light_state(
    values: SceneValues, request: CaptureRequest, problems: list[Problem]
) -> LightState:
    """The light state of a photo. What a scene cannot show so goes to `problems`."""
    who = f"Photo '{request.id or request.camera}'"
    lamps = _lamps(values, request, who, problems)
    placed: dict[str, tuple[LightValues, np.ndarray]] = {}
    if request.frame is not None:
        lamps = _at_frame(values, request.frame, lamps, placed, problems)
    for name, numbers in request.transforms:
        light = _one_place(values.lights, name, who, problems)
        if light is None:
            continue
        problem = lamp_places.problem_of_place(who, light, numbers)
        if problem is not None:
            problems.append(problem)
        else:
            placed[light.object or light.name] = light, lamp_places.placed(light, numbers)
    places: dict[str, tuple[np.ndarray, float | None]] = {}
    for name, (light, matrix) in placed.items():
        there = lamp_places.moved(light, matrix)
        places[name] = (there.matrix, there.radiance_scale)
    return {"lamps": lamps, "world": request.world, "places": places}


def remarks(values: SceneValues, requests: Iterable[CaptureRequest]) -> list[str]:
    """What light states do not change, where photos have some."""
    requests = list(requests)
    frames = dict.fromkeys(item.frame for item in requests if item.frame is not None)
    found = [text for frame in frames for text in values.lamp_frames[frame].warnings]
    if all(item.lights is None and item.world for item in requests):
        return found
    emitting = [
        item.name
        for item in values.materials
        if "emission_strength" in item.maps or any(item.values.get("emission_strength", ()))
        if "emission_color" in item.maps or any(item.values.get("emission_color", ()))
    ]
    if not emitting:
        return found
    return [
        *found,
        f"Materials {listed(emitting)} emit light in every photo: the lights of a capture are "
        "lamps and the world; use lamps where that light was switched",
    ]


def is_as_in_scene(lights: LightState) -> bool:
    """Whether a light state is that of the scene."""
    return lights["lamps"] is None and bool(lights["world"]) and not lights["places"]


def key_of(lights: LightState) -> tuple[object, ...]:
    """Equal for equal light states, and hashable."""
    lamps = lights["lamps"]
    places = sorted(
        (name, np.asarray(matrix).tobytes(), scale)
        for name, (matrix, scale) in lights["places"].items()
    )
    return (None if lamps is None else tuple(sorted(lamps)), lights["world"], tuple(places))


def most_common(states: Sequence[LightState]) -> LightState:
    """The light state that most photos have, of equal ones the first."""
    counts = Counter(key_of(item) for item in states)
    return max(states, key=lambda item: counts[key_of(item)], default=AS_IN_SCENE)


def described(lights: LightState) -> str:
    """A light state in words, for messages: "lamp 'Key'", "no lamp", "all lamps, world off"."""
    lamps = lights["lamps"]
    if lamps is None:
        text = "all lamps"
    elif not lamps:
        text = "no lamp"
    else:
        text = f"{'lamp' if len(lamps) == 1 else 'lamps'} {listed(lamps)}"
    moved = [name for name in lights["places"] if lamps is None or name in lamps]
    if moved:
        text += f" ({listed(moved)} moved)"
    return text if lights["world"] else f"{text}, world off"


def _lamps(
    values: SceneValues, request: CaptureRequest, who: str, problems: list[Problem]
) -> list[str] | None:
    """Objects of the lamps that were on, in the order of the scene; None: all."""
    if request.lights is None:
        return None
    for name in request.lights:
        if not lamp_places.at_place(name, values.lights):
            problems.append(_unknown(values.lights, name, who))
    on = {
        light.object or light.name
        for name in request.lights
        for light in lamp_places.at_place(name, values.lights)
    }
    return [name for name in lamp_places.names_of(values.lights) if name in on]


def _one_place(
    lights: Sequence[LightValues], name: str, who: str, problems: list[Problem]
) -> LightValues | None:
    """The lamp of a name, if it stands at one place."""
    found = lamp_places.at_place(name, lights)
    if len(found) == 1:
        return found[0]
    if not found:
        problems.append(_unknown(lights, name, who))
        return None
    cause = f"it stands at {len(found)} places, so one matrix cannot move it"
    cure = "name one of its objects, or make its instances real"
    problems.append(Problem(f"{who}: lamp '{name}'", cause, cure))
    return None


def _at_frame(
    values: SceneValues,
    frame: int,
    lamps: list[str] | None,
    placed: dict[str, tuple[LightValues, np.ndarray]],
    problems: list[Problem],
) -> list[str] | None:
    """Moves lamps to where they stand at a frame; returns those that are on, without what is hidden
    there."""
    there = values.lamp_frames[frame]
    problems += [problem for problem in there.problems if problem not in problems]
    for light in values.lights:
        matrix = there.places.get(light.object)
        if matrix is not None and not np.array_equal(matrix, light.matrix):
            placed[light.object] = light, matrix
    names = lamp_places.names_of(values.lights)
    hidden = [name for name in names if name not in there.places]
    if not hidden or there.problems:
        return lamps
    return [name for name in (names if lamps is None else lamps) if name not in hidden]


def _unknown(lights: Sequence[LightValues], name: str, who: str) -> Problem:
    if not name:
        cure = "choose one, or set its lights to all lamps"
        return Problem(who, "its lights are a lamp or a collection, and none is chosen", cure)
    cure = choice(name, lamp_places.names_of(lights))
    return Problem(f"{who}: lamp '{name}'", "it is not in the scene, or hidden from renders", cure)
