# SPDX-License-Identifier: GPL-3.0-or-later
"""Normals at the corners of triangles, as Cycles shades them.

Cycles shades a triangle of a flat face by its own normal, whatever the others of the face are: with
bpy 4.5, a bent quad of metal differs by 296 % in the worst block of 8 pixels from one with the
normal of the face. Where no edge is sharp and no normal is the user's own, its smooth faces take
the normals of vertices, which average over flat faces as well (a cylinder with flat caps, 62 %).
Where it splits a mesh, all corners of a vertex that is left have the last one's normal: those of
faces that are wound against each other too.
"""

from __future__ import annotations

import bpy
import numpy as np

from .. import hosts
from ..closedness import components


def of(
    mesh: bpy.types.Mesh, positions: np.ndarray, corners: np.ndarray, vertices: np.ndarray
) -> np.ndarray:
    """(3m, 3) float32 normals of the corners of `mesh.loop_triangles`, which must be calculated.

    positions (n, 3); corners (3m,): loops of the triangles, vertices (3m,): their vertices.
    """
    domain = hosts.normals_domain(mesh)
    if domain == "CORNER":
        if hosts.splits_faces():
            corners = _last_corners(mesh, corners)
        return hosts.corner_normals(mesh, corners)
    flat = hosts.flat_faces(mesh, all_are=domain == "FACE")
    if flat.all():
        return _of_triangles(positions[vertices.reshape(-1, 3)])
    curved: np.ndarray = np.take(hosts.floats(mesh.vertex_normals, "vector", 3), vertices, axis=0)
    flat = np.take(flat, hosts.triangle_faces(mesh))
    if flat.any():
        curved.reshape(-1, 9)[flat] = _of_triangles(
            positions[vertices.reshape(-1, 3)[flat]]
        ).reshape(-1, 9)
    return curved


def _last_corners(mesh: bpy.types.Mesh, corners: np.ndarray) -> np.ndarray:
    """For each corner of a triangle the last one at the same vertex once faces are split at sharp
    edges and around flat faces."""
    vertices = hosts.corner_vertices(mesh)
    edges = hosts.whole_numbers(mesh.loops, "edge_index")
    starts = hosts.whole_numbers(mesh.polygons, "loop_start")
    counts = hosts.whole_numbers(mesh.polygons, "loop_total")
    following = np.arange(1, len(vertices) + 1)
    following[starts + counts - 1] = starts
    split = np.zeros(len(mesh.edges), bool)
    sharp = hosts.flags(mesh, "sharp_edge")
    split[: len(sharp)] = sharp
    flat = hosts.flat_faces(mesh, all_are=False)
    split[edges[np.repeat(flat, counts)]] = True
    at_split = np.zeros(len(mesh.vertices), bool)
    at_split[hosts.whole_numbers(mesh.edges, "vertices", 2).reshape(-1, 2)[split]] = True

    order = np.argsort(edges, kind="stable")
    one, other = order[:-1], order[1:]
    joined = (edges[one] == edges[other]) & ~split[edges[one]]
    one, other = one[joined], other[joined]
    same_way = vertices[one] == vertices[other]
    there = np.where(same_way, other, following[other])
    back = np.where(same_way, following[other], other)
    part = components(
        len(vertices), np.concatenate([one, following[one]]), np.concatenate([there, back])
    )
    first = np.full(len(mesh.vertices), -1)
    first[vertices[::-1]] = np.arange(len(vertices))[::-1]
    part = np.where(at_split[vertices], part, first[vertices])  # others stay one vertex
    last = np.zeros(len(vertices), np.intp)
    flat_corners = corners.reshape(-1)
    np.maximum.at(last, part[flat_corners], np.arange(len(flat_corners)))
    found: np.ndarray = flat_corners[last[part[flat_corners]]].reshape(corners.shape)
    return found


def _of_triangles(corners: np.ndarray) -> np.ndarray:
    """(3m, 3) float32 of triangles (m, 3, 3); 0 of those without an area."""
    a, b, c = np.moveaxis(corners.astype(np.float64), 1, 0)
    with np.errstate(invalid="ignore", over="ignore"):  # vertices that are not finite: left out
        normal = np.cross(b - a, c - a)
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        unit = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    return np.repeat(unit.astype(np.float32), 3, axis=0)
