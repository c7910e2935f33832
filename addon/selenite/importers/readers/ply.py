# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh out of a PLY file, in double precision where the file has it.

The format names no texture. MeshLab, Metashape and OpenMVS write the comment `TextureFile` and
places in it, with v upward, at the corners of the faces (`texcoord`) or at the vertices; of several
such comments, each face has the number of one (`texnumber`, from 0).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..reconstruction import MeshMaterial, ReconstructedMesh
from . import numbers
from .files import Place
from .meshes import fans, in_range, linear_of_srgb, of_unit_length
from .ply_tables import Column, read_tables
from .texture import picture

_CORNERS = ("vertex_indices", "vertex_index")
#: Of vertices, as programs call them.
_UVS = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
_TEXTURE, _WHICH = "TextureFile ", "texnumber"


def read_ply(file: Path) -> tuple[ReconstructedMesh, tuple[str, ...]]:
    """The mesh, and remarks. Raises ReconstructionError."""
    tables = read_tables(file)
    vertices, place = tables.elements.get("vertex", {}), Place(file, "vertex")
    positions = _numbers(vertices, ("x", "y", "z"), place)
    if positions is None:
        raise place.error("it has no x, y and z")
    faces = Place(file, "face")
    columns = tables.elements.get("face", {})
    listed = next((columns[name] for name in _CORNERS if name in columns), None)
    if listed is None or not len(listed.values):
        raise faces.error("there is none: it holds points or strips alone", "export a mesh")
    ends = np.cumsum(listed.lengths)
    corners, face = fans(ends - listed.lengths, listed.lengths, faces)
    index = numbers.indices(listed.values.astype(np.float64), faces)
    triangles = index[corners]
    in_range(triangles, len(positions), faces)
    uvs = _corner_uvs(columns.get("texcoord"), listed.lengths, faces)
    at_vertices = next(
        (found for names in _UVS if (found := _numbers(vertices, names, place)) is not None), None
    )
    if uvs is not None:
        uvs = uvs[corners]
    elif at_vertices is not None:
        uvs = at_vertices[triangles]
    remarks: list[str] = []
    comments = tables.comments if uvs is not None else ()
    materials, which = _materials(comments, columns, file, remarks)
    mesh = ReconstructedMesh(
        file.stem, positions, triangles, uvs,
        normals=_normals(vertices, triangles, place),
        colors=_colors(vertices, place),
        materials=materials, material_of=None if which is None else which[face],
    )  # fmt: skip
    return mesh, tuple(remarks)


def read_points(file: Path) -> np.ndarray:
    """(n, 3) of a file that holds points alone, or of a mesh its vertices. Raises
    ReconstructionError."""
    place = Place(file, "vertex")
    found = _numbers(read_tables(file).elements.get("vertex", {}), ("x", "y", "z"), place)
    if found is None:
        raise place.error("it has no x, y and z")
    return found


def _numbers(columns: dict[str, Column], names: tuple[str, ...], place: Place) -> np.ndarray | None:
    """(rows, names) of single values; None where one is missing."""
    found = [columns[name] for name in names if name in columns]
    if len(found) < len(names):
        return None
    if any((column.lengths != 1).any() for column in found):
        raise place.error(f"{', '.join(names)} are lists")
    return numbers.finite(np.column_stack([one.values for one in found]).astype(float), place)


def _corner_uvs(column: Column | None, lengths: np.ndarray, place: Place) -> np.ndarray | None:
    """(corners, 2) of lists with two numbers for each corner; 0 where a face has none."""
    if column is None or not len(column.values):
        return None
    has = column.lengths > 0
    if (column.lengths[has] != 2 * lengths[has]).any():
        raise place.error("its texcoord are not two numbers for each corner")
    found = np.zeros((int(lengths.sum()), 2))
    values = numbers.finite(column.values.astype(np.float64), place.at("face, texcoord"))
    found[np.repeat(has, lengths)] = values.reshape(-1, 2)
    return found


def _normals(vertices: dict[str, Column], triangles: np.ndarray, place: Place) -> np.ndarray | None:
    """(triangles, 3, 3) of unit length; None where a vertex has none."""
    found = _numbers(vertices, ("nx", "ny", "nz"), place)
    normals = None if found is None else of_unit_length(found)
    return None if normals is None else normals[triangles]


def _colors(vertices: dict[str, Column], place: Place) -> np.ndarray | None:
    """(vertices, 3) linear; whole numbers and others are code values of sRGB."""
    found = _numbers(vertices, ("red", "green", "blue"), place)
    if found is None:
        return None
    kind = vertices["red"].kind
    largest = 1.0 if kind.startswith("f") else float(np.iinfo(kind).max)
    return linear_of_srgb(found / largest, place.at("vertex, red, green and blue"))


def _materials(
    comments: tuple[str, ...], faces: dict[str, Column], file: Path, remarks: list[str]
) -> tuple[tuple[MeshMaterial, ...], np.ndarray | None]:
    """A material for each texture, and which of them each face has; one more for faces without."""
    names = [text.removeprefix(_TEXTURE) for text in comments if text.startswith(_TEXTURE)]
    place = Place(file, "comment TextureFile")
    if not names:
        return (MeshMaterial(),), None
    if len(names) > 1 and _WHICH not in faces:
        remarks.append(
            f"of its {len(names)} textures only the first is used, as no {_WHICH} says which face "
            "has which"
        )
        names = names[:1]
    found = [MeshMaterial("", picture(name, place, remarks)) for name in names]
    if len(found) == 1:
        return tuple(found), None
    numbered = _numbers(faces, (_WHICH,), Place(file, "face"))
    assert numbered is not None  # noqa: S101 - see above
    which = numbers.indices(numbered[:, 0], Place(file, f"face, {_WHICH}"))
    known = (which >= 0) & (which < len(found))
    if known.all():
        return tuple(found), which
    return (*found, MeshMaterial()), np.where(known, which, len(found))
