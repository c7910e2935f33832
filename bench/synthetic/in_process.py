# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands of Selenite in this process, beside the scene that is open in it."""

from __future__ import annotations

import contextlib
import io
import json
import os
import sys
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
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


def print_rows(
    header: str, names: Iterable[str], row_of: Callable[[str, Path], str], kept: str | None
) -> None:
    """A table, a row for each name, in which nothing is that Blender prints. kept: the folder of
    the rows, None for one that is removed at the end."""
    table = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    columns = header.count("|") - 1
    print(f"{header}\n|{'---|' * columns}", file=table, flush=True)
    with tempfile.TemporaryDirectory(prefix="selenite-rows-") as place:
        folder = Path(kept or place)
        folder.mkdir(exist_ok=True)
        for name in names:
            print(row_of(name, folder), file=table, flush=True)
