# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands of Selenite in this process, beside the scene that is open in it."""

from __future__ import annotations

import contextlib
import io
import json
from typing import Any

from selenite.cli import main


def report_of(*words: str) -> dict[str, Any]:
    """The JSON object that a command prints. Raises RuntimeError where it fails."""
    out, log = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(log):
        status = main([*words, "--json"])
    if status:
        raise RuntimeError(f"selenite {' '.join(words)}: {log.getvalue()}")
    found: dict[str, Any] = json.loads(out.getvalue().strip().splitlines()[-1])
    return found
