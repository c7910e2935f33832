# SPDX-License-Identifier: GPL-3.0-or-later
"""Breaks files at random, the same way for the same generator."""

from __future__ import annotations

import random
import struct
import zlib

INTERESTING = (
    0, 1, 2, 3, 7, 8, 15, 16, 31, 32, 64, 127, 128, 255, 256, 511, 512, 1023, 1024, 4096, 9999,
    32767, 32768, 65535, 65536, 1 << 20, (1 << 31) - 1, 1 << 31, (1 << 32) - 1,
)  # fmt: skip
PNG = b"\x89PNG\r\n\x1a\n"


def mutated(data: bytes, other: bytes, rng: random.Random) -> bytes:
    """`data` with one to six changes, pieces of `other` among them."""
    result = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 3, 6))):
        if not result:
            break
        _change(result, other, rng)
    broken = bytes(result)
    return with_checksums(broken) if broken.startswith(PNG) and rng.random() < 0.5 else broken


def _change(data: bytearray, other: bytes, rng: random.Random) -> None:
    # Headers are what decides: every other change falls into the first 512 bytes.
    end = len(data) if rng.random() < 0.5 else min(512, len(data))
    at = rng.randrange(end)
    kind = rng.randrange(8)
    if kind == 0:
        data[at] ^= 1 << rng.randrange(8)
    elif kind == 1:
        data[at] = rng.choice((0, 1, 127, 128, 254, 255, rng.randrange(256)))
    elif kind in (2, 3):
        form = rng.choice(("<H", ">H", "<I", ">I", "<Q"))
        size = struct.calcsize(form)
        value = rng.choice(INTERESTING) % (1 << 8 * size)
        data[at : at + size] = struct.pack(form, value)
    elif kind == 4:
        del data[at : at + rng.randrange(1, 65)]
    elif kind == 5:
        piece = data[at : at + rng.randrange(1, 65)]
        data[at:at] = piece
    elif kind == 6:
        first = rng.randrange(len(other)) if other else 0
        piece = other[first : first + rng.randrange(1, 257)]
        data[at : at + len(piece)] = piece
    elif rng.random() < 0.3:
        del data[at:]


def with_checksums(data: bytes) -> bytes:
    """A PNG whose chunks have the checksums that their bytes ask for, as far as it can be read."""
    result, at = bytearray(data[:8]), 8
    while at + 12 <= len(data):
        (length,) = struct.unpack_from(">I", data, at)
        body = data[at + 4 : at + 8 + length]
        if at + 12 + length > len(data):
            break
        result += data[at : at + 4] + body + struct.pack(">I", zlib.crc32(body))
        at += 12 + length
    return bytes(result) + data[at:]
