# SPDX-License-Identifier: GPL-3.0-or-later
"""Text files whose lines are words, read one line at a time."""

from __future__ import annotations

import io
from codecs import BOM_UTF8
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from .files import MOST_BINARY, Place, read_bytes, size_of

#: Bytes of one line: an image with half a million features.
LONGEST_LINE = 32 << 20
#: Bytes that show how lines end.
_START = 1 << 16


def word_lines(file: Path, triples_follow: bool = False) -> Iterator[tuple[list[str], Place]]:
    """Words of each line that is neither empty nor a comment (#), and where it is; with
    `triples_follow`, the line after such a one is skipped, which has to be empty or to hold triples
    that end with a whole number. Raises ReconstructionError."""
    lines = _lines(file)
    for line, place in lines:
        try:
            words = line.decode("utf-8").split()
        except UnicodeDecodeError as error:
            raise place.error("it is no text in UTF-8") from error
        if not words or words[0].startswith("#"):
            continue
        yield words, place
        if triples_follow:
            following, after = next(lines, (b"", place))
            if not _are_triples(following):
                raise after.error(
                    "it is not that of the features, which every image has after its own",
                    "write an empty line after that of each image",
                )


def _lines(file: Path) -> Iterator[tuple[bytes, Place]]:
    """Each line, without a byte order mark, and where it is. Raises ReconstructionError."""
    size_of(file, MOST_BINARY)
    try:
        with file.open("rb") as opened:
            stream: IO[bytes] = opened
            start = opened.read(_START)
            opened.seek(0)
            if b"\r" in start and b"\n" not in start:  # as old Macintoshes end their lines
                stream = io.BytesIO(read_bytes(file).replace(b"\r", b"\n"))
            count = 0
            while line := stream.readline(LONGEST_LINE + 1):
                count += 1
                place = Place(file, f"line {count}")
                if len(line) > LONGEST_LINE:
                    raise place.error(f"it is longer than {LONGEST_LINE >> 20} MiB")
                yield (line.removeprefix(BOM_UTF8) if count == 1 else line), place
    except OSError as error:
        raise Place(file, "file").unreadable(error) from error


def _are_triples(line: bytes) -> bool:
    words = line.split()
    return not words or (len(words) % 3 == 0 and words[-1].lstrip(b"-").isdigit())
