# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects of macOS: names that other libraries of a process must not see.

The linker for macOS has no list of what a library exports, and some libraries ask for all their
names to be seen. In an object each name can say that it stays inside what is linked.
"""

from __future__ import annotations

import struct
import sys
from collections.abc import Iterator
from pathlib import Path

ARCHIVE = b"!<arch>\n"
MAGIC = b"\xcf\xfa\xed\xfe"  # of 64 bits
_SYMBOL_TABLE = 2  # the load command
_HEADER, _SYMBOL = 32, 16  # bytes
# Of a symbol's kind: it is for a debugger, stays inside, is defined, is seen by other objects
_DEBUG, _PRIVATE, _DEFINED, _SEEN = 0xE0, 0x10, 0x0E, 0x01


def hide_names(archive: Path) -> int:
    """Keeps all names that a static library defines inside what it is linked into; how many."""
    data = bytearray(archive.read_bytes())
    count = sum(_hide(data, start) for start in _objects(data))
    if count:
        archive.write_bytes(data)
    return count


def _objects(archive: bytearray) -> Iterator[int]:
    """Where the objects of an archive begin."""
    if not archive.startswith(ARCHIVE):
        raise ValueError("no archive")
    at = len(ARCHIVE)
    while at + 60 <= len(archive):
        name = archive[at : at + 16].decode()
        start = at + 60 + (int(name[3:]) if name.startswith("#1/") else 0)
        if archive[start : start + 4] == MAGIC:
            yield start
        at += 60 + int(archive[at + 48 : at + 58])
        at += at % 2


def _hide(data: bytearray, start: int) -> int:
    (commands,) = struct.unpack_from("<I", data, start + 16)
    at, count = start + _HEADER, 0
    for _ in range(commands):
        command, size = struct.unpack_from("<II", data, at)
        if command == _SYMBOL_TABLE:
            offset, symbols = struct.unpack_from("<II", data, at + 8)
            for place in range(start + offset + 4, start + offset + 4 + symbols * _SYMBOL, _SYMBOL):
                kind = data[place]
                if kind & _SEEN and kind & _DEFINED and not kind & (_DEBUG | _PRIVATE):
                    data[place] |= _PRIVATE
                    count += 1
        at += size
    return count


if __name__ == "__main__":
    for name in sys.argv[1:]:
        hide_names(Path(name))
