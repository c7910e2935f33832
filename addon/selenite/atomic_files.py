# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that appear whole under their name or not at all, even if the machine stops meanwhile."""

from __future__ import annotations

import os
import secrets
from collections.abc import Mapping
from pathlib import Path

from .json_text import json_text


def partial_name(path: Path) -> Path:
    """Of a file until it is whole, in the same folder: hidden, its own, and short, as that of
    `path` may be as long as a file system permits."""
    return path.with_name(f".selenite-{secrets.token_hex(8)}.partial")


def write_bytes(path: Path, data: bytes) -> None:
    """Writes beside `path` and renames; what stood there stays until then. Raises OSError."""
    partial = partial_name(path)
    try:
        with partial.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def write_json(path: Path, data: Mapping[str, object]) -> None:
    """The same for one JSON object; see `json_text`. Raises OSError."""
    write_bytes(path, (json_text(data, indent=1) + "\n").encode())
