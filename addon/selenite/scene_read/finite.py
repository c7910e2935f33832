# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers of a scene that are infinite or not a number: named before anything is computed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass

import numpy as np

from ..problems import Problem
from .values import CameraValues, LightValues, MaterialValues, MeshValues, ObjectValues, SceneValues

_Named = CameraValues | MeshValues | ObjectValues | MaterialValues | LightValues

_CURE = "give it finite numbers"
#: Corners are judged by whether a material uses them; the native module mends normals.
_OF_CORNERS = ("corner_normals", "uv_maps", "colors")


def not_finite(values: SceneValues) -> list[Problem]:
    """A problem for each thing with such a number that would be rendered."""
    lists: tuple[tuple[str, Sequence[_Named]], ...] = (
        ("Camera", values.cameras),
        ("Mesh", values.meshes),
        ("Object", values.objects),
        ("Material", values.materials),
        ("Light", values.lights),
    )
    named = [(f"{kind} '{item.name}'", item) for kind, items in lists for item in items]
    found = []
    for title, item in (*named, ("World", values.world)):
        places = list(dict.fromkeys(_places(item, "")))
        if places:
            cause = f"its {', '.join(places)} has a number that is infinite or not a number"
            found.append(Problem(title, cause, _CURE))
    return [*found, *_corners(values)]


def _places(value: object, name: str) -> Iterator[str]:
    if isinstance(value, np.ndarray):
        if value.dtype.kind == "f" and not np.isfinite(value).all():
            yield name
    elif isinstance(value, float):
        if not np.isfinite(value):
            yield name
    elif is_dataclass(value):
        own = getattr(value, "name", "")
        for item in fields(value):
            if item.name not in _OF_CORNERS:
                inside = f"image or grid '{own}'" if name and own else item.name.replace("_", " ")
                yield from _places(getattr(value, item.name), inside)
    elif isinstance(value, Mapping):
        for key, item in value.items():
            yield from _places(item, str(key).replace("_", " "))
    elif isinstance(value, (list, tuple)):
        for item in value:
            yield from _places(item, name)


def _corners(values: SceneValues) -> Iterator[Problem]:
    """UV maps and colour attributes that a material of the mesh looks up."""
    maps = {item.name: list(item.maps.values()) for item in values.materials}
    seen = set()
    for item in values.objects:
        mesh = values.meshes[item.mesh]
        for found in (one for name in item.materials for one in maps.get(name, ())):
            lists = mesh.colors if found.texture is None else mesh.uv_maps
            kind = "colour attribute" if found.texture is None else "UV map"
            for index, (name, numbers) in enumerate(lists):
                used = name == found.attribute or (index == 0 and not found.attribute)
                if used and (mesh.name, name) not in seen and not np.isfinite(numbers).all():
                    seen.add((mesh.name, name))
                    cause = f"its {kind} '{name}' has numbers that are infinite or not a number"
                    yield Problem(f"Mesh '{mesh.name}'", cause, _CURE)
