# SPDX-License-Identifier: GPL-3.0-or-later
"""What an OBJ holds, looked at before Blender's importer reads it: that one mends what it cannot
read, without a word. What is broken is refused by its line."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .readers.files import Place, shortened
from .reconstruction import ReconstructionError

#: Lines of a kind that are checked at a time.
_BLOCK = 50_000
#: Beyond it, single precision has no number.
_LARGEST = 3e38
#: Coordinates below this are kept to 6e-5 by single precision, and the file is read as it is.
_NEAR = 1000.0
_MARK = b"\xef\xbb\xbf"
_COMMENT = re.compile(rb"(?:^|\s+)#")
_UTF16 = (b"\xff\xfe", b"\xfe\xff")
#: Numbers of a line, by its first word.
_NUMBERS = {b"v": 3, b"vt": 1, b"vn": 3}
_WHAT = {b"v": "vertex", b"vt": "texture coordinate", b"vn": "normal"}


@dataclass
class ObjScan:
    """libraries: of materials, as the file names them. materials: that faces name. offset: (3,)
    whole units near to which the first vertex lies, zeros where that is the origin. lost_normals:
    how many are no numbers. needs_copy: whether Blender reads it only when it is rewritten.
    has_mark: whether it begins with a byte order mark."""

    libraries: list[str] = field(default_factory=list)
    materials: list[str] = field(default_factory=list)
    offset: np.ndarray = field(default_factory=lambda: np.zeros(3))
    lost_normals: int = 0
    needs_copy: bool = False
    has_mark: bool = False


def scan(file: Path) -> ObjScan:
    """Reads all lines once. Raises ReconstructionError."""
    try:
        with file.open("rb") as stream:
            start = stream.read(1 << 16)
    except OSError as error:
        raise Place(file, "file").unreadable(error) from error
    if start.startswith(_UTF16):
        raise Place(file, "file").error("it is text in UTF-16", "save it as text in UTF-8")
    if b"\0" in start:
        raise Place(file, "file").error("it is no text", "export the mesh as OBJ")
    found = ObjScan()
    found.has_mark = start.startswith(_MARK)
    found.needs_copy = found.has_mark or _has_old_line_ends(start)
    try:
        _Scan(file, found).run()
    except OSError as error:
        raise Place(file, "file").unreadable(error) from error
    found.needs_copy |= bool(found.offset.any()) or found.lost_normals > 0
    return found


def lines_of(file: Path) -> Iterator[tuple[int, bytes]]:
    """Number and text of each line without comment and white space around it, however the file ends
    its lines; those that a backslash joins are one."""
    with file.open("rb") as stream:
        start = stream.read(1 << 16)
        stream.seek(len(_MARK) if start.startswith(_MARK) else 0)
        source: Iterator[bytes] = stream
        if _has_old_line_ends(start):
            source = iter(stream.read().split(b"\r"))
        first, joined = 0, b""
        for number, line in enumerate(source, 1):
            text = line.strip()
            if text.startswith((b"#", b"v", b"f")):  # a name may hold the sign
                text = _COMMENT.split(text, maxsplit=1)[0]
            if text.endswith(b"\\") and not text.startswith((b"usemtl", b"mtllib", b"map")):
                first, joined = first or number, joined + text[:-1] + b" "
                continue
            yield first or number, joined + text
            first, joined = 0, b""


def write_copy(file: Path, found: ObjScan, target: Path) -> None:
    """The file as Blender reads it: with line ends of today, vertices near the origin, and without
    libraries, which are read here. Raises OSError."""
    with target.open("wb") as stream:
        for _, line in lines_of(file):
            word = (line.split(None, 1) or [b""])[0]
            if word == b"v" and found.offset.any():
                stream.write(_moved(line, found.offset))
            elif word == b"vn" and not _is_finite(line):
                stream.write(b"vn 0 0 0\n")
            elif word != b"mtllib":
                stream.write(line + b"\n")


def _has_old_line_ends(start: bytes) -> bool:
    return b"\r" in start and b"\n" not in start


def _moved(line: bytes, offset: np.ndarray) -> bytes:
    parts = line.split()
    place = [float(part) - shift for part, shift in zip(parts[1:4], offset, strict=True)]
    numbers = " ".join(repr(float(value)) for value in place)
    return b" ".join([b"v", numbers.encode(), *parts[4:]]) + b"\n"


def _is_finite(line: bytes) -> bool:
    try:
        return bool(np.isfinite([float(part) for part in line.split()[1:4]]).all())
    except ValueError:
        return False


class _Scan:
    """One reading. Lines wait in blocks, as numbers are checked faster together."""

    def __init__(self, file: Path, found: ObjScan) -> None:
        self._file, self._found = file, found
        self._counts = dict.fromkeys(_NUMBERS, 0)
        self._waiting: dict[bytes, list[tuple[int, bytes]]] = {word: [] for word in _NUMBERS}
        #: Number, corners, and how many vertices, coordinates and normals came before.
        self._faces: list[tuple[int, list[bytes], tuple[int, ...]]] = []

    def run(self) -> None:
        """Raises ReconstructionError, OSError."""
        for number, line in lines_of(self._file):
            parts = line.split(None, 1)
            word = parts[0] if parts else b""
            if word in _NUMBERS:
                self._counts[word] += 1
                waiting = self._waiting[word]
                waiting.append((number, line))
                if len(waiting) >= _BLOCK:
                    self._check_numbers(word)
            elif word == b"f":
                corners = parts[1].split() if len(parts) > 1 else []
                self._faces.append((number, corners, tuple(self._counts.values())))
                if len(self._faces) >= _BLOCK:
                    self._check_faces()
            elif word in (b"usemtl", b"mtllib") and len(parts) > 1:
                self._note(word, parts[1].decode("utf-8", "replace").strip())
        for word in _NUMBERS:
            self._check_numbers(word)
        self._check_faces()

    def _note(self, word: bytes, name: str) -> None:
        names = self._found.materials if word == b"usemtl" else self._found.libraries
        if name not in names:
            names.append(name)

    def _check_numbers(self, word: bytes) -> None:
        waiting, self._waiting[word] = self._waiting[word], []
        if not waiting:
            return
        least = _NUMBERS[word]
        words = b" ".join(line for _, line in waiting).split()
        width = len(words) // len(waiting)
        whole = width > least and width * len(waiting) == len(words)
        if whole and all(first == word for first in words[::width]):
            try:
                block = np.array(words).reshape(-1, width)[:, 1 : 1 + max(least, min(2, width - 1))]
                if (np.abs(block.astype(np.float64)) <= _LARGEST).all():  # false for NaN
                    self._note_offset(word, waiting[0][1])
                    return
            except ValueError:
                pass  # line by line, to name the one
        for number, line in waiting:
            self._check_line(word, number, line)
        self._note_offset(word, waiting[0][1])

    def _check_line(self, word: bytes, number: int, line: bytes) -> None:
        parts = line.split()[1:]
        if len(parts) < _NUMBERS[word]:
            cause = f"a {_WHAT[word]} has {len(parts)} numbers; it needs {_NUMBERS[word]}"
            raise self._error(number, cause)
        for part in parts[: 2 if word == b"vt" else 3]:
            text = shortened(part.decode("utf-8", "replace"))
            try:
                value = float(part)
            except ValueError:
                if b"," in part:
                    cure = "export it with points in its numbers"
                    raise self._error(number, f"'{text}' has a decimal comma", cure) from None
                if word != b"vn":
                    raise self._error(number, f"'{text}' is no number") from None
                value = np.nan
            if abs(value) <= _LARGEST:
                continue
            if word != b"vn":
                raise self._error(number, f"'{text}' is no finite number")
            self._found.lost_normals += 1  # a face without area has none
            return

    def _note_offset(self, word: bytes, line: bytes) -> None:
        """Of the first vertex."""
        if word != b"v" or self._found.offset.any() or self._counts[b"v"] > _BLOCK:
            return
        place = np.array([float(part) for part in line.split()[1:4]])
        if np.abs(place).max() > _NEAR:
            self._found.offset = np.round(place)

    def _check_faces(self) -> None:
        faces, self._faces = self._faces, []
        if not faces:
            return
        lengths = np.array([len(corners) for _, corners, _ in faces])
        if (lengths < 3).any():
            number, corners, _ = faces[int(np.argmax(lengths < 3))]
            raise self._error(number, f"a face has {len(corners)} corners; it needs 3")
        split = [corner.split(b"/") for _, corners, _ in faces for corner in corners]
        face_of = np.repeat(np.arange(len(faces)), lengths)
        for place, word in enumerate(_NUMBERS):
            # Empty between slashes: the corner has none.
            named = [
                parts[place] if len(parts) > place and parts[place] else b"" for parts in split
            ]
            has = np.array([bool(text) for text in named])
            if place == 0 and not has.all():
                has[:] = True
            before = np.array([counts[place] for _, _, counts in faces])[face_of[has]]
            try:
                index = np.array([text for text in named if text or place == 0]).astype(np.int64)
            except (ValueError, OverflowError):
                self._raise_no_index(faces, place)
                continue
            low = np.where(index < 0, index + before, index - 1)
            bad = (low < 0) | (low >= before)
            if bad.any():
                at = int(np.argmax(bad))
                number = faces[int(face_of[has][at])][0]
                cause = f"a face names {_WHAT[word]} {index[at]}, and {before[at]} are there"
                raise self._error(number, cause)

    def _raise_no_index(
        self, faces: list[tuple[int, list[bytes], tuple[int, ...]]], place: int
    ) -> None:
        for number, corners, _ in faces:
            for corner in corners:
                parts = corner.split(b"/")
                text = parts[place] if len(parts) > place else b""
                if not text and place:
                    continue
                try:
                    int(text)
                except ValueError:
                    shown = shortened(corner.decode("utf-8", "replace"))
                    raise self._error(number, f"'{shown}' is no corner of a face") from None

    def _error(
        self, number: int, cause: str, cure: str = "export the mesh again"
    ) -> ReconstructionError:
        return Place(self._file, f"line {number}").error(cause, cure)
