# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: `selenite`, `python -m selenite`, `blender --command selenite`.

Exit status: 0 done; 2 bad input (one line per problem on stderr, nothing written); 1 failure, in a
sentence. With --json stdout holds one JSON object; everything else goes to stderr.
"""

from __future__ import annotations

import argparse
import errno
import importlib
import io
import os
import shutil
import signal
import sys
import tempfile
import traceback
from collections.abc import Sequence
from contextlib import redirect_stdout, suppress
from pathlib import PurePath
from typing import TextIO

from . import __version__
from .commands import addon_settings
from .commands.grouping import grouped
from .commands.parser import build_parser
from .commands.terminal import say
from .json_text import json_text
from .native import NativeUnavailable
from .problems import BadInput, Failed, NotWritten, Problem, problems_in
from .process_end import end_process


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command and returns its exit status.

    Without `argv` it is the whole process: file descriptor 1 is kept for the JSON object, since
    Blender prints to it, and the process ends here, since bpy can hang in its own destructors.
    """
    if argv is None:
        status = run_as_process(sys.argv[1:])
        _remove_session()
        end_process(status)
    return _run(argv, sys.stdout)


def _remove_session() -> None:
    """The folder of temporary files that Blender, as a module, makes for each process."""
    bpy = sys.modules.get("bpy")
    folder = bpy.app.tempdir if bpy is not None else ""
    if PurePath(folder).name.startswith("blender_"):
        shutil.rmtree(folder, ignore_errors=True)


def run_as_process(argv: Sequence[str]) -> int:
    """Runs one command with file descriptor 1 reserved for the JSON object from now on. What asks
    the process to end is what Ctrl+C is, so that nothing is left behind."""
    closed = _fill_streams()
    for name in ("SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            with suppress(ValueError):  # not the main thread: whoever has it ends the process
                signal.signal(getattr(signal, name), _interrupt)
    json_out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    with suppress(OSError):
        sys.stdout.flush()
        os.dup2(2, 1)
    status = _run(argv, _Closed() if 1 in closed else json_out)
    for stream in (json_out, sys.stdout, sys.stderr):
        with suppress(OSError, AttributeError):
            stream.flush()
    with suppress(OSError):
        json_out.close()
    return status


def _interrupt(number: int, _frame: object) -> None:
    signal.signal(number, signal.SIG_DFL)  # a second one ends it at once
    raise KeyboardInterrupt


class _Closed(io.StringIO):
    """What stands for a stdout that was closed: for --help nobody reads, and no object arrives."""

    def flush(self) -> None:
        if self.getvalue():
            raise OSError(errno.EBADF, "stdout is closed")


def _fill_streams() -> set[int]:
    """The numbers of standard streams that are closed. They are opened to nowhere: else the next
    file would get the number, and what Blender prints would go into it."""
    closed = set()
    for number, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        try:
            os.fstat(number)
        except OSError:
            closed.add(number)
            os.open(os.devnull, os.O_RDWR)  # the lowest number that is free: this one
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(number, mode, closefd=False))
    return closed


def _run(argv: Sequence[str], json_out: TextIO) -> int:
    try:
        try:
            with redirect_stdout(json_out):  # for --help, which may go into a pipe
                args = build_parser().parse_args(argv)
        except SystemExit as stop:  # --help or --version
            json_out.flush()
            return int(stop.code or 0)
    except BrokenPipeError:  # who reads has seen enough
        return 0
    except OSError as error:
        say(f"selenite: the text cannot be written: {error}")
        return 1
    except BadInput as error:
        json_asked = any(len(word) > 2 and "--json".startswith(word) for word in argv)
        name = "selenite"
        return _report(name, {"problems": _as_json(error)}, json_out if json_asked else None)
    return _report(args.command, _done(args), json_out if args.json else None)


def _done(args: argparse.Namespace) -> dict[str, object]:
    """What the command reports; of one that fails the key "problems" or "error"."""
    args.parser = build_parser()
    try:
        return dict(importlib.import_module(args.module, __package__).run(args))
    except NotWritten as error:
        return {"error": "; ".join(problem.line() for problem in error.problems)}
    except BadInput as error:
        return {"problems": _as_json(error)}
    except (NativeUnavailable, Failed) as error:
        return {"error": str(error)}
    except KeyboardInterrupt:
        return {"error": "interrupted"}
    except ImportError as error:
        missing = {"bpy": _without_blender, "numpy": _without_numpy}.get(error.name or "")
        if missing is None:
            return {"error": _internal(error)}
        return {"problems": _as_json(BadInput(missing(error)))}
    except MemoryError:
        cure = "give smaller sizes, fewer photos or smaller grids, or close other programs"
        return {"error": f"the computer's memory does not suffice; {cure}"}
    except OSError as error:
        if error.strerror is None:  # the native module's own sentence
            return {"error": str(error)}
        name = f"File '{error.filename}': " if error.filename else ""
        cure = "see that it is there, may be used, and that its disk has room"
        return {"error": f"{name}{error.strerror.lower()}; {cure}"}
    except Exception as error:  # the last net: no input should come this far
        return {"error": _internal(error)}
    finally:
        addon_settings.release()


def _without_blender(error: ImportError) -> Problem:
    version = "4.5.15" if sys.version_info < (3, 13) else "5.2.3"
    cure = (
        "run 'blender --command selenite' (Blender 4.2 or newer) in place of 'selenite', or "
        f"install Blender as a module: pip install bpy=={version}"
    )
    return Problem("Blender", f"this command needs it, and bpy does not load ({error})", cure)


def _without_numpy(error: ImportError) -> Problem:
    return Problem("numpy", f"it does not load ({error})", "install it: pip install numpy")


def _internal(error: Exception) -> str:
    """A fault of ours as a sentence; the traceback goes into a file, or else to stderr."""
    text = traceback.format_exc()
    kind = f"{type(error).__name__}: {error}"
    try:
        number, path = tempfile.mkstemp(prefix="selenite-error-", suffix=".txt")
        with os.fdopen(number, "w", encoding="utf-8", errors="backslashreplace") as file:
            file.write(f"Selenite {__version__}, Python {sys.version}\n{sys.argv}\n\n{text}")
    except OSError:
        say(text)
        path = "the lines above"
    return f"internal error ({kind}); this is a fault of Selenite: please report it with {path}"


def _as_json(error: BadInput) -> list[dict[str, str]]:
    return [problem.as_json() for problem in error.problems]


def _report(command: str, report: dict[str, object], json_out: TextIO | None) -> int:
    """Says what is wrong, writes the object where one is asked for; returns the exit status."""
    status = 0
    if "error" in report:
        say(f"{command}: {' '.join(str(report['error']).split())}")
        status = 1
    problems = problems_in(report)  # of `check` too
    for line in grouped(problem.line() for problem in problems):
        say(line if line.lower().startswith(f"{command}: ") else f"{command}: {line}")
        status = 2
    if json_out is not None:
        try:
            json_out.write(json_text(report) + "\n")
            json_out.flush()
        except (OSError, TypeError, ValueError) as error:  # a full disk, or nobody reads any more
            say(f"{command}: the JSON object cannot be written: {error}")
            status = status or 1
    return status
