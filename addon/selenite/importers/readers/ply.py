# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh out of a PLY file, in double precision where the file has it.

The format names no texture. MeshLab, Metashape and OpenMVS write the comment `TextureFile` and
places in it, with v upward, at the corners of the faces (`texcoord`) or at the vertices.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..reconstruction import ReconstructedMesh
from . import numbers
from .files import Place
from .meshes import fans, in_range, linear_of_srgb, of_unit_length
from .ply_tables import Column, read_tables
from .texture import picture

_CORNERS = ("vertex_indices", "vertex_index")
#: Of vertices, as programs call them.
_UVS = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
_TEXTURE = "TextureFile "


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
    corners, _ = fans(ends - listed.lengths, listed.lengths, faces)
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
    mesh = ReconstructedMesh(
        file.stem, positions, triangles, uvs,
        normals=_normals(vertices, triangles, place),
        colors=_colors(vertices, place),
        texture=_texture(tables.comments, file, remarks) if uvs is not None else None,
    )  # fmt: skip
    return mesh, tuple(remarks)


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


def _texture(comments: tuple[str, ...], file: Path, remarks: list[str]) -> Path | None:
    names = [text.removeprefix(_TEXTURE) for text in comments if text.startswith(_TEXTURE)]
    if not names:
        return None
    if len(names) > 1:
        remarks.append(f"of its {len(names)} textures only the first is used; export one")
    return picture(names[0], Place(file, "comment TextureFile"), remarks)
