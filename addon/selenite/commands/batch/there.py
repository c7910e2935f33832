# SPDX-License-Identifier: GPL-3.0-or-later
"""A fit of a batch in a process that a worker of a cluster starts."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from distributed import Client

_CHILD = Path(__file__).parents[2] / "command_process.py"
#: Seconds between two looks at a process.
_POLL = 0.2
#: Exit status of words that are refused.
_REFUSED = 2


@dataclass(frozen=True)
class Task:
    """fresh, resumed: the words of a fit, and those with which it goes on; None: it does not. All
    paths are of a file system that the workers share."""

    fresh: tuple[str, ...]
    resumed: tuple[str, ...] | None
    folder: str
    home: str
    log: str

    @property
    def stop(self) -> Path:
        """The file that ends it."""
        return Path(f"{self.log}.stop")


def run_there(task: Task, processes: int, suffix: str) -> tuple[int, bytes]:
    """Exit status and output of the fit. processes: workers of this machine; suffix: of the folder
    of a run that was interrupted, as where a worker has died, which goes on."""
    from distributed import get_worker

    at_once = max(1, get_worker().state.nthreads) * processes
    share = [f"--threads={max(1, (os.cpu_count() or 1) // at_once)}"]
    folder = Path(task.folder)
    unfinished = sorted(folder.glob(f"*{suffix}")) if folder.is_dir() else []
    if unfinished and task.resumed is not None:
        found = _to_end(task, [*task.resumed, f"--resume={unfinished[-1]}", *share])
        if found[0] != _REFUSED:  # else its photos or its scene are others now
            return found
    given = any(word.startswith("--threads") for word in task.fresh)
    return _to_end(task, [*task.fresh, *([] if given else share)])


def _to_end(task: Task, words: Sequence[str]) -> tuple[int, bytes]:
    with tempfile.TemporaryDirectory(prefix="selenite-batch-", ignore_cleanup_errors=True) as name:
        place = Path(name)
        request = place / "request.json"
        asked = {"words": list(words), "python_path": sys.path, "ends_with_parent": True}
        request.write_text(json.dumps(asked))
        with (place / "out").open("wb") as out, Path(task.log).open("ab") as log:
            process = subprocess.Popen(
                [sys.executable, str(_CHILD), str(request)], cwd=task.home, stdin=subprocess.PIPE,
                stdout=out, stderr=log, env={**os.environ, "TMPDIR": name},
            )  # fmt: skip
            while process.poll() is None:
                if task.stop.exists():
                    process.kill()
                time.sleep(_POLL)
        return process.returncode, (place / "out").read_bytes()


class ThereProcess:
    """The same as the batch sees it: like a process of its own."""

    def __init__(self, client: Client, task: Task, processes: int, suffix: str, out: Path) -> None:
        """out: gets the output at the end."""
        self.returncode: int | None = None
        self._task, self._out = task, out
        task.stop.unlink(missing_ok=True)
        Path(task.log).write_bytes(b"")
        self._future = client.submit(run_there, task, processes, suffix, pure=False, retries=2)

    def poll(self) -> int | None:
        """The exit status; None while it runs."""
        if self.returncode is None and self._future.done():
            try:
                self.returncode, found = self._future.result()
            except Exception as error:
                self.returncode = 1
                found = json.dumps({"error": f"its worker failed: {error}"}).encode()
            self._out.write_bytes(found)
            with suppress(OSError):
                self._task.stop.unlink(missing_ok=True)
        return self.returncode

    def kill(self) -> None:
        """Asks the worker to end it."""
        self._task.stop.touch()

    def wait(self) -> None:
        """Until it has ended."""
        while self.poll() is None:
            time.sleep(_POLL)
