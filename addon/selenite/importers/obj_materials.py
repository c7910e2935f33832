# SPDX-License-Identifier: GPL-3.0-or-later
"""Which pictures the materials of an OBJ name: of those that are not there, Blender's importer says
nothing."""

from __future__ import annotations

from pathlib import Path

from .readers.files import inside, is_file

#: Bytes of a library of materials, and lines of the OBJ before its first vertex.
_MOST = 1 << 20
_HEAD = 100


def pictures_of(file: Path) -> dict[str, str]:
    """The base colour's picture by the name of the material, as the library says it; empty for
    what is no OBJ or cannot be read."""
    found: dict[str, str] = {}
    if file.suffix.lower() != ".obj":
        return found
    for library in _libraries(file):
        name = ""
        for line in _text(library).splitlines():
            word, _, rest = line.strip().partition(" ")
            if word == "newmtl":
                name = rest.strip()
            elif word.lower() == "map_kd" and rest.strip():
                found[name] = rest.strip()
    return found


def _libraries(file: Path) -> list[Path]:
    with file.open("rb") as lines:
        head = [line for _, line in zip(range(_HEAD), lines, strict=False)]
    named = [line.split(maxsplit=1)[1:] for line in head if line.startswith(b"mtllib")]
    names = [rest[0].decode("utf-8", "replace").strip() for rest in named if rest]
    found = [inside(file.parent, name.replace("\\", "/")) for name in names]
    return [path for path in found if path is not None and is_file(path)]


def _text(library: Path) -> str:
    with library.open("rb") as stream:
        return stream.read(_MOST).decode("utf-8", "replace")
