# SPDX-License-Identifier: GPL-3.0-or-later
"""How a process ends that has Blender inside."""

from __future__ import annotations

import os
import sys
from typing import NoReturn


def end_process(status: int) -> NoReturn:
    """Ends this process at once, as bpy can hang in its own destructors.

    On Windows os._exit is not enough: it ends the other threads, and then every library cleans up
    and may wait for a lock that one of them held.
    """
    if sys.platform == "win32":
        import ctypes

        this_process = ctypes.c_void_p(-1)
        ctypes.WinDLL("kernel32").TerminateProcess(this_process, status)
    os._exit(status)
