# SPDX-License-Identifier: GPL-3.0-or-later
"""What the readers of meshes have in common: faces as triangles, indices, normals and colours."""

from __future__ import annotations

import numpy as np

from .files import Place


def fans(starts: np.ndarray, lengths: np.ndarray, place: Place) -> tuple[np.ndarray, np.ndarray]:
    """Faces as triangles around their first corners: (triangles, 3) places in the list of corners,
    and the face of each. starts, lengths: of each face in that list; a length of 0 is no face.
    Raises ReconstructionError."""
    if (bad := lengths[(lengths == 1) | (lengths == 2)]).size:
        raise place.error(f"a face has {bad[0]} corners; it needs 3")
    count = np.maximum(lengths - 2, 0)
    face = np.repeat(np.arange(len(starts)), count)
    step = np.arange(len(face)) - np.repeat(np.cumsum(count) - count, count)
    first = starts[face]
    return np.stack([first, first + step + 1, first + step + 2], axis=-1).astype(np.int64), face


def in_range(index: np.ndarray, count: int, place: Place) -> None:
    """Raises ReconstructionError for an index that has none of `count` entries."""
    if index.size and not (index.min() >= 0 and index.max() < count):
        bad = index[(index < 0) | (index >= count)].flat[0]
        raise place.error(f"index {bad} is outside of the {count} entries")


def of_unit_length(normals: np.ndarray) -> np.ndarray | None:
    """The same directions; None where one of them has no length."""
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    return normals / length if (length > 0).all() else None


def linear_of_srgb(encoded: np.ndarray, place: Place) -> np.ndarray:
    """Linear light of colours from 0 to 1. Raises ReconstructionError for others."""
    if (bad := encoded[~((encoded >= 0) & (encoded <= 1))]).size:
        raise place.error(f"{bad[0]:g} is not from 0 to 1")
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
