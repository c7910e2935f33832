# SPDX-License-Identifier: GPL-3.0-or-later
"""Pointiness of a mesh: how sharp its edges are at each vertex, as Cycles computes it."""

from __future__ import annotations

import bpy
import numpy as np

from .. import hosts


def of(mesh: bpy.types.Mesh) -> np.ndarray:
    """(vertices,): 0.5 where the mesh is flat, more where it is convex. It is the angle between the
    normal and the mean direction of the edges, over pi, averaged with the neighbours."""
    positions = hosts.floats(mesh.vertices, "co", 3).astype(np.float64)
    normals = hosts.floats(mesh.vertices, "normal", 3).astype(np.float64)
    # Vertices at one place are one.
    places, which = np.unique(positions, axis=0, return_inverse=True)
    which = which.reshape(-1)
    count = len(places)
    normal = np.zeros((count, 3))
    np.add.at(normal, which, normals)
    normal = _unit(normal)
    edges = np.sort(which[hosts.whole_numbers(mesh.edges, "vertices", 2).reshape(-1, 2)], axis=1)
    edges = np.unique(edges[edges[:, 0] != edges[:, 1]], axis=0)
    first, second = edges[:, 0], edges[:, 1]
    along = _unit(places[second] - places[first])
    mean = np.zeros((count, 3))
    np.add.at(mean, first, along)
    np.add.at(mean, second, -along)
    number = np.bincount(edges.reshape(-1), minlength=count)
    cosine = np.einsum("ij,ij->i", normal, mean) / np.maximum(number, 1)
    raw = np.where(number > 0, np.arccos(np.clip(cosine, -1, 1)) / np.pi, 0.0)
    blurred = raw.copy()
    np.add.at(blurred, first, raw[second])
    np.add.at(blurred, second, raw[first])
    return np.asarray((blurred / (number + 1))[which], np.float32)


def _unit(vectors: np.ndarray) -> np.ndarray:
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(size > 0, size, 1)
