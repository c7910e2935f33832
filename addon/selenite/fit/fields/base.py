# SPDX-License-Identifier: GPL-3.0-or-later
"""What every unknown with a value at each place has: grids, images, colours of meshes."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ... import native, parameters
from ...messages import control
from ...parameters import Values
from ...paths import why_not_file
from ...problems import BadInput, Problem, choice
from ...scene_read.values import Owner, SceneValues
from ..field_kinds import FieldKind
from ..request import UnknownRequest
from ..settings import FitSettings
from ..unknowns import of_object

if TYPE_CHECKING:
    from ..._core import Scene, Unknown

#: Cures of a field with two starts, and of one without texels that no photo sees.
ONE_START = control("one-start", "give --start or a file")
NO_UNSEEN = control("no-unseen", "leave --unseen out")


@dataclass(frozen=True, eq=False)
class FieldUnknown(ABC):
    """A grid or an image of the fit. The bounds hold for each number. `scale`: the usual value, in
    which the learning rate counts."""

    owner: str
    kind: FieldKind
    minimum: float
    maximum: float
    learning_rate: float
    scale: float
    request: UnknownRequest
    #: Of its files' names; see `paths.file_stems`.
    stem: str
    #: What the three numbers of a place are called, and their unit.
    CHANNELS: ClassVar[tuple[str, ...]] = ("red", "green", "blue")
    UNIT: ClassVar[str] = "1"

    @property
    def name(self) -> str:
        """As in `Body:albedo_grid`."""
        return parameters.join_name(self.owner, self.kind.parameter)

    def native(self) -> Unknown:
        """What the native Fit takes; the start is the scene's."""
        return native.core().Unknown(
            self.owner, self.kind.parameter, self.minimum, self.maximum,
            learning_rate=self.learning_rate * self.scale,
        )  # fmt: skip

    @property
    @abstractmethod
    def values(self) -> np.ndarray:
        """Of the start, float32, the channels last."""

    @abstractmethod
    def starting_at(self, values: np.ndarray) -> FieldUnknown:
        """This field with another start."""

    @abstractmethod
    def in_scene(self, scene: SceneValues) -> SceneValues:
        """The scene with the start in it."""

    @abstractmethod
    def placed(self, scene: Scene, values: np.ndarray) -> Scene:
        """The native scene, which has the field, with other values in it."""

    @abstractmethod
    def stored(self, colour: Values) -> np.ndarray:
        """A linear colour (1 or 3 numbers) in the numbers of the field."""

    def mean(self, values: np.ndarray) -> Values:
        """Over all places, channel by channel, of an image in linear light."""
        return means(values)

    def filled(self, colour: Values) -> np.ndarray:
        """One colour at all places, inside the bounds."""
        shape = self.values.shape
        numbers = self.stored(colour if shape[-1] == len(colour) else (float(np.mean(colour)),))
        bounded = np.clip(numbers, np.float32(self.minimum), np.float32(self.maximum))
        return np.broadcast_to(bounded, shape).astype(np.float32)

    @property
    @abstractmethod
    def files(self) -> list[str]:
        """Names of its files in a result folder."""

    @abstractmethod
    def write(self, folder: Path, values: np.ndarray, coverage: np.ndarray | None) -> None:
        """Writes them. coverage: of a surface, see `seen.coverage`. Raises OSError."""

    @abstractmethod
    def about(self, values: np.ndarray, coverage: np.ndarray | None) -> dict[str, object]:
        """What result.json says of its size and files."""


def means(values: np.ndarray) -> Values:
    """Over all places, channel by channel."""
    found = values.reshape(-1, values.shape[-1]).mean(axis=0, dtype=np.float64)
    return tuple(float(x) for x in found)


def material_of(scene: SceneValues, request: UnknownRequest, title: str) -> Owner:
    """The material that a request is about. Raises BadInput."""
    owner = scene.owners.get(request.owner)
    if owner is None or owner.kind != "material":
        names = [item.name for item in scene.owners.values() if item.kind == "material"]
        cause = f"no material of the scene is called '{request.owner}'"
        cure = of_object(scene, request.owner) or choice(request.owner, names)
        raise BadInput(Problem(title, cause, cure))
    return owner


def rate_of(request: UnknownRequest, settings: FitSettings, title: str) -> float:
    """The learning rate of a request. Raises BadInput."""
    rate = settings.learning_rate if request.learning_rate is None else request.learning_rate
    if not (math.isfinite(rate) and 0 < rate <= 1):
        cure = "give a number above 0 and at most 1"
        raise BadInput(Problem(title, f"its learning rate is {rate}", cure))
    return rate


def share_bounds(request: UnknownRequest, title: str) -> tuple[float, float]:
    """Bounds of numbers in [0, 1]. Raises BadInput."""
    low = 0.0 if request.minimum is None else request.minimum
    high = 1.0 if request.maximum is None else request.maximum
    if not 0 <= low < high <= 1:
        cause = f"its bounds [{low:g}, {high:g}] are not an interval inside [0, 1]"
        raise BadInput(Problem(title, cause, "give bounds inside [0, 1]"))
    return low, high


def is_share(fill: Values) -> bool:
    """Whether these are 1 or 3 numbers in [0, 1]."""
    return len(fill) in (1, 3) and all(math.isfinite(x) and 0 <= x <= 1 for x in fill)


def whole_number(text: str, usual: int) -> int:
    """What the decimal digits of a request say; one of many digits is more than any limit."""
    if not text:
        return usual
    return int(text) if len(text) < 10 else 10**9


def picture_of(path: str, title: str) -> tuple[np.ndarray, bool]:
    """An image file at which a field starts: (h, w, 3) float32, linear, and whether the file holds
    floats; else it is sRGB. Raises BadInput."""
    cure = "give a PNG, JPEG, TIFF, HDR or EXR file"
    if why := why_not_file(path):
        raise BadInput(Problem(title, f"image '{path}' cannot be read ({why})", cure))
    try:
        pixels, _, about = native.image().read(path)
    except (OSError, ValueError, MemoryError) as error:
        cause = f"image '{path}' cannot be read ({error or 'memory does not suffice'})"
        raise BadInput(Problem(title, cause, cure)) from error
    return pixels, bool(about["float"])
