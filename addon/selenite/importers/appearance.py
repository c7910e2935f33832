# SPDX-License-Identifier: GPL-3.0-or-later
"""What the materials of an imported mesh look like: of an OBJ by its libraries, of a glTF by the
nodes that Blender's importer has made."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from .node_trace import BaseColor, base_color
from .obj_materials import materials_of
from .obj_scan import ObjScan
from .readers import tiles
from .readers.files import inside, is_file, shortened
from .reconstruction import MeshMaterial, PackedPicture

_GLB, _JSON = b"glTF", 0x4E4F534A
_HEADER = 20
#: Blender's names are as long, in bytes.
_LONGEST = 63
_MIRROR = (3, 5, 0)  # the version from which an Image Texture mirrors


@dataclass(frozen=True, eq=False)
class Appearance:
    """uv_map: the name of the one that its picture takes, "" for the usual. placed: (2, 3), from
    its texture coordinates to those of the picture. mixed_wrap: see BaseColor."""

    material: MeshMaterial
    uv_map: str = ""
    placed: np.ndarray = field(default_factory=lambda: np.eye(2, 3))
    mixed_wrap: bool = False


class Appearances(ABC):
    """By Blender's material; remarks are made once for each."""

    def __init__(self, remarks: list[str]) -> None:
        self._remarks = remarks
        self._known: dict[str, Appearance] = {}

    def of(self, material: bpy.types.Material | None) -> Appearance:
        """None: faces without one."""
        name = "" if material is None else material.name
        if name not in self._known:
            self._known[name] = self._read(material, name)
        return self._known[name]

    def note_wrap(self, shown: Appearance) -> None:
        """Of a picture beside which faces reach."""
        if shown.mixed_wrap:
            self._remarks.append(
                f"material '{shortened(shown.material.name)}': its texture wraps in one way across "
                "and in another down, which is not read: it repeats both ways"
            )

    @abstractmethod
    def _read(self, material: bpy.types.Material | None, name: str) -> Appearance: ...


def of_obj(file: Path, scanned: ObjScan, remarks: list[str]) -> Appearances:
    """By the libraries of materials."""
    return _OfObj(file, scanned, remarks)


def of_gltf(file: Path, remarks: list[str]) -> Appearances:
    """By nodes."""
    return _OfGltf(file, remarks)


class _OfObj(Appearances):
    def __init__(self, file: Path, scanned: ObjScan, remarks: list[str]) -> None:
        super().__init__(remarks)
        self._materials, found = materials_of(file, scanned)
        remarks += found
        self._cut = {_cut(name): name for name in self._materials}

    def _read(self, material: bpy.types.Material | None, name: str) -> Appearance:
        # The open file, or another one of the library, may have had one of the name.
        names = (name, name.rpartition(".")[0])
        own = next((self._cut[one] for one in names if one in self._cut), None)
        if own is None:
            return Appearance(MeshMaterial(name))
        found = self._materials[own]
        placed = np.column_stack([np.diag(found.scale), found.offset])
        return Appearance(found.shown, placed=placed)


def _cut(name: str) -> str:
    return name.encode()[:_LONGEST].decode(errors="ignore")


class _OfGltf(Appearances):
    def __init__(self, file: Path, remarks: list[str]) -> None:
        super().__init__(remarks)
        self._file = file
        remarks += [
            f"the texture '{shortened(name)}' is not there, beside the file of the mesh: its faces "
            "are white"
            for name in _missing_pictures(file)
        ]

    def _read(self, material: bpy.types.Material | None, name: str) -> Appearance:
        found = base_color(material)
        texture = next(
            (one for image in found.images if (one := self._picture(image)) is not None), None
        )
        shown = MeshMaterial(name, texture, found.color)
        if texture is not None:
            extension = "REPEAT" if found.mixed_wrap else found.extension
            shown = replace(shown, times_colors=found.times_colors, extension=extension)
            if found.times_colors:
                self._remarks.append(
                    f"material '{shortened(name)}': its texture is multiplied by vertex colours; "
                    "to fit the image alone, link it to the base colour itself"
                )
        self._remarks += self._said(name, found)
        return Appearance(shown, found.uv_map, found.placed, found.mixed_wrap)

    def _picture(self, image: bpy.types.Image) -> Path | PackedPicture | None:
        """A file in the folder of the mesh or inside, or what the mesh's file holds."""
        path = Path(bpy.path.abspath(image.filepath)).resolve() if image.filepath else self._file
        is_there = path.is_file() or bool(tiles.of(path))
        if path != self._file and is_there and path.is_relative_to(self._file.resolve().parent):
            return path
        if image.packed_file is not None:
            return PackedPicture(image.name, bytes(image.packed_file.data))
        return None

    def _said(self, name: str, found: BaseColor) -> list[str]:
        name = shortened(name)
        said = []
        if len(set(found.images)) > 1:
            said.append(f"material '{name}': of its textures of colour only the first is used")
        if max(found.color) > 1:
            said.append(f"material '{name}': factors of its base colour above 1 are cut off")
        if found.unread:
            nodes = ", ".join(f"'{shortened(node)}'" for node in found.unread)
            said.append(
                f"material '{name}': before its base colour stand nodes that are not read: {nodes}"
            )
        if found.left_out:
            inputs = ", ".join(found.left_out)
            said.append(f"material '{name}': its base colour alone is read; not read: {inputs}")
        return said


def _missing_pictures(file: Path) -> list[str]:
    """Files that a glTF names and that are not there; Blender's importer passes over them."""
    try:
        content: Any = json.loads(_json_of(file))
        images = content.get("images", [])
        names = [one["uri"] for one in images if isinstance(one.get("uri"), str)]
    except (OSError, ValueError, AttributeError, TypeError, KeyError):
        return []  # the importer says what is wrong
    from urllib.parse import unquote

    outside = [name for name in names if not name.startswith("data:")]
    return [
        name
        for name in outside
        if not any(is_file(inside(file.parent, one)) for one in (name, unquote(name)))
    ]


def _json_of(file: Path) -> bytes:
    with file.open("rb") as stream:
        start = stream.read(_HEADER)
        if not start.startswith(_GLB):
            return start + stream.read()
        length, kind = (int.from_bytes(start[at : at + 4], "little") for at in (12, 16))
        return stream.read(length) if kind == _JSON else b""
