# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of static libraries for macOS stay inside what is linked."""

from __future__ import annotations

import struct
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "devtools"))

import mach_o  # noqa: E402

UNDEFINED, SEEN, INSIDE, HIDDEN, DEBUG = 0x01, 0x0F, 0x0E, 0x1F, 0x64
KINDS = (SEEN, UNDEFINED, INSIDE, HIDDEN, DEBUG, SEEN)


def object_file(kinds: tuple[int, ...]) -> bytes:
    """With another command in front of the symbol table, and no code."""
    commands = struct.pack("<IIQ", 0x32, 16, 0)
    commands += struct.pack("<IIIIII", 2, 24, 32 + 40, len(kinds), 0, 0)
    header = struct.pack("<IIIIIIII", 0xFEEDFACF, 0x0100000C, 0, 1, 2, len(commands), 0, 0)
    return header + commands + b"".join(struct.pack("<IBBHQ", 1, kind, 1, 0, 0) for kind in kinds)


def archive_of(*members: tuple[bytes, bytes]) -> bytes:
    result = mach_o.ARCHIVE
    for name, data in members:
        result += name.ljust(48) + str(len(data)).encode().ljust(10) + b"`\n" + data
        result += b"\n" * (len(result) % 2)
    return result


def test_defined_names_become_private_and_nothing_else_changes(tmp_path: Path) -> None:
    long_name = b"a long name of a member.o"
    path = tmp_path / "libmade.a"

    def members(kinds: tuple[int, ...]) -> bytes:
        made = object_file(kinds)
        named = (b"#1/%d" % len(long_name), long_name + made)
        return archive_of((b"/", b"index"), (b"plain.o/", made), named)

    path.write_bytes(members(KINDS))
    assert mach_o.hide_names(path) == 4
    assert path.read_bytes() == members((HIDDEN, UNDEFINED, INSIDE, HIDDEN, DEBUG, HIDDEN))
    assert mach_o.hide_names(path) == 0


def test_what_is_no_archive_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.a"
    path.write_bytes(b"text")
    with pytest.raises(ValueError, match="no archive"):
        mach_o.hide_names(path)
