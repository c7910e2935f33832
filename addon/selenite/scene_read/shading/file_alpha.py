# SPDX-License-Identifier: GPL-3.0-or-later
"""What the header of an image file says about its channels and its alpha.

Cycles reads files anew and goes by them alone, whatever Blender's alpha mode says: colours are
multiplied by alpha where the file has four channels and says that they were not.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

#: Bytes before the picture that are read: headers lie at the front, those of TIFF where it says.
_HEAD = 1 << 16
_PNG_CHANNELS = {0: 1, 2: 3, 3: 3, 4: 2, 6: 4}
_SAMPLES, _EXTRA_SAMPLES, _STRAIGHT = 277, 338, 2
_TGA_SIGNATURE, _TGA_PREMULTIPLIED = b"TRUEVISION-XFILE", 4


@dataclass(frozen=True)
class FileAlpha:
    """`channels`: of the file as OpenImageIO gives them, alpha included; 0: not known.
    `associated`: the file says that its colours were multiplied by alpha."""

    channels: int
    associated: bool


def read(path: str) -> FileAlpha:
    """By content, not by name. Raises OSError; a damaged header counts as an unknown one."""
    with Path(path).open("rb") as file:
        head = file.read(_HEAD)
        if head.startswith(b"\x89PNG\r\n\x1a\n"):
            return FileAlpha(_png_channels(head), associated=False)
        if head[:4] == b"\x76\x2f\x31\x01":
            return FileAlpha(0, associated=True)
        if head[:4] in {b"II*\0", b"MM\0*"} and len(head) >= 8:
            order = "<" if head.startswith(b"II") else ">"
            (offset,) = struct.unpack_from(f"{order}I", head, 4)
            file.seek(offset)
            return _tiff_alpha(file.read(_HEAD), order)
        size = file.seek(0, 2)
        file.seek(max(size - 26, 0))
        footer = file.read(26)
        if len(footer) == 26 and footer[8:24] == _TGA_SIGNATURE:
            (extension,) = struct.unpack_from("<I", footer)
            file.seek(extension + 494 if extension else size)
            return FileAlpha(0, associated=file.read(1) == bytes([_TGA_PREMULTIPLIED]))
    return FileAlpha(0, associated=False)


def _png_channels(head: bytes) -> int:
    """A transparent colour or a palette with alpha (chunk tRNS) counts as a channel."""
    channels = _PNG_CHANNELS.get(head[25] if len(head) > 25 else -1, 0)
    at = 8
    while at + 8 <= len(head):
        (length,), kind = struct.unpack_from(">I", head, at), head[at + 4 : at + 8]
        if kind == b"tRNS":
            return channels + 1
        if kind == b"IDAT":
            break
        at += length + 12
    return channels


def _tiff_alpha(directory: bytes, order: str) -> FileAlpha:
    """From the first image file directory. Both tags are short integers, held in the entry."""
    samples, extra = 1, _STRAIGHT
    (count,) = struct.unpack_from(f"{order}H", directory) if len(directory) > 1 else (0,)
    for number in range(count):
        entry = directory[2 + 12 * number : 14 + 12 * number]
        if len(entry) < 12:
            break
        tag, _, _, value = struct.unpack(f"{order}HHIH", entry[:10])
        if tag == _SAMPLES:
            samples = value
        elif tag == _EXTRA_SAMPLES:
            extra = value
    # A sample of which nothing is said counts as alpha that the colours were multiplied by.
    return FileAlpha(samples, extra != _STRAIGHT)
