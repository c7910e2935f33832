# SPDX-License-Identifier: GPL-3.0-or-later
"""A process that has Blender inside ends without cleaning up."""

import subprocess
import sys

import pytest

PROGRAM = """
import atexit, threading
from selenite.process_end import end_process
atexit.register(print, "cleaned up")
threading.Thread(target=threading.Event().wait).start()
end_process({})
"""


@pytest.mark.parametrize("status", [0, 1, 2])
def test_a_process_ends_at_once_with_its_status(status: int) -> None:
    ended = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(status)], capture_output=True, timeout=60, check=False
    )
    assert (ended.returncode, ended.stdout, ended.stderr) == (status, b"", b"")
