# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a photo shows the fitted objects: what its camera sees of their materials."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from .. import native
from ..scene_read.build import build
from ..scene_read.values import MaterialValues, SceneValues, WorldValues

if TYPE_CHECKING:
    from .._core import Frame, Scene

#: Samples of a pixel: one that has less than all of them on the objects is at their rim.
_SPP = 16


class Silhouettes:
    """Of the surfaces with one of `materials`; of all surfaces if the scene has none of them."""

    def __init__(self, values: SceneValues, materials: Collection[str]) -> None:
        self._values = values
        self._asked = frozenset(materials)
        self._scene: Scene | None = None

    def inside(self, camera: str, frame: Frame, size: tuple[int, int]) -> np.ndarray:
        """(h, w) bool: pixels that show nothing else. Size and errors as of `coverage`."""
        covered: np.ndarray = self.coverage(camera, frame, size) > 1 - 0.5 / _SPP
        return covered

    def coverage(self, camera: str, frame: Frame, size: tuple[int, int]) -> np.ndarray:
        """(h, w): the share of each pixel that shows them. size: (width, height). Raises ValueError
        for a scene that the native module refuses."""
        if self._scene is None:
            self._scene = build(self._glowing())
        photo = native.core().Photo(camera, size=size, frame=frame)
        film = native.core().Evaluator(self._scene, depth=1).picture(photo, _SPP)
        share: np.ndarray = film.image[..., 0]
        return share

    def _glowing(self) -> SceneValues:
        """The scene in the dark; its surfaces are black, but those of the materials shine."""
        names = {item.name for item in self._values.materials}
        shine = names & self._asked or names
        return replace(
            self._values,
            materials=[_glow(item, item.name in shine) for item in self._values.materials],
            lights=[],
            world=WorldValues(),
        )


def _glow(material: MaterialValues, shines: bool) -> MaterialValues:
    """Black, or of radiance 1; holes that alpha makes stay holes."""
    values = {name: value for name, value in material.values.items() if name == "alpha"}
    return replace(
        material,
        values={**values, "base_color": (0.0, 0.0, 0.0), "emission_strength": (float(shines),)},
        maps={name: found for name, found in material.maps.items() if name == "alpha"},
        grids={},
    )
