# SPDX-License-Identifier: GPL-3.0-or-later
"""The rotation and exposure of a known panorama, by which the scene looks most like its photos.

A search over whole columns of a smaller image: rotating it about its own vertical axis moves its
columns, so that one native scene serves all angles.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .. import native
from ..environments import sphere
from ..problems import BadInput, Problem
from ..scene_read.values import SceneValues
from .captures.prepared import Capture
from .captures.render import shown, under_its_lights
from .plan import build_scene
from .settings import FitSettings

#: Columns of the image that is rotated: 2.8 degrees each; and between two of the first angles.
_COLUMNS, _STEP = 128, 4
#: Angles around the best of the first ones, in columns.
_NEAR = (-3, -2, -1, 1, 2, 3)
#: A minimum that is so many times as large as the smallest may be the right one as well.
_EQUIVALENT = 1.2


@dataclass(frozen=True)
class Rotation:
    """angle: radians that a Mapping of type Point adds about Z behind those that there are. factor:
    on the strength. misfit: the share of the photos' squared brightness that is left. other: the
    angle of a minimum far away that is nearly as good, None where there is none. angles and
    misfits: of all that were tried, in order."""

    angle: float
    factor: float
    misfit: float
    other: float | None
    angles: tuple[float, ...]
    misfits: tuple[float, ...]


def found(
    values: SceneValues,
    captures: Sequence[Capture],
    settings: FitSettings,
    progress: Callable[[float], None] = lambda _fraction: None,
) -> Rotation:
    """Tries all angles in steps of 11 degrees, and those of 3 degrees around the best.

    captures: that the scene is compared with; their gains are not free. Raises BadInput where the
    world has no image or is black.
    """
    world = values.world
    if world.image is None or not world.strength > 0:
        cause = "it has no image that gives light, whose rotation could be found"
        raise BadInput(Problem("World", cause, "give it an Environment Texture with a panorama"))
    rows = _COLUMNS // 2
    image = sphere.resampled(np.maximum(world.image, 0), np.eye(3), rows, _COLUMNS)
    scene = build_scene(replace(values, world=replace(world, image=image)))
    tried: dict[int, tuple[float, float]] = {}
    first = range(0, _COLUMNS, _STEP)
    steps = len(first) + len(_NEAR)

    def attempt(column: int) -> None:
        column %= _COLUMNS
        if column not in tried:
            rolled = np.ascontiguousarray(np.roll(image, column, axis=1))
            tried[column] = _misfit(scene.with_environment(rolled), captures, settings)
            progress(min(1.0, len(tried) / steps))

    for column in first:
        attempt(column)
    coarse = min(tried, key=lambda item: tried[item][0])
    for away in _NEAR:
        attempt(coarse + away)
    best = min(tried, key=lambda item: tried[item][0])
    order = sorted(tried)
    return Rotation(
        angle=_angle(best + _lowest(tried, best)),
        factor=tried[best][1],
        misfit=tried[best][0],
        other=_other(tried, best),
        angles=tuple(_angle(item) for item in order),
        misfits=tuple(tried[item][0] for item in order),
    )


def _angle(column: float) -> float:
    """Radians in (-pi, pi]."""
    return math.remainder(2 * math.pi * column / _COLUMNS, 2 * math.pi)


def _lowest(tried: dict[int, tuple[float, float]], best: int) -> float:
    """Of a parabola through the best column and its neighbours, in columns from it."""
    left, right = (tried.get((best + side) % _COLUMNS) for side in (-1, 1))
    if left is None or right is None:
        return 0.0
    curvature = left[0] - 2 * tried[best][0] + right[0]
    return 0.5 * (left[0] - right[0]) / curvature if curvature > 0 else 0.0


def _other(tried: dict[int, tuple[float, float]], best: int) -> float | None:
    """A local minimum of the first angles that is as good, and no neighbour of the best."""
    first = range(0, _COLUMNS, _STEP)
    for column in sorted(first, key=lambda item: tried[item][0]):
        sides = [tried[(column + side) % _COLUMNS][0] for side in (-_STEP, _STEP)]
        away = abs(math.remainder(column - best, _COLUMNS))
        if away > 2 * _STEP and tried[column][0] < min(sides):
            return _angle(column) if tried[column][0] < _EQUIVALENT * tried[best][0] else None
    return None


def _misfit(
    scene: Any,  # noqa: ANN401 - a native Scene
    captures: Sequence[Capture],
    settings: FitSettings,
) -> tuple[float, float]:
    """(share of the photos' weighted squares that is left, factor on the renders that leaves it).
    All angles have the same random numbers."""
    both = squares = photos = 0.0
    for item in captures:
        height, width = item.reference.shape[:2]
        film = native.core().render(
            under_its_lights(scene, item), item.camera, width, height, settings.spp,
            seed=settings.seed, depth=settings.depth, threads=settings.threads, frame=item.frame,
        )  # fmt: skip
        render = shown(film.image, item).astype(np.float64)
        weight = item.weight[..., None]
        both += float((weight * render * item.reference).sum())
        squares += float((weight * render**2).sum())
        photos += float((weight * item.reference.astype(np.float64) ** 2).sum())
    factor = both / squares if squares > 0 else 1.0
    left = photos - both * factor
    return (left / photos if photos > 0 else 0.0), factor
