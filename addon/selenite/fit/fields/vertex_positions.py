# SPDX-License-Identifier: GPL-3.0-or-later
"""The vertices of an object's mesh as an unknown: its shape."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...capture.request import CaptureRequest
from ...messages import remark, thing
from ...parameters import Values
from ...paths import file_stems
from ...problems import BadInput, Problem
from ...scene_read.mesh_colors import object_of
from ...scene_read.values import ObjectValues, SceneValues
from ..field_kinds import KINDS
from ..request import UnknownRequest
from ..settings import FitSettings
from .base import FieldUnknown

if TYPE_CHECKING:
    from ..._core import Scene

#: The losses of single values weigh pixels by what they know; an outline is where they know least.
LOSS = "dual-buffer"


@dataclass(frozen=True, eq=False)
class VerticesUnknown(FieldUnknown):
    """`minimum`, `maximum`: where vertices may go, as ends of the bounding box of the start moved
    by so many of its sizes. `mesh`: its number in the scene. `start`: (n, 3) float32 in the
    object's own space. `triangles`: (m, 3)."""

    mesh: int
    start: np.ndarray
    triangles: np.ndarray
    CHANNELS = ("x", "y", "z")
    UNIT = "Blender unit"

    @property
    def values(self) -> np.ndarray:
        """(n, 3)."""
        return self.start

    def starting_at(self, values: np.ndarray) -> VerticesUnknown:
        """These vertices with another start."""
        return replace(self, start=values)

    def in_scene(self, scene: SceneValues) -> SceneValues:
        """The scene as it is: the native one takes the start, as its normals follow from it."""
        return scene

    def placed(self, scene: Scene, values: np.ndarray) -> Scene:
        """The native scene with other vertices."""
        return scene.with_vertices(self.owner, values)

    def stored(self, colour: Values) -> np.ndarray:
        """As it is."""
        return np.asarray(colour, np.float32)

    @property
    def files(self) -> list[str]:
        """The vertices, and the mesh with them."""
        return [f"{self.stem}_{self.kind.use}.npy", f"{self.stem}_{self.kind.use}.obj"]

    def write(self, folder: Path, values: np.ndarray, coverage: np.ndarray | None) -> None:
        """(n, 3) float32, and an OBJ file; both in the object's own space, Z up. Raises OSError."""
        np.save(folder / self.files[0], np.ascontiguousarray(values, np.float32))
        with (folder / self.files[1]).open("w", encoding="utf-8") as file:
            file.write(f"o {self.owner.splitlines()[0] if self.owner else 'Object'}\n")
            file.writelines(f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in values)
            file.writelines(f"f {a} {b} {c}\n" for a, b, c in self.triangles + 1)

    def about(self, values: np.ndarray, coverage: np.ndarray | None) -> dict[str, object]:
        """The number of vertices, how far they have gone, and the files."""
        way = np.linalg.norm(values - self.start, axis=1)
        return {
            "vertices": len(values),
            "mean_distance_moved": float(way.mean()),
            "largest_distance_moved": float(way.max()),
            "files": self.files,
        }


def vertices_unknown(
    scene: SceneValues, request: UnknownRequest, settings: FitSettings, title: str
) -> VerticesUnknown:
    """The vertices that a request asks for, with their start. Raises BadInput."""
    owner = object_of(scene, request.owner, title)
    _check_single(scene, owner, title)
    mesh = scene.meshes[owner.mesh]
    if not mesh.own_vertices:
        cause = "modifiers move its vertices or make others"
        raise BadInput(Problem(title, cause, "apply the modifiers, or switch them off in renders"))
    if request.start is not None:
        cure = "leave the start out, or start from the .npy file of a fit"
        raise BadInput(Problem(title, "it starts at the mesh, not at one value", cure))
    kind = KINDS[request.parameter]
    low = kind.bounds[0] if request.minimum is None else request.minimum
    high = kind.bounds[1] if request.maximum is None else request.maximum
    if not -100 <= low <= 0 <= high <= 100:  # noqa: PLR2004 - see the sentence
        cause = f"its bounds are [{low:g}, {high:g}]"
        cure = "give how far the bounding box grows, in its sizes, as in -0.5,0.5; at most 100"
        raise BadInput(Problem(title, cause, cure))
    usual = kind.rate
    if settings.learning_rate != FitSettings().learning_rate:
        usual = settings.learning_rate
    rate = usual if request.learning_rate is None else request.learning_rate
    if not 0 < rate <= 1:
        cure = "give a number above 0 and at most 1"
        raise BadInput(Problem(title, f"its learning rate is {rate}", cure))
    start = positions_of(request.grid, len(mesh.positions)) if request.grid else mesh.positions
    filled = replace(request, minimum=low, maximum=high, learning_rate=rate)
    stem = file_stems([item.name for item in scene.objects])[owner.name]
    return VerticesUnknown(
        owner.name, kind, low, high, rate, 1.0, filled, stem, owner.mesh,
        np.ascontiguousarray(start, np.float32), mesh.triangles,
    )  # fmt: skip


def positions_of(path: str, count: int) -> np.ndarray:
    """(count, 3) from a .npy file. Raises BadInput."""
    title = thing("File", path)
    cure = "give the .npy file of a fit of this mesh"
    try:
        found = np.load(path, allow_pickle=False)
    except (OSError, ValueError) as error:
        raise BadInput(Problem(title, f"cannot be read ({error})", cure)) from error
    if found.shape != (count, 3) or found.dtype.kind != "f" or not np.isfinite(found).all():
        cause = f"it holds no {count} finite positions of three numbers, as the mesh has"
        raise BadInput(Problem(title, cause, cure))
    return np.asarray(found, np.float32)


def with_loss(asked: FitSettings) -> FitSettings:
    """The settings of a stage that moves vertices: the usual loss gives way to one in which
    outlines count."""
    return replace(asked, loss=LOSS) if asked.loss == FitSettings().loss else asked


def remarks(
    fields: Sequence[FieldUnknown], settings: FitSettings, captures: Sequence[CaptureRequest]
) -> list[str]:
    """What differs from other fits while vertices move."""
    if not any(isinstance(item, VerticesUnknown) for item in fields):
        return []
    text = "its silhouette is that of the start, and hides where the shape should go; give a mask"
    cut = [
        remark(thing("Photo", item.photo), text) for item in captures if item.silhouette is not None
    ]
    by_loss = f"by the loss {LOSS}, " if with_loss(settings) != settings else ""
    return [
        remark(
            thing("Parameter", item.name),
            f"a shape is fitted {by_loss}with one path at a time and derivatives of direct light",
        )
        for item in fields
        if isinstance(item, VerticesUnknown)
    ] + cut


def _check_single(scene: SceneValues, owner: ObjectValues, title: str) -> None:
    """Raises BadInput where the mesh stands at several places."""
    users = [item for item in scene.objects if item.mesh == owner.mesh]
    if len(users) > 1:
        cause = f"its mesh is rendered {len(users)} times"
        cure = "make the mesh a single user, and instances real"
        raise BadInput(Problem(title, cause, cure))
