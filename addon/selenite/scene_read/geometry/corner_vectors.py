# SPDX-License-Identifier: GPL-3.0-or-later
"""What shaders ask for at the corners of a mesh and only Blender knows."""

from __future__ import annotations

import bpy
import numpy as np

from .. import hosts
from ..shaders import ALPHA, GENERATED, ISLAND, NORMAL, POINTINESS, SIGN, TANGENT
from ..values import MeshValues
from . import pointiness, tangents
from .mesh import is_placed

MeshVectors = tuple[tuple[str, np.ndarray], ...]


def made(mesh: bpy.types.Mesh, values: MeshValues, names: set[str]) -> MeshVectors:
    """The vectors of these names, each (3m, 3); none of a UV map that the mesh has not.

    `mesh`: the evaluated mesh that `values` were read from.
    """
    found: list[tuple[str, np.ndarray]] = []
    for name in sorted(names):
        if name == GENERATED:
            found.append((name, _at_corners(_generated(mesh), values)))
        elif name == ISLAND:
            found.append((name, _at_corners(_islands(mesh), values)))
        elif name == POINTINESS:
            found.append((name, _at_corners(_repeated(pointiness.of(mesh)), values)))
        elif name.startswith(ALPHA):
            alpha = _alpha(mesh, name.removeprefix(ALPHA))
            if alpha is not None:
                found.append((name, _repeated(alpha)))
        elif name == NORMAL:
            found.append((name, values.corner_normals))
        elif name.startswith((TANGENT, SIGN)):
            uv = dict(values.uv_maps).get(name.split(" ", 1)[1])
            if not name.split(" ", 1)[1] and values.uv_maps:
                uv = values.uv_maps[0][1]
            if uv is not None:
                tangent, sign = tangents.of(values, uv)
                found.append((name, tangent if name.startswith(TANGENT) else sign))
    return tuple(found)


def _at_corners(of_vertices: np.ndarray, values: MeshValues) -> np.ndarray:
    return np.ascontiguousarray(of_vertices[values.triangles.reshape(-1)], np.float32)


def _repeated(numbers: np.ndarray) -> np.ndarray:
    return np.repeat(np.asarray(numbers, np.float32)[:, None], 3, axis=1)


def _alpha(mesh: bpy.types.Mesh, name: str) -> np.ndarray | None:
    """(3m,): of a colour attribute, "" for the one that renders; 1 of an attribute without alpha.
    None: there is no attribute of the name."""
    mesh.calc_loop_triangles()
    corners = hosts.whole_numbers(mesh.loop_triangles, "loops", 3).astype(np.intp)
    vertices = np.take(hosts.corner_vertices(mesh), corners)
    # Without the triangles that a reader of the mesh leaves out.
    finite = is_placed(hosts.floats(mesh.vertices, "co", 3))
    kept = np.repeat(finite[vertices.reshape(-1, 3)].all(axis=1), 3)
    found = hosts.color_attribute(mesh, name)
    if found is None:
        return np.ones(int(kept.sum()), np.float32) if name in mesh.attributes else None
    alpha = hosts.floats(found.data, "color", 4)[:, 3]
    where = corners if found.domain == "CORNER" else vertices
    return np.take(alpha, where.reshape(-1))[kept]


def _generated(mesh: bpy.types.Mesh) -> np.ndarray:
    """Generated coordinates of vertices: undeformed positions in the mesh's texture space."""
    positions = hosts.floats(mesh.vertices, "undeformed_co", 3)
    middle = np.array(mesh.texspace_location, np.float32)
    size = np.array(mesh.texspace_size, np.float32)
    half = np.divide(0.5, size, out=np.zeros(3, np.float32), where=size != 0)
    return positions * half - (middle * half - np.float32(0.5))


def _islands(mesh: bpy.types.Mesh) -> np.ndarray:
    """A random number for each part of the mesh that hangs together, of its first root."""
    parents = list(range(len(mesh.vertices)))
    ranks = [0] * len(parents)

    def root(vertex: int) -> int:
        while parents[vertex] != vertex:
            parents[vertex] = parents[parents[vertex]]
            vertex = parents[vertex]
        return vertex

    for a, b in hosts.whole_numbers(mesh.edges, "vertices", 2).reshape(-1, 2).tolist():
        one, other = root(a), root(b)
        if one == other:
            continue
        if ranks[one] < ranks[other]:
            one, other = other, one
        parents[other] = one
        ranks[one] += ranks[one] == ranks[other]
    roots = np.array([root(vertex) for vertex in range(len(parents))], np.uint32)
    return _repeated(_random_of(roots))


def _random_of(numbers: np.ndarray) -> np.ndarray:
    """Numbers in [0, 1] of whole ones, as Cycles hashes them (Jenkins, lookup3)."""
    return (hashed(numbers) / np.float64(0xFFFFFFFF)).astype(np.float32)


def hashed(first: np.ndarray, second: np.ndarray | None = None) -> np.ndarray:
    """lookup3 of one word or two, each (n,) uint32."""
    words = 1 if second is None else 2
    start = np.uint32((0xDEADBEEF + (words << 2) + 13) & 0xFFFFFFFF)
    with np.errstate(over="ignore"):
        a = start + first.astype(np.uint32)
        b = np.full_like(a, start)
        c = b.copy()
        if second is not None:
            b = b + second.astype(np.uint32)

        def turned(x: np.ndarray, bits: int) -> np.ndarray:
            return (x << np.uint32(bits)) | (x >> np.uint32(32 - bits))

        c = (c ^ b) - turned(b, 14)
        a = (a ^ c) - turned(c, 11)
        b = (b ^ a) - turned(a, 25)
        c = (c ^ b) - turned(b, 16)
        a = (a ^ c) - turned(c, 4)
        b = (b ^ a) - turned(a, 14)
        return (c ^ b) - turned(b, 24)


def random_of_name(name: str) -> float:
    """The Random of Object Info, of an object that is no instance."""
    number = 0
    for byte in name.encode():
        number = (number * 37 + byte) & 0xFFFFFFFF
    word = hashed(np.array([number], np.uint32), np.array([0], np.uint32))
    return float(word[0] / np.float64(0xFFFFFFFF))
