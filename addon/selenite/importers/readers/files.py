# SPDX-License-Identifier: GPL-3.0-or-later
"""Files as readers want them: of bounded size, below one folder, with a message for every fault."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from pathlib import Path

from ..reconstruction import ReconstructionError

GZIP = b"\x1f\x8b"
#: Bytes of a text or XML file, after decompression: scans of some three million triangles.
MOST_TEXT = 256 << 20
#: Bytes of a binary file that is read piece by piece.
MOST_BINARY = 4 << 30
EXPORT_AGAIN = "export it again"
_PATH_AND_RIGHTS = "check its path and rights"


@dataclass(frozen=True)
class Place:
    """Where in which file something stands, for messages."""

    file: Path
    element: str

    def error(self, cause: str, cure: str = EXPORT_AGAIN) -> ReconstructionError:
        """What to raise."""
        cause, cure = (" ".join(_printable(text).split()) for text in (cause, cure))
        return ReconstructionError(self.file, shortened(self.element, 120), cause, cure)

    def unreadable(self, error: Exception, cure: str = "check its rights") -> ReconstructionError:
        """What to raise where the system refuses."""
        return self.error(f"it cannot be read ({error})", cure)

    def at(self, element: str) -> Place:
        """Another element of the same file."""
        return Place(self.file, element)


def shortened(text: str, most: int = 60) -> str:
    """Text from a file, fit to be quoted in one line of a message."""
    line = " ".join(_printable(text[: 4 * most]).split())
    return line if len(line) <= most else line[: most - 1] + "…"


def _printable(text: str) -> str:
    return "".join(letter if letter.isprintable() else " " for letter in text)


def size_of(file: Path, most: int) -> int:
    """Bytes of a regular file. Raises ReconstructionError where it is none, or is too large."""
    place = Place(file, "file")
    if not is_file(file):
        raise place.error("it is not there, or no file", "give the path of a file")
    try:
        size = file.stat().st_size
    except OSError as error:
        raise place.unreadable(error, _PATH_AND_RIGHTS) from error
    if size > most:
        raise place.error(
            f"it has {size >> 20} MiB; at most {most >> 20} are read",
            "reduce the mesh or the points and export it again",
        )
    return size


def read_bytes(file: Path, most: int = MOST_TEXT) -> bytes:
    """The whole file, unpacked if it is gzip's. Raises ReconstructionError."""
    size_of(file, most)
    try:
        data = file.read_bytes()
    except (OSError, ValueError) as error:
        raise Place(file, "file").unreadable(error, _PATH_AND_RIGHTS) from error
    return _unpacked(file, data, most) if data.startswith(GZIP) else data


def _unpacked(file: Path, data: bytes, most: int) -> bytes:
    place = Place(file, "gzip")
    # 31: with gzip's header and checksum
    unpacker = zlib.decompressobj(31)
    try:
        unpacked = unpacker.decompress(data, most + 1)
    except zlib.error as error:
        raise place.error(f"its compression is broken ({error})") from error
    if len(unpacked) > most:
        raise place.error(
            f"it has more than {most >> 20} MiB unpacked",
            "reduce the mesh or the points and export it again",
        )
    if not unpacker.eof:
        raise place.error("it ends in the midst of its compression")
    return unpacked


def read_text(file: Path, most: int = MOST_TEXT) -> str:
    """The whole file as UTF-8, with or without a byte order mark, its lines ended by line feeds
    however the file ends them. Raises ReconstructionError."""
    try:
        text = read_bytes(file, most).decode("utf-8-sig")
        return text.replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        cause = f"it is no text in UTF-8 (byte {error.start})"
        raise Place(file, "file").error(cause, "export it as text in UTF-8") from error


def inside(folder: Path, name: str) -> Path | None:
    """The file of that name below `folder`, wherever links lead; None if it lies elsewhere or the
    name is none."""
    try:
        root = folder.resolve()
        found = (root / name).resolve()
    except (OSError, ValueError, RuntimeError):
        return None
    return found if found.is_relative_to(root) and found != root else None


def is_file(path: Path | None) -> bool:
    """As Path.is_file, which raises for some names out of a file."""
    try:
        return path is not None and path.is_file()
    except (OSError, ValueError):
        return False
