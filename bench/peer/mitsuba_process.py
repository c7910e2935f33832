# SPDX-License-Identifier: GPL-3.0-or-later
"""Mitsuba 3 in a process of its own, from the side that cannot import it."""

import json
import os
import subprocess
import sys
from pathlib import Path


class Mitsuba:
    """A script of this folder that answers requests, a line of JSON each."""

    def __init__(self, python, script, *arguments):
        command = [str(word) for word in (python, Path(__file__).parent / script, *arguments)]
        # The folder may be read-only: no compiled copies of what is imported there.
        environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(
            command, stdin=pipe, stdout=pipe, text=True, bufsize=1, env=environment
        )

    def ask(self, **request):
        self.process.stdin.write(json.dumps(request) + "\n")
        line = self.process.stdout.readline()
        if not line:
            sys.exit(f"Mitsuba ended with status {self.process.wait()}")
        return json.loads(line)

    def close(self):
        self.process.stdin.close()
        self.process.wait(60)
