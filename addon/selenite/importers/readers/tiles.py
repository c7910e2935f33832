# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures in tiles (UDIM): each square of the UV plane has a picture, whose number is
1001 + u + 10 v.

Programs name the picture of the first tile, or write <UDIM> where the number stands.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..reconstruction import MeshMaterial, ReconstructedMesh
from .files import inside, is_file, shortened

ANY, FIRST = "<UDIM>", 1001
#: Tiles in a row, and rows.
_ROW, _ROWS = 10, 100
_NUMBERED = re.compile(rf"(.*)(?<![0-9])({ANY}|1[0-9]{{3}})(?![0-9])(\.[^.]+)")


def of(path: Path) -> dict[int, Path]:
    """Tiles that lie beside it, by their numbers; empty where its name has no <UDIM>."""
    match = _NUMBERED.fullmatch(path.name)
    return _files(path, match) if match is not None and match[2] == ANY else {}


def split(mesh: ReconstructedMesh) -> tuple[ReconstructedMesh, list[str]]:
    """The same with a material for each tile, and each face within the square from 0 to 1; and
    remarks. Pictures whose name only looks like that of a tile stay."""
    remarks: list[str] = []
    materials = list(mesh.materials)
    count = len(mesh.triangles)
    which = np.zeros(count, np.int64) if mesh.material_of is None else mesh.material_of.copy()
    uvs = None if mesh.uvs is None else np.array(mesh.uvs, np.float64)
    for index, material in enumerate(mesh.materials):
        match = isinstance(material.texture, Path) and _NUMBERED.fullmatch(material.texture.name)
        if uvs is None or not match or not isinstance(material.texture, Path):
            continue
        chosen = np.flatnonzero(which == index)
        middle = np.nan_to_num(uvs[chosen].mean(axis=1), nan=-1.0)
        squares = np.clip(np.floor(middle), -1, _ROWS).astype(np.int64)
        files = _files(material.texture, match)
        if match[2] != ANY and (not squares.any() or len(files) < 2):
            continue
        inside = ((squares >= 0) & (squares < (_ROW, _ROWS))).all(axis=1)
        numbered = np.where(inside, FIRST + squares @ (1, _ROW), 0)
        for number in np.unique(numbered):
            picture = files.get(int(number))
            if picture is None:
                name = shortened(material.texture.name)
                what = f"tile {number}" if number else "a tile outside of 1001 to 1999"
                remarks.append(f"{what} of the texture '{name}' is not there: its faces are white")
            own = f"{material.name}.{number}" if material.name else ""
            which[chosen[numbered == number]] = len(materials)
            materials.append(MeshMaterial(own, picture))
        uvs[chosen] -= np.where(inside[:, None], squares, 0)[:, None]
    if len(materials) == len(mesh.materials):
        return mesh, remarks
    kept, which = np.unique(which, return_inverse=True)
    left = tuple(materials[index] for index in kept)
    return replace(mesh, uvs=uvs, materials=left, material_of=which.reshape(-1)), remarks


def _files(path: Path, match: re.Match[str]) -> dict[int, Path]:
    numbers = range(FIRST, FIRST + _ROW * _ROWS - 1)
    named = {number: inside(path.parent, f"{match[1]}{number}{match[3]}") for number in numbers}
    return {number: file for number, file in named.items() if file is not None and is_file(file)}
