# SPDX-License-Identifier: GPL-3.0-or-later
"""The colour attribute of an object's mesh as an unknown."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...parameters import Values
from ...paths import file_stems
from ...problems import BadInput, Problem
from ...scene_read.mesh_colors import color_map, new_colors, object_of, shown_colors
from ...scene_read.values import SceneValues
from ..field_kinds import NEW, field_kind
from ..request import UnknownRequest
from ..settings import FitSettings
from .base import ONE_START, rate_of, share_bounds
from .images import fill_of
from .seen import SurfaceUnknown, unseen_of

if TYPE_CHECKING:
    from ..._core import Scene


@dataclass(frozen=True, eq=False)
class VertexColorsUnknown(SurfaceUnknown):
    """`mesh`: its number in the scene. `attribute`: its name. `start`: (n, 3) float32, linear, one
    for each vertex or corner. `elements`: (3m,) which of them a corner of a triangle shows.
    `materials`: whose base colour is to show a new attribute."""

    mesh: int
    attribute: str
    start: np.ndarray
    elements: np.ndarray
    materials: tuple[str, ...] = ()

    @property
    def values(self) -> np.ndarray:
        """(n, 3)."""
        return self.start

    def starting_at(self, values: np.ndarray) -> VertexColorsUnknown:
        """These colours with another start."""
        return replace(self, start=values)

    def in_scene(self, scene: SceneValues) -> SceneValues:
        """The scene with the start in it."""
        mesh = scene.meshes[self.mesh]
        shown = np.take(self.start, self.elements, axis=0)
        own = self.attribute
        entry, stored = (own, shown), (own, self.start, self.elements)
        colors = tuple(entry if item[0] == own else item for item in mesh.colors)
        of_fit = tuple(stored if item[0] == own else item for item in mesh.stored_colors)
        if own not in {name for name, _ in mesh.colors}:
            colors, of_fit = (*colors, entry), (*of_fit, stored)
        mesh = replace(mesh, colors=colors, stored_colors=of_fit)
        meshes = [mesh if i == self.mesh else item for i, item in enumerate(scene.meshes)]
        materials = [
            replace(item, maps=item.maps | {"base_color": color_map(own)})
            if item.name in self.materials
            else item
            for item in scene.materials
        ]
        return replace(scene, meshes=meshes, materials=materials)

    def placed(self, scene: Scene, values: np.ndarray) -> Scene:
        """The native scene, which has the attribute, with other colours in it."""
        return scene.with_vertex_colors(self.owner, values)

    def stored(self, colour: Values) -> np.ndarray:
        """As it is."""
        return np.asarray(colour, np.float32)

    def completed(self, values: np.ndarray, known: np.ndarray) -> np.ndarray:
        """Filled from neighbours, ring by ring."""
        return spread_over(values, known, self.elements)

    @property
    def files(self) -> list[str]:
        """The colours."""
        return [f"{self.stem}_{self.kind.use}.npy"]

    def write(self, folder: Path, values: np.ndarray, coverage: np.ndarray | None) -> None:
        """(n, 3) float32, linear. Raises OSError."""
        np.save(folder / self.files[0], np.ascontiguousarray(values, np.float32))

    def about(self, values: np.ndarray, coverage: np.ndarray | None) -> dict[str, object]:
        """The attribute, the number of its values, the share that the photos see, and the file."""
        return {
            "attribute": self.attribute,
            "values": len(values),
            **self.share_seen(coverage),
            "files": self.files,
        }


def spread_over(values: np.ndarray, known: np.ndarray, elements: np.ndarray) -> np.ndarray:
    """(n, 3) with those that are not known (n,) filled with the mean of their neighbours, the
    nearest to what is known first. Neighbours: the corners of one triangle, by `elements` (3m,)."""
    corners = elements.reshape(-1, 3)
    pairs = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    pairs = np.unique(np.concatenate([pairs, pairs[:, ::-1]]), axis=0)
    filled, reached = values.astype(np.float64), known.copy()
    while True:
        ready = pairs[reached[pairs[:, 1]] & ~reached[pairs[:, 0]]]
        if not len(ready):
            return filled.astype(np.float32)
        sums, counts = np.zeros_like(filled), np.zeros(len(filled))
        np.add.at(sums, ready[:, 0], filled[ready[:, 1]])
        np.add.at(counts, ready[:, 0], 1)
        new = counts > 0
        filled[new] = sums[new] / counts[new, None]
        reached |= new


def vertex_colors_unknown(
    scene: SceneValues, request: UnknownRequest, settings: FitSettings, title: str
) -> VertexColorsUnknown:
    """The colours that a request asks for, with their start. Raises BadInput."""
    owner = object_of(scene, request.owner, title)
    low, high = share_bounds(request, title)
    rate = rate_of(request, settings, title)
    materials: tuple[str, ...] = ()
    if request.grid == NEW:
        new = new_colors(scene, owner, title)
        name, stored, elements, materials = new.attribute, new.values, new.elements, new.materials
    else:
        name, stored, elements = shown_colors(scene, owner, title)
    own = np.clip(stored, np.float32(low), np.float32(high))
    if request.grid not in ("", NEW):
        cause = f"it starts at the colour attribute '{name}', not at '{request.grid}'"
        raise BadInput(Problem(title, cause, ONE_START))
    fill = fill_of(request, title)
    if fill is not None:
        own = np.broadcast_to(np.clip(np.asarray(fill, np.float32), low, high), stored.shape)
    filled = replace(
        request,
        minimum=low,
        maximum=high,
        learning_rate=rate,
        unseen=unseen_of(request, fill is None, title),
    )
    stem = file_stems([item.name for item in scene.objects])[owner.name]
    return VertexColorsUnknown(
        owner.name, field_kind(request.parameter), low, high, rate, 1.0, filled, stem,
        filled.unseen, owner.mesh, name, np.ascontiguousarray(own, np.float32), elements,
        materials,
    )  # fmt: skip
