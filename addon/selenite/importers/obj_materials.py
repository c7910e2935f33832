# SPDX-License-Identifier: GPL-3.0-or-later
"""The materials of an OBJ: the colour or the picture of each, and how that is placed.

Blender's importer says nothing of a library or a picture that is not there, and finds neither where
it was written on Windows.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from .obj_scan import ObjScan, lines_of
from .readers import tiles
from .readers.files import inside, is_file, shortened
from .readers.texture import in_any_case
from .reconstruction import WHITE, MeshMaterial

#: Words after an option of a picture; those of -o, -s and -t are one to three numbers.
_OPTIONS = {
    "-blendu": 1, "-blendv": 1, "-boost": 1, "-bm": 1, "-cc": 1, "-clamp": 1, "-colorspace": 1,
    "-imfchan": 1, "-mm": 2, "-texres": 1, "-type": 1,
}  # fmt: skip
_PLACES = ("-o", "-s", "-t")
#: Options that change what is seen, and statements that do.
_REPORTED_OPTIONS = ("-cc", "-clamp", "-imfchan", "-mm", "-t")
_REPORTED = (
    "map_d",
    "map_bump",
    "bump",
    "norm",
    "map_kn",
    "disp",
    "map_pr",
    "map_pm",
    "map_ke",
    "map_ns",
)
#: Numbers that other materials have as 0: light of their own, metal, sheen, coat.
_ZERO = ("ke", "pm", "ps", "pc")


@dataclass(frozen=True)
class ObjMaterial:
    """scale, offset: of texture coordinates, times one and then plus the other."""

    shown: MeshMaterial
    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)


def materials_of(file: Path, scan: ObjScan) -> tuple[dict[str, ObjMaterial], list[str]]:
    """By name; and remarks on what is not there or not read, a line each."""
    remarks: list[str] = []
    if scan.has_mark:
        remarks.append(
            "the file begins with a byte order mark, which other programs may stumble at"
        )
    found: dict[str, ObjMaterial] = {}
    is_lost = False
    for name in scan.libraries:
        libraries = _libraries(file, name)
        if not libraries:
            is_lost = True
            remarks.append(f"the library of materials '{shortened(name)}' is not there")
        for library in libraries:
            found.update(_Library(library, remarks).materials)
    lost = [name for name in scan.materials if name not in found]
    if lost and (is_lost or scan.libraries):
        names = ", ".join(f"'{shortened(name)}'" for name in lost[:5])
        more = f" and {len(lost) - 5} more" if len(lost) > 5 else ""
        remarks.append(f"no library has the materials {names}{more}: their faces are white")
    return found, remarks


def _libraries(file: Path, name: str) -> list[Path]:
    """One file whose name may have spaces, or several that spaces part."""
    whole = _picture_at(file, name)
    if whole is not None:
        return [whole]
    parts = [_picture_at(file, part) for part in name.split()]
    return [part for part in parts if part is not None] if None not in parts else []


def _picture_at(file: Path, name: str) -> Path | None:
    """Below the folder of `file`, whatever the case; of a path that leads elsewhere its last
    part."""
    plain = name.strip().strip('"').replace("\\", "/")
    for text in (plain, plain.rpartition("/")[2]):
        path = in_any_case(file.parent, text)
        if path is not None and (is_file(path) or tiles.of(path)):
            return path
    path = inside(file.parent, plain)
    return path if path is not None and tiles.of(path) else None


class _Library:
    """One file of materials."""

    def __init__(self, file: Path, remarks: list[str]) -> None:
        self._file, self._remarks = file, remarks
        self.materials: dict[str, ObjMaterial] = {}
        self._name = ""
        self._colored: set[str] = set()
        for line in (text for _, text in lines_of(file) if text):
            word, *rest = line.decode("utf-8", "replace").split(None, 1)
            self._read(word.lower(), rest[0] if rest else "")
        for name in self.materials:
            if name not in self._colored:
                self._name = name
                self._say("it has neither Kd nor map_Kd: its faces are white")

    def _read(self, word: str, rest: str) -> None:
        if word == "newmtl":
            self._name = rest
            self.materials[rest] = ObjMaterial(MeshMaterial(rest))
        elif self._name not in self.materials:
            return
        elif word == "kd":
            self._colored.add(self._name)
            self._set_color(rest)
        elif word == "map_kd" and rest:
            self._colored.add(self._name)
            self._set_picture(rest)
        elif word in _ZERO:
            if any(float(number) != 0 for number in _leading_numbers(rest.split())):
                self._say(f"its {word.capitalize()} {shortened(rest)} is not read")
        elif word in _REPORTED and rest:
            self._say(f"its {word} is not read")
        elif word in ("d", "tr"):
            opaque = "1" if word == "d" else "0"
            if not re.fullmatch(rf"{opaque}(\.0*)?", rest):
                self._say(f"its transparency ({word} {shortened(rest)}) is not read")

    def _say(self, text: str) -> None:
        self._remarks.append(f"material '{shortened(self._name)}': {text}")

    def _set_color(self, rest: str) -> None:
        try:
            red, green, blue = (float(part) for part in (rest.split() * 3)[:3])
            is_color = all(0 <= part <= 1 for part in (red, green, blue))
        except ValueError:  # spectral, or broken
            is_color = False
        if self.materials[self._name].shown.texture is not None:
            return
        if not is_color:
            self._say(f"its Kd {shortened(rest)} is not read: its faces are white")
        else:
            self.materials[self._name] = ObjMaterial(
                MeshMaterial(self._name, None, color=(red, green, blue))
            )

    def _set_picture(self, rest: str) -> None:
        words = rest.split()
        scale, offset = (1.0, 1.0), (0.0, 0.0)
        while words and words[0].lower() in (*_OPTIONS, *_PLACES):
            option, values = words[0].lower(), words[1 : 1 + _OPTIONS.get(words[0].lower(), 0)]
            if option in _PLACES:
                values = _leading_numbers(words[1:4])
            words = words[1 + len(values) :]
            if option == "-o" and values:
                offset = _pair(values, 0.0)
            elif option == "-s" and values:
                scale = _pair(values, 1.0)
            elif option in _REPORTED_OPTIONS and values != ["off"]:
                text = " ".join([option, *values])
                self._say(f"the option {shortened(text)} of its texture is not read")
        name = " ".join(words)
        # Spaces of a name count, wherever the words stand.
        name = rest[rest.index(words[0]) :] if words and rest.endswith(words[-1]) else name
        picture = _picture_at(self._file, name)
        if picture is None:
            self._remarks.append(
                f"the texture '{shortened(name)}' of material '{shortened(self._name)}' is not "
                "there, below the folder of the mesh: its faces are white"
            )
        elif picture.name != name.replace("\\", "/").rpartition("/")[2].strip('"'):
            self._say(
                f"its texture '{shortened(name)}' is not there; '{picture.name}' takes its place"
            )
        shown = MeshMaterial(self._name, picture, color=WHITE)
        self.materials[self._name] = ObjMaterial(shown, scale, offset)


def _leading_numbers(words: list[str]) -> list[str]:
    found = []
    for word in words:
        try:
            float(word)
        except ValueError:
            break
        found.append(word)
    return found


def _pair(values: list[str], usual: float) -> tuple[float, float]:
    numbers = [float(value) for value in values]
    return numbers[0], numbers[1] if len(numbers) > 1 else usual
