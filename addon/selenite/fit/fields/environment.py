# SPDX-License-Identifier: GPL-3.0-or-later
"""The image of the world as an unknown: light from each direction."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ... import native
from ...capture.prepared import Capture
from ...environments import mirror_ball, sphere
from ...parameters import Values
from ...paths import file_stems
from ...problems import BadInput, Problem, listed
from ...scene_read.values import Owner, SceneValues, WorldValues
from ..field_kinds import field_kind
from ..request import UnknownRequest
from ..settings import FitSettings
from ..unknowns import Unknown
from .base import FieldUnknown, picture_of, rate_of, whole_number

if TYPE_CHECKING:
    from ..._core import Scene

#: Texels where the request names none, and the fewest and most.
USUAL_SIZE, LEAST_SIZE, MOST_SIZE = 512, 8, 2048
PROJECTIONS = ("equirect", "mirror_ball")
#: Largest radiance by default, and that at which a black world starts.
_MOST_RADIANCE, _GREY = 1e4, 0.05
#: Rows of the picture that shows the image to people; each texel is a square of it.
_VIEW_ROWS = 128
#: Samples of a pixel that tell the coverage, and the share of its mean over the sphere below which
#: a texel counts as not seen (docs/measurements/fields.md).
_COVERAGE_SPP, _HARDLY_SEEN = 4, 0.01
#: Share of its texels that are at most half as bright as white in that picture.
_SHOWN = 0.9
_NAME = "World"  # of its owner, as the native module calls it


@dataclass(frozen=True, eq=False)
class EnvironmentUnknown(FieldUnknown):
    """Radiance over the strength of the world. `start`: (h, w, 3) float32, linear, row 0 at the
    top, in the frame of the world. `notes`: what a user should know of the start."""

    start: np.ndarray
    notes: tuple[str, ...] = ()

    @property
    def values(self) -> np.ndarray:
        """(h, w, 3), row 0 at the top."""
        return self.start

    def starting_at(self, values: np.ndarray) -> EnvironmentUnknown:
        """This image with another start."""
        return replace(self, start=values)

    def in_scene(self, scene: SceneValues) -> SceneValues:
        """The scene with the start in it, which no colour tints and no Mapping turns."""
        white = (1.0, 1.0, 1.0)
        world = replace(scene.world, color=white, image=self.start, to_map=np.eye(3), rotation=0.0)
        return replace(scene, world=world)

    def placed(self, scene: Scene, values: np.ndarray) -> Scene:
        """The native scene, which has the image, with another one in it."""
        return scene.with_environment(values)

    def stored(self, colour: Values) -> np.ndarray:
        """As it is: the image is linear."""
        return np.asarray(colour, np.float32)

    def mean(self, values: np.ndarray) -> Values:
        """Over the sphere."""
        return sphere.mean(values)

    @property
    def files(self) -> list[str]:
        """The image, and a picture to look at."""
        return [f"{self.stem}_environment.exr", f"{self.stem}_environment.png"]

    def write(self, folder: Path, values: np.ndarray, coverage: np.ndarray | None) -> None:
        """Both files. Raises OSError."""
        image, view = (str(folder / name) for name in self.files)
        native.image().write_exr(image, np.ascontiguousarray(values, np.float32))
        native.image().write_png(view, view_of(values))

    def about(self, values: np.ndarray, coverage: np.ndarray | None) -> dict[str, object]:
        """Texels across and down, the share of them that photos see, and the files."""
        share = {} if coverage is None else {"seen": float(seen(coverage).mean())}
        return {"texels": [int(n) for n in values.shape[1::-1]], **share, "files": self.files}


def view_of(values: np.ndarray) -> np.ndarray:
    """(h, w, 3) linear, of at least `_VIEW_ROWS` rows: the image as bright as a picture can show it
    but for its brightest lights. values: of an EnvironmentUnknown."""
    brightness = values.mean(axis=-1)
    most = 2 * float(np.quantile(brightness, _SHOWN)) or float(brightness.max())
    scaled = values / most if most > 0 else values
    times = max(1, _VIEW_ROWS // values.shape[0])
    shown = np.clip(scaled, 0, 1).repeat(times, axis=0).repeat(times, axis=1)
    return np.ascontiguousarray(shown, np.float32)


def coverage(field: EnvironmentUnknown, scene: Scene, captures: Sequence[Capture]) -> np.ndarray:
    """(h, w): what all photos, pixels weighted as they count, change by with a texel, over its
    share of the sphere. scene: native, with the image."""
    total = np.zeros(field.values.shape[:2])
    evaluator = native.core().Evaluator(scene)
    for item in captures:
        if item.lights["world"]:
            _, texels = evaluator.gradient(
                item.native(), field.owner, field.kind.parameter, _COVERAGE_SPP
            )
            total += texels.mean(axis=2)
    return total / sphere.solid_angles(*total.shape)[:, None]


def seen(found: np.ndarray) -> np.ndarray:
    """(h, w) bool: the texels that photos tell something of."""
    angles = sphere.solid_angles(*found.shape)[:, None]
    return found > _HARDLY_SEEN * float((angles * found).sum() / (4 * np.pi))


def fitted_environment(
    fields: Sequence[FieldUnknown], arrays: Mapping[str, np.ndarray]
) -> np.ndarray | None:
    """The fitted image of the world; None where it is not among `fields`."""
    found = (arrays[item.name] for item in fields if isinstance(item, EnvironmentUnknown))
    return next(found, None)


def usual_maximum(world: WorldValues) -> float:
    """The largest value of a texel by default, in radiance over the strength."""
    return _MOST_RADIANCE / world.strength if world.strength > 0 else _MOST_RADIANCE


def own_name(scene: SceneValues, name: str) -> str:
    """Of a world that is called by its datablock's name."""
    owner = scene.owners.get(_NAME)
    return _NAME if owner is not None and name == owner.datablock else name


