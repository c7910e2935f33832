# SPDX-License-Identifier: GPL-3.0-or-later
"""What shaders ask for at the corners of a mesh and only Blender knows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
import numpy as np

from .. import hosts
from ..shaders import (
    ALPHA,
    ATTRIBUTE,
    FACTOR,
    GENERATED,
    ISLAND,
    NORMAL,
    OPACITY,
    POINTINESS,
    SHADED,
    SIGN,
    TANGENT,
)
from ..values import MeshValues
from . import pointiness, tangents
from .mesh import is_placed

if TYPE_CHECKING:
    from ..hosts import BpyStruct

MeshVectors = tuple[tuple[str, np.ndarray], ...]
Groups = dict[str, int]


def made(mesh: bpy.types.Mesh, values: MeshValues, names: set[str], groups: Groups) -> MeshVectors:
    """The vectors of these names, each (3m, 3); none of a UV map that the mesh has not.

    `mesh`: the evaluated mesh that `values` were read from, `groups`: see `vertex_groups`.
    """
    found: list[tuple[str, np.ndarray]] = []
    for name in sorted(names):
        if name == GENERATED:
            found.append((name, _at_corners(_generated(mesh), values)))
        elif name == ISLAND:
            found.append((name, _at_corners(_islands(mesh), values)))
        elif name == POINTINESS:
            found.append((name, _at_corners(_repeated(pointiness.of(mesh)), values)))
        elif name.startswith((ALPHA, OPACITY)):
            otherwise = 0.0 if name.startswith(ALPHA) else 1.0
            found.append((name, _repeated(_alpha(mesh, name.split(" ", 1)[1], otherwise))))
        elif name.startswith((ATTRIBUTE, FACTOR)):
            kind = attribute if name.startswith(ATTRIBUTE) else _factor
            vector = kind(mesh, values, name.split(" ", 1)[1], groups)
            found.append((name, np.zeros_like(values.corner_normals) if vector is None else vector))
        elif name == SHADED:
            found.append((name, _shaded(mesh, values)))
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


@dataclass(frozen=True)
class _Corners:
    """Of the triangles' corners that a reader of the mesh keeps (3k,): loops, vertices, faces."""

    loops: np.ndarray
    vertices: np.ndarray
    faces: np.ndarray


def _corners(mesh: bpy.types.Mesh) -> _Corners:
    mesh.calc_loop_triangles()
    loops = hosts.whole_numbers(mesh.loop_triangles, "loops", 3).astype(np.intp)
    vertices = np.take(hosts.corner_vertices(mesh), loops)
    placed = is_placed(hosts.floats(mesh.vertices, "co", 3))
    kept = np.repeat(placed[vertices.reshape(-1, 3)].all(axis=1), 3)
    faces = np.repeat(hosts.triangle_faces(mesh), 3)
    return _Corners(loops.reshape(-1)[kept], vertices.reshape(-1)[kept], faces[kept])


def _alpha(mesh: bpy.types.Mesh, name: str, otherwise: float) -> np.ndarray:
    """(3m,): of a colour attribute, "" for the one that renders; 1 of an attribute without alpha.
    otherwise: where there is no attribute of the name."""
    at = _corners(mesh)
    found: BpyStruct = hosts.color_attribute(mesh, name) or mesh.attributes.get(name)
    if found is None or found.data_type not in _WITH_ALPHA:
        return np.full(len(at.loops), 1.0 if name in mesh.attributes else otherwise, np.float32)
    alpha = hosts.floats(found.data, _READ[found.data_type][0], 4)[:, 3]
    places = {"CORNER": at.loops, "FACE": at.faces}.get(found.domain, at.vertices)
    return np.take(alpha, places)


def vertex_groups(evaluated: bpy.types.Object) -> Groups:
    """Those of an object that Cycles shows as attributes: name and number."""
    return {group.name: group.index for group in evaluated.vertex_groups if hosts.shows_groups()}


def _weights(mesh: bpy.types.Mesh, number: int) -> np.ndarray:
    """(n,): of a vertex group; 0 of vertices outside."""
    found = np.zeros(len(mesh.vertices), np.float32)
    for vertex in mesh.vertices:
        for member in vertex.groups:
            if member.group == number:
                found[vertex.index] = member.weight
    return found


