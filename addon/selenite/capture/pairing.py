# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos that show what another camera sees: small renders of all cameras, compared with each photo
before a fit takes minutes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from .. import native
from ..problems import Problem, listed
from .prepared import Capture
from .views import blurred

if TYPE_CHECKING:
    from .._core import Scene

#: Height of the pictures that are compared, samples of a render, and photos up to which all are.
HEIGHT, MOST = 64, 24
_SPP, _DEPTH = 16, 4
#: Correlation below which a photo is unlike its own camera's render, and by how much it is more
#: like another one's.
_UNLIKE, _BETTER = 0.6, 0.2
#: Pixels over which brightness is levelled out: light and exposure change slowly.
_LEVEL = 8
#: Of the mean brightness: what is darker is alike.
_FLOOR = 0.05
#: The kind of its Problem.
KIND = "pairing"


@dataclass(frozen=True)
class Pairing:
    """camera: photo's id -> the camera whose render it resembles, of those that are paired wrong.
    correlation: photos by cameras, each -1 to 1."""

    camera: Mapping[str, str]
    correlation: np.ndarray

    def problems(self, captures: Sequence[Capture]) -> list[Problem]:
        """One for all of them."""
        if not self.camera:
            return []
        wrong = [item for item in captures if item.id in self.camera]
        resembles = "; ".join(f"'{item.id}' like camera '{self.camera[item.id]}'" for item in wrong)
        title = f"Photos {listed(item.id for item in wrong)}"
        cause = f"they seem to be paired with wrong cameras ({resembles})"
        return [Problem(title, cause, "give each photo its camera", KIND)]


def paired(
    captures: Sequence[Capture],
    cameras: Sequence[str],
    scene: Scene,
    go_on: Callable[[], None] = lambda: None,
) -> Pairing:
    """captures: of HEIGHT. cameras: all of the scene. go_on: called before each render; raises."""
    own = {item.camera: item for item in captures}
    correlation = np.full((len(captures), len(cameras)), -1.0)
    for column, camera in enumerate(cameras):
        seen: dict[tuple[object, ...], np.ndarray] = {}
        for row, capture in enumerate(captures):
            key = (capture.reference.shape, capture.frame)
            if key not in seen:
                go_on()
                lights = own.get(camera, capture).lights
                there = replace(capture, camera=camera, lights=lights)
                seen[key] = _levelled(_rendered(scene, there))
            photo = _levelled(capture.reference)
            correlation[row, column] = _correlation(photo, seen[key], capture.weight)
    return Pairing(
        _better([item.id for item in captures], captures, cameras, correlation), correlation
    )


def _rendered(scene: Scene, capture: Capture) -> np.ndarray:
    """What the capture's camera shows, (h, w, 3)."""
    evaluator = native.core().Evaluator(scene, depth=_DEPTH)
    return evaluator.picture(capture.view(), _SPP).image


def _better(
    ids: Sequence[str],
    captures: Sequence[Capture],
    cameras: Sequence[str],
    correlation: np.ndarray,
) -> dict[str, str]:
    """Photos that are clearly more like another camera, one that no rightly paired photo has."""
    found = {}
    for row, capture in enumerate(captures):
        own = correlation[row, cameras.index(capture.camera)]
        best = int(correlation[row].argmax())
        if own < _UNLIKE and correlation[row, best] > own + _BETTER:
            found[ids[row]] = cameras[best]
    if len(set(found.values())) < len(found):
        return {}  # two photos cannot be of the same place
    taken = {item.camera for item in captures if item.id not in found}
    return {} if taken & set(found.values()) else found


def _levelled(picture: np.ndarray) -> np.ndarray:
    """(h, w): the logarithm of brightness, less its mean around each pixel."""
    grey = np.asarray(picture, float).mean(axis=-1)
    logarithm = np.log(np.maximum(grey, 0.0) + _FLOOR * max(float(grey.mean()), 1e-9))
    return blurred(logarithm) - blurred(logarithm, _LEVEL)


def _correlation(first: np.ndarray, second: np.ndarray, weight: np.ndarray) -> float:
    counts = weight > 0
    if counts.sum() < 2:
        return -1.0
    a, b = (picture[counts] - picture[counts].mean() for picture in (first, second))
    size = float(np.sqrt((a**2).sum() * (b**2).sum()))
    return float((a * b).sum()) / size if size > 0 else 0.0