def environment_unknown(
    scene: SceneValues,
    request: UnknownRequest,
    others: Sequence[Unknown],
    settings: FitSettings,
    title: str,
) -> EnvironmentUnknown:
    """The image that a request asks for, with its start. Raises BadInput."""
    owner = _world_of(scene, request, title)
    strength = scene.world.strength
    if request.unseen:
        cause = "texels of the world that no photo sees always continue the others"
        raise BadInput(Problem(title, cause, "leave --unseen out"))
    if any((item.owner, item.parameter.name) == (_NAME, "strength") for item in others):
        cause = "World:strength, which is fitted too, multiplies it: only their product is seen"
        raise BadInput(Problem(title, cause, "fit World:environment alone"))
    if any((item.owner, item.parameter.name) == (_NAME, "rotation") for item in others):
        cause = "World:rotation, which is fitted too, rotates another image, which it replaces"
        raise BadInput(Problem(title, cause, "fit one of the two"))
    if not strength > 0:
        cause = f"the strength of world '{owner.datablock}' is {strength:g}, which makes it black"
        raise BadInput(Problem(title, cause, "set its Strength to 1"))
    start, notes = _start(scene.world, request, title)
    if not start.any():
        start = np.full_like(start, _GREY / strength)
        notes += (f"the world is black, and starts at a grey of radiance {_GREY:g}",)
    low, high = _bounds(request, max(usual_maximum(scene.world), 10 * float(start.max())), title)
    rate = rate_of(request, settings, title)
    clamped = np.clip(start, np.float32(low), np.float32(high))
    filled = replace(
        request,
        owner=owner.name,
        minimum=low,
        maximum=high,
        learning_rate=rate,
        size=int(start.shape[0] * start.shape[1]),
        grid="" if request.grid.isdecimal() else request.grid,
    )
    return EnvironmentUnknown(
        owner.name, field_kind(request.parameter), low, high, rate,
        float(np.mean(sphere.mean(clamped))),
        filled, file_stems(scene.owners)[owner.name], clamped, notes,
    )  # fmt: skip


def _world_of(scene: SceneValues, request: UnknownRequest, title: str) -> Owner:
    owner = scene.owners.get(_NAME)
    if owner is None or owner.kind != "world":
        cure = "add one in World Properties, with a Background node"
        raise BadInput(Problem(title, "the scene has no world", cure))
    if request.owner != owner.name:
        cause = f"'{request.owner}' is not the world"
        raise BadInput(Problem(title, cause, f"call it {_NAME}:environment"))
    if reason := owner.fixed.get(field_kind(request.parameter).parameter):
        cause, _, cure = reason.partition(": ")
        raise BadInput(Problem(title, cause, cure or "give the world a Background node"))
    return owner


def _bounds(request: UnknownRequest, most: float, title: str) -> tuple[float, float]:
    low = 0.0 if request.minimum is None else request.minimum
    high = most if request.maximum is None else request.maximum
    largest = float(np.finfo(np.float32).max)
    if not 0 <= low < high <= largest:
        cause = f"its bounds [{low:g}, {high:g}] are not an interval of radiance"
        raise BadInput(Problem(title, cause, f"give bounds inside [0, {largest:g}]"))
    return low, high


