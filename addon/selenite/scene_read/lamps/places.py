# SPDX-License-Identifier: GPL-3.0-or-later
"""What a lamp's place and scale do to its light, and lamps that stand elsewhere. Arrays only; no
Blender here."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...problems import Problem
from ..values import LightValues

#: Why Cycles shows something else than a lamp's light where its axes are not at right angles.
_SHEARED_AREA = "Cycles samples its light as if its sides were at right angles"
_SHEARED_SPOT = "the light tree of Cycles leaves out a part of its cone"
#: Cosine between axes from which they count as sheared: some 0.06 degrees, far above rounding.
_SHEAR = 1e-3


def area_of(kind: str, shape: Mapping[str, float | bool | str], matrix: np.ndarray) -> float:
    """What Cycles multiplies the radiance by when the lamp is not normalised."""
    if kind == "SUN":
        return math.pi * math.sin(float(shape["angle"]) / 2) ** 2 or 1.0
    if kind == "AREA":
        scale = np.linalg.norm(matrix[:3, :2], axis=0)
        area = float(shape["size_x"]) * float(shape["size_y"]) * float(scale[0] * scale[1])
        return area * (math.pi / 4 if shape["shape"] in {"DISK", "ELLIPSE"} else 1.0)
    return 4 * (math.pi * float(shape["radius"]) ** 2 or 1.0)  # the whole sphere; measured


def flattened(matrix: np.ndarray) -> tuple[str, str] | None:
    """(cause, cure) of a matrix that leaves nothing of a lamp."""
    if np.linalg.det(matrix[:3, :3]) == 0 or not np.isfinite(matrix).all():
        return "its scale flattens it to nothing", "give it and its parents a scale other than 0"
    return None


def trouble_of(kind: str, light_units: str, matrix: np.ndarray) -> tuple[str, str] | None:
    """(cause, cure) where a lamp cannot stand so."""
    if nothing := flattened(matrix):
        return nothing
    sheared = {"AREA": _SHEARED_AREA} | ({"SPOT": _SHEARED_SPOT} if light_units != "v3" else {})
    if kind in sheared and _is_sheared(matrix):
        cause = f"its parent shears it, and {sheared[kind]}"
        cure = "give its parents an even scale (Object > Apply > Scale), or clear its parent"
        return cause, cure
    return None


def moved(light: LightValues, matrix: np.ndarray) -> LightValues:
    """The lamp at another place: its power is fixed, or without normalisation its radiance."""
    scale = light.radiance_scale
    if not light.normalized:
        before, now = (area_of(light.kind, light.shape, m) for m in (light.matrix, matrix))
        scale *= now / before
    return replace(light, matrix=matrix, radiance_scale=scale)


def placed(light: LightValues, numbers: Sequence[float]) -> np.ndarray:
    """(4, 4) of a lamp at a place (3 numbers), with a quaternion w, x, y, z (7), or with a matrix
    (16): what is not given is that of the lamp."""
    if len(numbers) == 16:
        return np.array(numbers, np.float64).reshape(4, 4)
    matrix = np.array(light.matrix, np.float64)
    matrix[:3, 3] = numbers[:3]
    if len(numbers) == 7:
        matrix[:3, :3] = _rotation(numbers[3:]) * np.linalg.norm(matrix[:3, :3], axis=0)
    return matrix


def at_place(name: str, lights: Sequence[LightValues]) -> list[LightValues]:
    """The lamps that a name stands for: of the object, else of the lamp at all of its places."""
    by_object = [light for light in lights if (light.object or light.name) == name]
    return by_object or [light for light in lights if light.name == name]


def names_of(lights: Sequence[LightValues]) -> list[str]:
    """What lamps are called: their objects, each once."""
    return list(dict.fromkeys(light.object or light.name for light in lights))


def problem_of_place(who: str, light: LightValues, numbers: Sequence[float]) -> Problem | None:
    """Why a lamp of one place cannot stand there. `who`: begins the title."""
    title = f"{who}: lamp '{light.object or light.name}'"
    if light.kind == "SUN" and len(numbers) == 3:
        cause = "it is a sun, of which a place says nothing"
        return Problem(title, cause, "give a rotation too, or a matrix")
    trouble = trouble_of(light.kind, light.light_units, placed(light, numbers))
    return None if trouble is None else Problem(title, *trouble)


def _rotation(quaternion: Sequence[float]) -> np.ndarray:
    """(3, 3) of (w, x, y, z), of any length but 0."""
    w, x, y, z = np.array(quaternion, np.float64) / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _is_sheared(matrix: np.ndarray) -> bool:
    """Whether the axes of a lamp are not at right angles."""
    axes = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
    return bool(np.abs(axes.T @ axes - np.eye(3)).max() > _SHEAR)