def attribute(
    mesh: bpy.types.Mesh, values: MeshValues, name: str, groups: Groups
) -> np.ndarray | None:
    """(3m, 3) what Cycles makes of any attribute as a vector or colour; None if there is none of
    the name, or one of a kind that is not read.

    `mesh`: the evaluated mesh that `values` were read from, `groups`: see `vertex_groups`.
    """
    for kind in (values.colors, values.uv_maps):
        if name in dict(kind):
            numbers = dict(kind)[name]
            return np.pad(numbers, ((0, 0), (0, 3 - numbers.shape[1])))
    found: BpyStruct = mesh.attributes.get(name)
    if found is None and name in groups:
        return _at_corners(_repeated(_weights(mesh, groups[name])), values)
    if found is None:
        return _tangent(values, name)
    if found.data_type not in _READ:
        return None
    key, width = _READ[found.data_type]
    if width:
        numbers = hosts.floats(found.data, key, width)[:, :3]
    else:
        numbers = np.empty((len(found.data), 1), np.float32)
        plain = np.empty(len(found.data), bool if found.data_type == "BOOLEAN" else np.int32)
        if found.data_type == "FLOAT":
            plain = plain.view(np.float32)
        found.data.foreach_get(key, plain)
        numbers[:, 0] = plain
    at, domain = _corners(mesh), found.domain
    if domain == "EDGE":
        numbers = _at_vertices(mesh, numbers, found.data_type)
    places = {"CORNER": at.loops, "FACE": at.faces}.get(domain, at.vertices)
    if width != 2:
        numbers = np.broadcast_to(numbers, (len(numbers), 3))
    taken = np.take(numbers, places, axis=0)
    return np.ascontiguousarray(np.pad(taken, ((0, 0), (0, 3 - taken.shape[1]))), np.float32)


def _tangent(values: MeshValues, name: str) -> np.ndarray | None:
    """(3m, 3): what Cycles makes beside a UV map and names after it."""
    uv_map, _, kind = name.rpartition(".")
    uv = dict(values.uv_maps).get(uv_map)
    return tangents.of(values, uv)[0] if uv is not None and kind == "tangent" else None


#: Data types of attributes that are read: the member with the values, and how many there are, 0 for
#: a plain number.
_READ = {
    "FLOAT": ("value", 0),
    "INT": ("value", 0),
    "INT8": ("value", 0),
    "BOOLEAN": ("value", 0),
    "FLOAT2": ("vector", 2),
    "FLOAT_VECTOR": ("vector", 3),
    "FLOAT_COLOR": ("color", 4),
    "BYTE_COLOR": ("color", 4),
    "QUATERNION": ("value", 4),
}
_WITH_ALPHA = {"FLOAT_COLOR", "BYTE_COLOR", "QUATERNION"}


def _at_vertices(mesh: bpy.types.Mesh, of_edges: np.ndarray, kind: str) -> np.ndarray:
    """Numbers of edges at vertices, as Blender takes them there: the mean, or whether any is."""
    ends = hosts.whole_numbers(mesh.edges, "vertices", 2)
    sums = np.zeros((len(mesh.vertices), of_edges.shape[1]))
    np.add.at(sums, ends, np.repeat(of_edges, 2, axis=0))
    counts = np.bincount(ends, minlength=len(sums))[:, None]
    if kind == "BOOLEAN":
        return (sums > 0).astype(np.float32)
    mean = sums / np.maximum(counts, 1)
    whole = np.floor(mean + 0.5) if kind.startswith("INT") else mean
    return whole.astype(np.float32)


def _factor(
    mesh: bpy.types.Mesh, values: MeshValues, name: str, groups: Groups
) -> np.ndarray | None:
    """(3m, 3): the number that Cycles makes of an attribute, the first of two or the mean."""
    vector = attribute(mesh, values, name, groups)
    if vector is None:
        return None
    found: BpyStruct = mesh.attributes.get(name)
    pairs = name in dict(values.uv_maps) or (found is not None and found.data_type == "FLOAT2")
    return _repeated(vector[:, 0] if pairs else vector.mean(axis=1))


def _shaded(mesh: bpy.types.Mesh, values: MeshValues) -> np.ndarray:
    """(3m, 3): the normals of vertices, unless faces are split."""
    if hosts.normals_domain(mesh) == "CORNER":
        return values.corner_normals
    return _at_corners(hosts.floats(mesh.vertex_normals, "vector", 3), values)


def _generated(mesh: bpy.types.Mesh) -> np.ndarray:
    """Generated coordinates of vertices: undeformed positions in the mesh's texture space."""
    positions = hosts.floats(mesh.vertices, "undeformed_co", 3)
    middle = np.array(mesh.texspace_location, np.float32)
    size = np.array(mesh.texspace_size, np.float32)
    half = np.divide(0.5, size, out=np.zeros(3, np.float32), where=size != 0)
    return positions * half - (middle * half - np.float32(0.5))


def islands_of_split(evaluated: bpy.types.Object, values: MeshValues) -> MeshVectors:
    """The numbers of islands where Cycles counts these after it has split faces at sharp edges;
    empty where it does not."""
    if evaluated.type != "MESH" or not hosts.splits_faces():
        return ()
    data: BpyStruct = evaluated.data
    if hosts.normals_domain(data) != "CORNER":
        return ()
    try:
        mesh: BpyStruct = evaluated.to_mesh()
        mesh.split_faces()
        numbers = _islands(mesh)
        taken = np.take(numbers, _corners(mesh).vertices, axis=0)
    finally:
        evaluated.to_mesh_clear()
    found: MeshVectors = ((ISLAND, np.ascontiguousarray(taken, np.float32)),)
    return found if len(taken) == 3 * len(values.triangles) else ()


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