def _size(request: UnknownRequest, title: str) -> tuple[int, int] | None:
    """(rows, columns) that are asked for; None: not said."""
    number = whole_number(request.grid, 0) if request.grid.isdecimal() else None
    if number is not None and request.size not in (None, number):
        cause = f"it has two sizes, {number} and {request.size}"
        raise BadInput(Problem(title, cause, "give one"))
    number = request.size if number is None else number
    if number is None:
        return None
    if not LEAST_SIZE <= number <= MOST_SIZE:
        cause = f"its size is {number} texels"
        raise BadInput(Problem(title, cause, f"give {LEAST_SIZE} to {MOST_SIZE}"))
    return sphere.grid_of(number)


def _start(
    world: WorldValues, request: UnknownRequest, title: str
) -> tuple[np.ndarray, tuple[str, ...]]:
    """(h, w, 3) from a file, from the scene's image, or one colour; and what is to be told."""
    size = _size(request, title)
    rows, columns = size or sphere.grid_of(USUAL_SIZE)
    file = request.grid if request.grid and not request.grid.isdecimal() else ""
    if request.projection and not file:
        cause = f"the projection {request.projection} is of a file, and none is given"
        raise BadInput(Problem(title, cause, "add --environment FILE, or leave it out"))
    if file and request.start is not None:
        raise BadInput(Problem(title, "it has two starts", "give --start or a file"))
    if request.start is not None:
        if len(request.start) not in (1, 3) or not all(
            math.isfinite(x) and x >= 0 for x in request.start
        ):
            cause = f"its start is {', '.join(f'{x:g}' for x in request.start)}"
            raise BadInput(Problem(title, cause, "give 1 or 3 numbers from 0 up"))
        return np.broadcast_to(np.array(request.start, np.float32), (rows, columns, 3)).copy(), ()
    if file:
        return _from_file(file, request.projection, size, title)
    if world.image is not None:
        brightest = float(world.image.max())
        # A code value of 1 that many pixels share is where a picture of few bits ends.
        note = _clipped("its start, the image of the world,", world.image) if brightest <= 1 else ()
        return _sized(world.image, world.to_map, size), note
    return np.broadcast_to(np.array(world.color, np.float32), (rows, columns, 3)).copy(), ()


def _sized(image: np.ndarray, to_map: np.ndarray, size: tuple[int, int] | None) -> np.ndarray:
    """An image as it is where no size is asked for and it is small enough, or has the size."""
    rows, columns = image.shape[:2]
    plain = np.allclose(to_map, np.eye(3), rtol=0, atol=1e-6)
    fits = size is None and columns == 2 * rows and LEAST_SIZE <= rows * columns <= MOST_SIZE
    positive = np.maximum(image, 0)
    if plain and (fits or size == (rows, columns)):
        return positive.astype(np.float32)
    return sphere.resampled(positive, to_map, *(size or sphere.grid_of(USUAL_SIZE)))


def _clipped(what: str, image: np.ndarray) -> tuple[str, ...]:
    """That lights are missing in a picture of 8 or 16 bits; nothing where no pixel is white."""
    share = float((image.max(axis=-1) >= 1 - 1e-3).mean())
    if share == 0:
        return ()
    return (
        f"{what} is clipped in {100 * share:.2g} % of its pixels: lamps and windows are brighter "
        "than it holds; the fit can brighten them, an HDR or EXR file holds them",
    )


def _from_file(
    path: str, projection: str, size: tuple[int, int] | None, title: str
) -> tuple[np.ndarray, tuple[str, ...]]:
    if projection not in ("", *PROJECTIONS):
        cause = f"its projection is '{projection}'"
        raise BadInput(Problem(title, cause, f"give {listed(PROJECTIONS)}"))
    pixels, floats = picture_of(path, title)
    title = f"{title}, image '{path}'"
    if not np.isfinite(pixels).all():
        raise BadInput(Problem(title, "it holds infinite pixels", "repair the file"))
    notes = () if floats else _clipped(f"its start '{Path(path).name}'", pixels)
    if projection == "mirror_ball":
        if why := mirror_ball.why_not(pixels):
            raise BadInput(Problem(title, why, "crop the photo to a square around the ball"))
        pixels = mirror_ball.equirectangular(pixels)
    elif pixels.shape[1] != 2 * pixels.shape[0]:
        cause = f"its {pixels.shape[1]} x {pixels.shape[0]} pixels are not twice as wide as high"
        cure = "give a whole panorama, or --environment-projection mirror_ball for a ball"
        raise BadInput(Problem(title, cause, cure))
    return _sized(pixels, np.eye(3), size), notes
