# SPDX-License-Identifier: GPL-3.0-or-later
"""What rays see: ray visibility of objects, lamps and the world; holdouts and film.

Light linking and shadow linking are in `linking`. What the renderer makes of it:
docs/method/rendering.md, "Visibility".
"""

from __future__ import annotations

from dataclasses import replace

import bpy

from . import hosts
from .values import ALL_RAYS, NO_LIMIT, LightValues, SceneValues, WorldValues

# The light sampler of Cycles counts to here; a lamp with this limit has none.
_MOST_BOUNCES = 1024
_IN_WORLD = {"volume_scatter": "scatter"}


def rays_that_see(
    item: bpy.types.Object, instancer: bpy.types.Object, layer: bpy.types.ViewLayer
) -> tuple[str, ...]:
    """Kinds of rays that see an original object, also where `instancer` shows it (else itself)."""
    owners = [item] if instancer == item else [item, instancer]
    hidden = set()
    if not is_holdout(instancer, layer) and instancer.indirect_only_get(view_layer=layer):
        hidden.add("camera")
    return tuple(
        kind
        for kind in ALL_RAYS
        if kind not in hidden and all(getattr(owner, f"visible_{kind}") for owner in owners)
    )


def is_holdout(instancer: bpy.types.Object, layer: bpy.types.ViewLayer) -> bool:
    """Whether an object, or what it instances, is cut out of the picture: by itself or its
    collection."""
    return bool(instancer.holdout_get(view_layer=layer))


def of_lamp(values: LightValues, light: bpy.types.Light, rays: tuple[str, ...]) -> LightValues:
    """The values of a lamp with what rays see of it. `rays`: those that see its object."""
    cycles = light.cycles
    bounces = int(getattr(cycles, "max_bounces", _MOST_BOUNCES))
    return replace(
        values,
        visible_to=tuple(kind for kind in rays if kind != "shadow"),
        casts_shadows=hosts.casts_shadow(light),
        met_by_rays=bool(getattr(cycles, "use_multiple_importance_sampling", True)),
        max_bounces=NO_LIMIT if bounces >= _MOST_BOUNCES else bounces,
    )


def warnings(read: SceneValues) -> list[str]:
    """Lamps of which Cycles shows an amount that its choice among lamps decides: glass is one lobe
    for reflection and refraction, so a light sample takes both where rays see one of them."""
    shown = [
        item
        for item in read.materials
        if any(item.values.get("transmission", ())) or "transmission" in item.maps
    ]
    if not shown or len(read.lights) < 2:
        return []
    return [
        f"Light '{light.name}': it is hidden from glossy or transmission rays alone, and glass "
        f"like material '{shown[0].name}' shows it by a few per cent otherwise than Cycles, which "
        "chooses among several lamps by another rule: hide it from both or from neither"
        for light in read.lights
        if ("glossy" in light.visible_to) != ("transmission" in light.visible_to)
    ]


def of_world(
    values: WorldValues, world: bpy.types.World | None, scene: bpy.types.Scene
) -> WorldValues:
    """The values of a world with what rays see of it, and what the film keeps of it."""
    values = replace(
        values,
        transparent_film=scene.render.film_transparent,
        film_roughness=_film_roughness(scene),
    )
    if world is None:
        return values
    bounces = int(world.cycles.max_bounces)
    flags = world.cycles_visibility
    return replace(
        values,
        visible_to=tuple(
            kind
            for kind in ALL_RAYS
            if kind == "shadow" or getattr(flags, _IN_WORLD.get(kind, kind))
        ),
        max_bounces=NO_LIMIT if bounces >= _MOST_BOUNCES else bounces,
    )


def _film_roughness(scene: bpy.types.Scene) -> float:
    """Up to which glass hides the world from a transparent film; negative: none does."""
    if not (scene.render.film_transparent and scene.cycles.film_transparent_glass):
        return -1.0
    return float(scene.cycles.film_transparent_roughness)
