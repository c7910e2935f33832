# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps Blender quiet."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def without_words() -> Iterator[None]:
    """Keeps from the terminal the lines that Blender prints at each step of a render: it writes
    them past Python's sys.stdout."""
    sys.stdout.flush()
    kept, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)
