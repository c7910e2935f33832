# SPDX-License-Identifier: GPL-3.0-or-later
"""IndexedFaceSet, IndexedTriangleSet and TriangleSet of X3D, as triangles.

Source: ISO/IEC 19775-1, 11.4 (rendering) and 13.3 (geometry). Normals that are not given, and how
creases are shaded, are left to whoever shows the mesh.
"""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np

from . import numbers
from .files import Place
from .meshes import fans, in_range, linear_of_srgb
from .x3d_nodes import Nodes

READ = ("IndexedFaceSet", "IndexedTriangleSet", "TriangleSet")


@dataclass(frozen=True)
class Geometry:
    """As ReconstructedMesh has them, in the coordinates of the shape."""

    positions: np.ndarray
    triangles: np.ndarray
    uvs: np.ndarray | None
    normals: np.ndarray | None
    colors: np.ndarray | None


@dataclass(frozen=True)
class _Faces:
    """Triangles as corners, which are places in the list of indices, and the face of each."""

    corners: np.ndarray
    face: np.ndarray
    faces: int


def read_geometry(element: Element, nodes: Nodes) -> Geometry:
    """Of one of READ. Raises ReconstructionError."""
    place = nodes.place(element)
    positions = _values(element, nodes, ("Coordinate",), "point", 3)
    if positions is None:
        raise place.error("it has no Coordinate")
    if element.tag == "IndexedFaceSet":
        own = nodes.numbers(element, "coordIndex")
        listed = numbers.indices(np.zeros(0) if own is None else own, place.at("coordIndex"))
        faces = _faces(listed, nodes.place(element, "coordIndex"))
    else:
        listed = _listed(element, nodes, len(positions))
        count = len(listed) // 3
        faces = _Faces(np.arange(3 * count).reshape(-1, 3), np.arange(count), count)
    if not nodes.flag(element, "ccw", True):
        faces = _Faces(faces.corners[:, ::-1], faces.face, faces.faces)
    triangles = listed[faces.corners]
    in_range(triangles, len(positions), nodes.place(element, "coordIndex"))
    uvs = _values(element, nodes, ("TextureCoordinate",), "point", 2)
    corner_uvs = None
    if uvs is not None and len(uvs):
        corner_uvs = uvs[_of(element, nodes, "texCoordIndex", listed, faces, True, len(uvs))]
    normals = _values(element, nodes, ("Normal",), "vector", 3)
    corner_normals = None
    if normals is not None and len(normals):
        by_vertex = nodes.flag(element, "normalPerVertex", True)
        index = _of(element, nodes, "normalIndex", listed, faces, by_vertex, len(normals))
        corner_normals = normals[index]
    return Geometry(
        positions, triangles, corner_uvs, corner_normals,
        _colors(element, nodes, listed, faces, triangles, len(positions)),
    )  # fmt: skip


def _values(
    element: Element, nodes: Nodes, tags: tuple[str, ...], field: str, size: int
) -> np.ndarray | None:
    """(n, size) of the child that holds them."""
    holder = nodes.child(element, *tags)
    if holder is None:
        return None
    found = nodes.numbers(holder, field)
    if found is None:
        return np.zeros((0, size))
    if len(found) % size:
        place = nodes.place(holder, field)
        raise place.error(f"its {len(found)} numbers are not a multiple of {size}")
    return found.reshape(-1, size)


def _listed(element: Element, nodes: Nodes, vertices: int) -> np.ndarray:
    """Indices of a set of triangles, three each."""
    if element.tag == "TriangleSet":
        return np.arange(vertices - vertices % 3)
    place = nodes.place(element, "index")
    own = nodes.numbers(element, "index")
    found = numbers.indices(np.zeros(0) if own is None else own, place)
    if len(found) % 3:
        raise place.error(f"its {len(found)} indices are not a multiple of 3")
    return found


def _faces(listed: np.ndarray, place: Place) -> _Faces:
    """Faces between -1, each a fan of triangles from its first corner."""
    ends = np.flatnonzero(listed < 0)
    if len(listed) and listed[-1] >= 0:
        ends = np.append(ends, len(listed))
    starts = np.concatenate([[0], ends[:-1] + 1]) if len(ends) else np.zeros(0, dtype=np.int64)
    lengths = ends - starts
    corners, face = fans(starts, lengths, place)
    return _Faces(corners, face, len(starts))


def _of(
    element: Element, nodes: Nodes, field: str, listed: np.ndarray, faces: _Faces,
    by_vertex: bool, count: int,
) -> np.ndarray:  # fmt: skip
    """(triangles, 3) indices into the `count` values of a kind: of its own list, laid out as that
    of the coordinates; where it has none, of theirs, or of the faces in turn."""
    place = nodes.place(element, field)
    own = nodes.numbers(element, field) if element.tag == "IndexedFaceSet" else None
    index = None if own is None or not own.size else numbers.indices(own, place)
    if by_vertex:
        if index is None:
            index = listed
        elif not _alike(index, listed):
            raise place.error("its faces are not those of coordIndex")
        found = index[faces.corners]
    else:
        if index is not None and len(index) < faces.faces:
            raise place.error(f"it has {len(index)} entries for {faces.faces} faces")
        each = faces.face if index is None else index[faces.face]
        found = np.repeat(each[:, None], 3, axis=1)
    in_range(found, count, place)
    return found


def _alike(index: np.ndarray, listed: np.ndarray) -> bool:
    """Whether -1 stands at the same places; the last one may be left out."""
    least = min(len(index), len(listed))
    rest = np.concatenate([index[least:], listed[least:]])
    return (
        len(rest) <= 1
        and bool((rest < 0).all())
        and bool(((index[:least] < 0) == (listed[:least] < 0)).all())
    )


def _colors(
    element: Element, nodes: Nodes, listed: np.ndarray, faces: _Faces, triangles: np.ndarray,
    vertices: int,
) -> np.ndarray | None:  # fmt: skip
    """(vertices, 3) linear: a vertex has the colour of its last corner."""
    holder = nodes.child(element, "Color", "ColorRGBA")
    if holder is None:
        return None
    encoded = _values(element, nodes, (holder.tag,), "color", 4 if holder.tag == "ColorRGBA" else 3)
    if encoded is None or not len(encoded):
        return None
    encoded = encoded[:, :3]
    # Browsers show the numbers as they are: they are those of sRGB.
    linear = linear_of_srgb(encoded, nodes.place(holder, "color"))
    by_vertex = nodes.flag(element, "colorPerVertex", True)
    index = _of(element, nodes, "colorIndex", listed, faces, by_vertex, len(encoded))
    found = np.ones((vertices, 3))
    found[triangles.reshape(-1)] = linear[index.reshape(-1)]
    return found
