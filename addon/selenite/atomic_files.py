# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that appear whole under their name or not at all, even if the machine stops meanwhile."""

from __future__ import annotations

import os
import secrets
import time
from collections.abc import Mapping
from pathlib import Path

from .json_text import json_text

#: What `partial_name` returns, for glob.
PARTIAL = ".selenite-*.partial"
_WINDOWS = os.name == "nt"
_PATIENCE = 3.0


def partial_name(path: Path) -> Path:
    """Of a file until it is whole, in the same folder: hidden, its own, and short, as that of
    `path` may be as long as a file system permits."""
    return path.with_name(f".selenite-{secrets.token_hex(8)}.partial")


def take_place(partial: Path, target: Path) -> None:
    """Renames a file or folder; a file that was there is gone. Raises OSError.

    Windows refuses that while another program has either open, as those do that look for viruses
    or copy to a cloud: it is tried again for `_PATIENCE` seconds.
    """
    ends = time.monotonic() + _PATIENCE
    while True:
        try:
            partial.replace(target)
        except PermissionError:
            if not _WINDOWS or time.monotonic() > ends:
                raise
            time.sleep(0.05)
        else:
            return


def write_bytes(path: Path, data: bytes) -> None:
    """Writes beside `path` and renames; what stood there stays until then. Raises OSError."""
    partial = partial_name(path)
    try:
        partial.write_bytes(data)
        keep(partial, path)
    finally:
        partial.unlink(missing_ok=True)


def keep(partial: Path, path: Path) -> None:
    """Gives a file that is whole its name, once the disk has it. Raises OSError."""
    with partial.open("r+b") as file:
        os.fsync(file.fileno())
    take_place(partial, path)


def write_json(path: Path, data: Mapping[str, object]) -> None:
    """The same for one JSON object; see `json_text`. Raises OSError."""
    write_bytes(path, (json_text(data, indent=1) + "\n").encode())
