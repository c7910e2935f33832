# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos and masks as files: what their headers say, and why one cannot be read."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from .. import native
from ..problems import Problem
from .request import PACKED

if TYPE_CHECKING:
    from .._image import PictureInfo

#: Of the shapes of mask and photo, as in the native reader.
MASK_TOLERANCE = 0.05
READABLE = "give a whole PNG, JPEG, TIFF, OpenEXR or HDR file"


def header(
    title: str,
    name: str,
    problems: list[Problem],
    packed: Mapping[str, bytes],
    *,
    as_linear: bool,
) -> PictureInfo | None:
    """What the header of a photo or mask says; None, with a problem, if it cannot be read."""
    if not name.startswith(PACKED) and not Path(name).is_file():
        problems.append(Problem(title, "the file does not exist", "correct the path"))
        return None
    if name.startswith(PACKED) and name not in packed:
        problems.append(Problem(title, "the scene has no such image", "choose another photo"))
        return None
    try:
        with as_file(name, packed) as path:
            return native.image().probe(path, as_linear=as_linear)
    except (OSError, ValueError, MemoryError) as error:
        problems.append(unreadable(title, error))
        return None


def unreadable(title: str, error: Exception) -> Problem:
    """Of the native reader, whose messages are: path in quotes, cause; cure."""
    text = re.sub(r"^'.*?' ", "it ", str(error), count=1)
    cause, _, cure = text.rpartition("; ")
    if not cause:
        cause, cure = text or type(error).__name__, READABLE
    return Problem(title, f"cannot be read: {cause}", cure)


@contextmanager
def as_file(name: str, packed: Mapping[str, bytes]) -> Iterator[str]:
    """The path of a photo; of a packed one, that of a copy which lasts as long as the block."""
    if name not in packed:
        yield name
        return
    with tempfile.TemporaryDirectory(prefix="selenite-") as folder:
        path = Path(folder) / "photo"
        path.write_bytes(packed[name])
        yield str(path)


def same_aspect(first: tuple[int, int], second: tuple[int, int], most: float = 1.0) -> bool:
    """Equal up to one pixel of the smaller picture, since sizes are whole numbers, and `most`."""
    ratio = first[0] * second[1] / (first[1] * second[0])
    return abs(ratio - 1) <= min(most, 1.0 / min(*first, *second))


def pixels(size: tuple[int, int]) -> str:
    """(width, height) in words."""
    return f"{size[0]} x {size[1]} pixels"
