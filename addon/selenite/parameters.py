# SPDX-License-Identifier: GPL-3.0-or-later
"""The native parameter table bound to Blender's sockets. There is no second list here."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, TypeVar

from . import native

if TYPE_CHECKING:
    from ._core import ParameterRow

T = TypeVar("T")
Values = tuple[float, ...]


@dataclass(frozen=True)
class Parameter:
    """One row of the native table; units and ranges are those of Blender's socket.

    `lower`, `upper`: what the renderer permits. `fit_lower`, `fit_upper`: default box constraint of
    a fit. `width`: 1, or 3 for a colour (linear Rec. 709). `versions`: of the Principled BSDF that
    have it, "v1" (Blender 3) and "v2".
    """

    owner: str
    name: str
    sockets: tuple[str, ...]
    unit: str
    width: int
    lower: float
    upper: float
    fit_lower: float
    fit_upper: float
    initial: float
    scale: str
    effect: str
    versions: tuple[str, ...]
    help: str

    @property
    def label(self) -> str:
        """In words, as in "Coat IOR"."""
        return " ".join("IOR" if word == "ior" else word.title() for word in self.name.split("_"))

    def find(self, node: Any) -> Any | None:  # a bpy node, and bpy is not imported here
        """The input of `node` that holds this parameter under any of its names, or None."""
        for name in self.sockets:
            if name in node.inputs:
                return node.inputs[name]
        return None

    def complaint(self, values: Sequence[float]) -> str:
        """Why `values` are no value of this parameter; empty if they are."""
        if len(values) != self.width:
            return f"takes {self.width} number{'s' * (self.width > 1)}, not {len(values)}"
        for value in values:
            if not math.isfinite(value):
                return f"{value} is not a finite number"
            if not self.lower <= value <= self.upper:
                return f"{value:.6g} lies outside [{self.lower:g}, {self.upper:g}]"
        return ""

    def broadcast(self, values: Sequence[float]) -> Values:
        """One number given for a colour means grey."""
        numbers = tuple(float(value) for value in values)
        return numbers * self.width if len(numbers) == 1 else numbers


@lru_cache(maxsize=1)
def table() -> dict[tuple[str, str], Parameter]:
    """(owner kind, name) -> Parameter, in the native order. Raises NativeUnavailable."""
    found = [row_of(row) for row in native.core().parameters()]
    return {(row.owner, row.name): row for row in found}


def row_of(row: ParameterRow) -> Parameter:
    """A row as the native module gives it."""
    known = Parameter.__dataclass_fields__
    fields: dict[str, object] = {key: value for key, value in row.items() if key in known}
    fields["sockets"] = tuple(row["sockets"])
    fields["versions"] = tuple(row["versions"])
    return Parameter(**fields)


def of(owner: str) -> list[Parameter]:
    """Parameters of one kind of owner: "material", "light" or "world"."""
    return [parameter for (kind, _), parameter in table().items() if kind == owner]


def plain(values: Sequence[T]) -> T | Sequence[T]:
    """For JSON: a number, or a list of one for each channel."""
    return values[0] if len(values) == 1 else list(values)


def split_name(text: str) -> tuple[str, str]:
    """ "Body:roughness" -> ("Body", "roughness"). The owner may contain colons.

    Raises ValueError when there is no owner or no parameter.
    """
    owner, colon, name = text.rpartition(":")
    if not (owner and colon and name):
        raise ValueError(f"'{text}' is not of the form OWNER:PARAMETER, as in Body:roughness")
    return owner, name


def join_name(owner: str, parameter: str) -> str:
    """("Body", "roughness") -> "Body:roughness"."""
    return f"{owner}:{parameter}"
