# SPDX-License-Identifier: GPL-3.0-or-later
"""The rotation and exposure of a known panorama, by which the scene looks most like its photos.

A search over whole columns of a smaller image: rotating it about its own vertical axis moves its
columns, so that one native scene serves all angles.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ...capture.prepared import Capture, read_captures
from ...capture.request import CaptureRequest
from ...environments import sphere
from ...fit.capture_render import evaluator
from ...fit.plan import build_scene
from ...fit.settings import FitSettings
from ...problems import BadInput, Problem
from ...scene_read.values import SceneValues
from .job import Step

if TYPE_CHECKING:
    from ..._core import Scene

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


class RotationSearch:
    """Tries all angles in steps of 11 degrees, and those of 3 degrees around the best.

    Driven from outside: `for step in search.steps(): ...`; then `result`. warnings: of the photos,
    once they have been read. strength: of the world, at the angle found.
    """

    def __init__(
        self,
        values: SceneValues,
        requests: Sequence[CaptureRequest],
        settings: FitSettings,
        packed: Mapping[str, bytes],
    ) -> None:
        """requests: the captures that the scene is compared with. packed: photos in the file.

        Raises BadInput where the world has no image or is black.
        """
        world = values.world
        if world.image is None or not world.strength > 0:
            cause = "it has no image that gives light, whose rotation could be found"
            raise BadInput(
                Problem("World", cause, "give it an Environment Texture with a panorama")
            )
        self.values, self._requests, self._settings = values, requests, settings
        self._packed = packed
        self._image = sphere.resampled(
            np.maximum(world.image, 0), np.eye(3), _COLUMNS // 2, _COLUMNS
        )
        self._tried: dict[int, tuple[float, float]] = {}
        self._stop = threading.Event()
        self.warnings: list[str] = []
        self.result: Rotation | None = None

    @property
    def strength(self) -> float:
        """Needs `result`."""
        assert self.result is not None
        return float(self.values.world.strength * self.result.factor)

    def cancel(self) -> None:
        """From any thread: ends after the angle that is tried."""
        self._stop.set()

    def steps(self) -> Iterator[Step]:
        """The photos, then one for each angle. Raises BadInput with all that is wrong in them."""
        yield Step(0.0, "reading the photos")
        problems: list[Problem] = []
        captures = read_captures(
            self.values, self._requests, self._settings.height, problems, self.warnings,
            self._packed,
        )  # fmt: skip
        if problems:
            raise BadInput(problems)
        world = replace(self.values.world, image=self._image)
        scene = build_scene(replace(self.values, world=world))
        first = range(0, _COLUMNS, _STEP)
        count = len(first) + len(_NEAR)

        def attempts(columns: Iterable[int]) -> Iterator[Step]:
            for column in columns:
                if self._stop.is_set():
                    return
                done = len(self._tried)
                yield Step(0.05 + 0.95 * min(done / count, 1), f"angle {done + 1} of {count}")
                rolled = np.ascontiguousarray(np.roll(self._image, column % _COLUMNS, axis=1))
                self._tried[column % _COLUMNS] = _misfit(
                    scene.with_environment(rolled), captures, self._settings
                )

        yield from attempts(first)
        if self._stop.is_set():
            return
        coarse = self._best()
        yield from attempts(coarse + away for away in _NEAR)
        self.result = self._found()

    def _best(self) -> int:
        return min(self._tried, key=lambda item: self._tried[item][0])

    def _found(self) -> Rotation:
        best, tried, order = self._best(), self._tried, sorted(self._tried)
        return Rotation(
            angle=_angle(best + _lowest(tried, best)),
            factor=tried[best][1],
            misfit=tried[best][0],
            other=_other(tried, best),
            angles=tuple(_angle(item) for item in order),
            misfits=tuple(tried[item][0] for item in order),
        )


def said(search: RotationSearch) -> list[str]:
    """The result in words; a second line where another angle is nearly as good."""
    found = search.result
    assert found is not None
    left = 100 * math.sqrt(max(found.misfit, 0))
    lines = [
        f"rotation {math.degrees(found.angle):.1f} degrees about Z, strength "
        f"{search.strength:.4g}: {left:.1f} % of the photos' brightness is left"
    ]
    if found.other is not None:
        lines.append(
            f"{math.degrees(found.other):.0f} degrees explain the photos nearly as well; "
            "compare both by eye"
        )
    return lines


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
    scene: Scene,
    captures: Sequence[Capture],
    settings: FitSettings,
) -> tuple[float, float]:
    """(share of the photos' weighted squares that is left, factor on the renders that leaves it).
    All angles have the same random numbers."""
    both = squares = photos = 0.0
    seen = evaluator(scene, settings)
    for item in captures:
        film = seen.picture(item.view(), settings.spp, seed=settings.seed)
        render = film.image.astype(np.float64)
        weight = item.weight[..., None]
        both += float((weight * render * item.reference).sum())
        squares += float((weight * render**2).sum())
        photos += float((weight * item.reference.astype(np.float64) ** 2).sum())
    factor = both / squares if squares > 0 else 1.0
    left = photos - both * factor
    return (left / photos if photos > 0 else 0.0), factor
