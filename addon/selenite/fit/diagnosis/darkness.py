# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos whose render is black whatever the fit finds: no light of the scene was on in them."""

from __future__ import annotations

from collections.abc import Sequence

from ...capture.light_states import AS_IN_SCENE, LightState, described
from ...capture.prepared import Capture
from ...problems import Problem
from ...scene_read.values import MaterialValues, SceneValues
from ..fields import FieldUnknown
from ..unknowns import Unknown

#: The kind of the Problem of a scene without light.
DARK = "dark"
#: Who owns the world's parameters.
_WORLD = "World"


def problems_of_darkness(
    values: SceneValues,
    captures: Sequence[Capture],
    unknowns: Sequence[Unknown],
    fields: Sequence[FieldUnknown],
) -> list[Problem]:
    """One for a scene without light, else one for each photo whose lights give none."""
    # A rotation makes no light.
    fitted = {
        item.owner
        for item in unknowns
        if item.parameter.effect == "emission" and item.parameter.scale != "angle"
    }
    fitted |= {_WORLD for item in fields if item.kind.is_environment}
    if any(item.name in fitted or _shines(item) for item in values.materials):
        return []
    if _is_dark(values, AS_IN_SCENE, fitted):
        cause = "no lamp, world or material of it gives light, and none of them is fitted"
        cure = "add the light of the photos: a lamp, the world's color and strength, or an emission"
        return [Problem("Scene", cause, cure, DARK)]
    cure = "say which lamps were on, and whether the world was; or leave the photo out"
    return [
        Problem(f"Photo '{item.id}'", f"its lights give no light ({described(item.lights)})", cure)
        for item in captures
        if _is_dark(values, item.lights, fitted)
    ]


def _is_dark(values: SceneValues, lights: LightState, fitted: set[str]) -> bool:
    on = lights["lamps"]
    lamps = (item for item in values.lights if on is None or (item.object or item.name) in on)
    if any(item.name in fitted or (item.power > 0 and max(item.color) > 0) for item in lamps):
        return False
    world = values.world
    sky = world.strength > 0 and max(world.color) > 0
    return not (lights["world"] and (sky or _WORLD in fitted))


def _shines(material: MaterialValues) -> bool:
    """Whether strength and colour of its emission are above 0: Blender 3 begins with a strength of
    1 and black."""
    return all(
        name in material.maps or max(material.values.get(name, (default,))) > 0
        for name, default in (("emission_strength", 0.0), ("emission_color", 1.0))
    )
