# SPDX-License-Identifier: GPL-3.0-or-later
"""One command as the work of a process that `scene_read.blender_process` starts for the panel."""

from __future__ import annotations

import _thread
import importlib
import os
import signal
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from ..scene_read.blender_process import STOP
from .parser import build_parser
from .terminal import heard

#: Seconds between two looks for the wish to stop.
_POLL = 0.2


def run(
    folder: Path, request: Mapping[str, Sequence[str]], note: Callable[[float, str], None]
) -> dict[str, object]:
    """Runs the command of `words`; its report under "command", as a part of it may have failed. An
    empty report: it was stopped before it had anything. Raises BadInput, and what the command
    raises."""
    args = build_parser().parse_args(request["words"])
    args.parser = build_parser()
    command = importlib.import_module(args.module, __package__.rpartition(".")[0])
    with heard(note), suppress(KeyboardInterrupt), _interrupted_by(folder / STOP):
        return {"command": dict(command.run(args))}
    return {}


@contextmanager
def _interrupted_by(file: Path) -> Iterator[None]:
    """A file that appears, or the end of who has started the process, is what Ctrl+C is in a
    terminal."""
    ended, parent = threading.Event(), os.getppid()

    def watch() -> None:
        while not ended.wait(_POLL):
            if file.exists() or os.getppid() != parent:
                _thread.interrupt_main()
                return

    # Blender has a handler of its own, which ends the process.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    try:
        yield
    finally:
        ended.set()
        watcher.join()
