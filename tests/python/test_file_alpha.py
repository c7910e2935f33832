# SPDX-License-Identifier: GPL-3.0-or-later
"""What headers of image files say about alpha. (Against Cycles: blender_tests.)"""

from __future__ import annotations

import random
import struct
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "addon"))

from selenite.scene_read.shading.file_alpha import FileAlpha, read  # noqa: E402


def png(kind: int, *chunks: bytes) -> bytes:
    header = struct.pack(">IIBBBBB", 1, 1, 8, kind, 0, 0, 0)
    blocks = [b"IHDR" + header, *chunks, b"IDAT", b"tRNS\0"]  # what follows IDAT does not count
    body = b"".join(struct.pack(">I", len(block) - 4) + block + bytes(4) for block in blocks)
    return b"\x89PNG\r\n\x1a\n" + body


def tiff(order: str, samples: int, extra: int | None) -> bytes:
    rows = [(256, 1), (277, samples), *([(338, extra)] if extra is not None else [])]
    entries = b"".join(struct.pack(f"{order}HHIHH", tag, 3, 1, value, 0) for tag, value in rows)
    head = (b"II" if order == "<" else b"MM") + struct.pack(f"{order}HI", 42, 16)
    return head + bytes(8) + struct.pack(f"{order}H", len(rows)) + entries + bytes(4)


def tga(kind: int | None) -> bytes:
    area = b"" if kind is None else struct.pack("<H", 495) + bytes(492) + bytes([kind])
    footer = struct.pack("<II", 18 if area else 0, 0) + b"TRUEVISION-XFILE.\0"
    return bytes(18) + area + footer


FILES = {
    "grey": (png(0), FileAlpha(1, False)),
    "grey transparent": (png(0, b"tRNS\0\1"), FileAlpha(2, False)),
    "palette": (png(3, b"PLTE\0\0\0"), FileAlpha(3, False)),
    "palette transparent": (png(3, b"PLTE\0\0\0", b"tRNS\0"), FileAlpha(4, False)),
    "grey alpha": (png(4), FileAlpha(2, False)),
    "rgba": (png(6), FileAlpha(4, False)),
    "exr": (b"\x76\x2f\x31\x01" + bytes(50), FileAlpha(0, True)),
    "tiff": (tiff("<", 3, None), FileAlpha(3, False)),
    "tiff associated": (tiff("<", 4, 1), FileAlpha(4, True)),
    "tiff unspecified": (tiff("<", 4, 0), FileAlpha(4, True)),
    "tiff straight, big endian": (tiff(">", 2, 2), FileAlpha(2, False)),
    "tiff associated, big endian": (tiff(">", 4, 1), FileAlpha(4, True)),
    "tga": (tga(None), FileAlpha(0, False)),
    "tga straight": (tga(3), FileAlpha(0, False)),
    "tga associated": (tga(4), FileAlpha(0, True)),
    "jpeg": (b"\xff\xd8\xff\xe0" + bytes(80), FileAlpha(0, False)),
    "empty": (b"", FileAlpha(0, False)),
}


@pytest.mark.parametrize("name", FILES)
def test_headers(tmp_path: Path, name: str) -> None:
    content, expected = FILES[name]
    path = tmp_path / "image.with.another.ending"
    path.write_bytes(content)
    assert read(str(path)) == expected


def test_damaged_headers_are_read_without_an_error(tmp_path: Path) -> None:
    chance = random.Random(3)
    path = tmp_path / "image"
    for content, _ in FILES.values():
        for _ in range(60):
            damaged = bytearray(content[: chance.randint(0, len(content))])
            for _ in range(chance.randint(0, 3)):
                if len(damaged) > 8:
                    damaged[chance.randrange(4, len(damaged))] = chance.randrange(256)
            path.write_bytes(damaged)
            assert read(str(path)).channels in range(65536)


def test_a_file_that_is_gone_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="No such file"):
        read(str(tmp_path / "none.png"))
