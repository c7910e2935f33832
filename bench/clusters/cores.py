# SPDX-License-Identifier: GPL-3.0-or-later
"""What runs in workers, which have no Blender."""

from __future__ import annotations

import os
from pathlib import Path


def pin(core: int) -> None:
    """Keeps this process to a core: a worker of one. On Linux."""
    for thread in Path("/proc/self/task").iterdir():
        os.sched_setaffinity(int(thread.name), {core})
