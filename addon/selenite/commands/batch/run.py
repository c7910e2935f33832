# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite batch FILE.toml`: many fits, one table. Another call goes on with what is left."""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from ...atomic_files import write_json
from ...fit.checkpoint import SUFFIX
from ...fit.cluster.workers import share_of
from ...json_text import read_json
from ...paths import absolute, why_not_folder
from ...problems import BadInput, Problem, listed, problems_in
from ...report.batch_page import PAGE, Ended, write_pages
from .. import arguments
from ..cluster_arguments import client_for
from ..terminal import bar, say
from .entries import Entry, read_entries
from .there import Task, ThereProcess

if TYPE_CHECKING:
    from distributed import Client

STATE = "batch.json"
SCHEMA = 1
_CHILD = Path(__file__).parents[2] / "command_process.py"
#: Seconds between two looks at the processes.
_POLL = 0.1


def run(args: argparse.Namespace) -> dict[str, object]:
    """Fits what is left to fit; the report has a row for each fit. A fit that fails stops no other:
    then the key `error` names it."""
    path = absolute(args.file)
    entries = read_entries(path)
    out = absolute(args.out) if args.out else path.with_name(f"{path.stem}-fits")
    if why := why_not_folder(out):
        raise BadInput(Problem(f"Folder '{out}'", why, arguments.OTHER_FOLDER))
    out.mkdir(parents=True, exist_ok=True)
    if not args.scheduler:
        return _fitted(Batch(entries, path.parent, out, host(), again=args.again), args.jobs)
    with client_for(args) as client:
        batch = ClusterBatch(entries, path.parent, out, client, again=args.again)
        return _fitted(batch, max(args.jobs, batch.at_once))


def _fitted(batch: Batch, jobs: int) -> dict[str, object]:
    """What is left, fitted."""
    if batch.kept:
        count = len(batch.rows())
        say(f"{len(batch.kept)} of {count} fits have ended before; --again repeats them")
    try:
        _work(batch, jobs)
    except KeyboardInterrupt:
        return _report(batch) | {"error": "interrupted"}
    finally:
        batch.close()
    return _report(batch)


@dataclass
class _Running:
    """A fit in its process. log: what it says."""

    entry: Entry
    process: subprocess.Popen[bytes] | ThereProcess
    place: tempfile.TemporaryDirectory[str]
    since: float
    resumes: bool


class Batch:
    """The fits of a file: what has ended, what runs, what is left. Its folder is up to date after
    each fit: batch.json, a table and a page."""

    def __init__(
        self, entries: Sequence[Entry], home: Path, out: Path, host: Sequence[str], again: bool
    ) -> None:
        """home: where relative paths begin; out: gets a folder for each fit; host: see `host`."""
        self.out = out
        self._home, self._entries, self._host = home, entries, host
        self.ended: dict[str, Ended] = {} if again else _ended_before(out, entries)
        self.kept = tuple(self.ended)
        self.waiting = [entry for entry in entries if entry.name not in self.ended]
        self.running: list[_Running] = []
        self._again = again
        self._write()

    def start(self, threads: int | None) -> None:
        """The next one, or on from where it was interrupted. threads: of a fit that names none."""
        entry = self.waiting.pop(0)
        unfinished = None if self._again else _unfinished(self.out / entry.name)
        self._start(entry, unfinished, threads)

    def _start(self, entry: Entry, unfinished: Path | None, threads: int | None) -> None:
        words = ["fit", *entry.words]
        if unfinished is not None:
            words = ["fit", *entry.resumed_words, f"--resume={unfinished}"]
        if threads and not any(word.startswith("--threads") for word in words):
            words.append(f"--threads={threads}")
        words += [f"--out={self.out / entry.name}", "--json"]
        place = tempfile.TemporaryDirectory(prefix="selenite-batch-", ignore_cleanup_errors=True)
        request = Path(place.name) / "request.json"
        # for the checkout and the legacy add-on, which are not where Python looks
        python_path = [*sys.path, str(Path(__file__).resolve().parents[3])]
        request.write_text(json.dumps({"words": words, "python_path": python_path}))
        with (Path(place.name) / "out").open("wb") as out, _log(self.out, entry).open("wb") as log:
            process = subprocess.Popen(
                [*self._host, str(request)],
                cwd=self._home,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=log,
                env={**os.environ, **dict.fromkeys(("TMPDIR", "TMP", "TEMP"), place.name)},
                start_new_session=os.name == "posix",  # Ctrl+C is for the batch
            )
        since = time.monotonic()
        self.running.append(_Running(entry, process, place, since, unfinished is not None))

    def poll(self, threads: int | None) -> None:
        """Takes up what has ended since."""
        for one in [item for item in self.running if item.process.poll() is not None]:
            self.running.remove(one)
            ended = self._taken(one)
            one.place.cleanup()
            if one.resumes and ended.status == "refused":  # the photos or the scene are others now
                self._start(one.entry, None, threads)
                continue
            self.ended[one.entry.name] = ended
            say(f"{one.entry.name}: {ended.in_short}")
            self._write()

    def _taken(self, one: _Running) -> Ended:
        status = one.process.poll() or 0
        try:
            found = read_json(Path(one.place.name) / "out")
        except ValueError:
            found = None
        report = found if isinstance(found, dict) else {}
        reasons = tuple(problem.line() for problem in problems_in(report))
        if error := report.get("error"):
            reasons += (str(error),)
        if status and not reasons:
            ending = f"signal {-status}" if status < 0 else f"status {status}"
            reasons = (f"its process ended with {ending}; see {_log(self.out, one.entry).name}",)
        folder = report.get("folder")
        word = {0: "done", 2: "refused"}.get(status, "failed")
        return Ended(
            one.entry.name,
            one.entry.words,
            "failed" if word == "done" and not folder else word,
            "" if not folder else os.path.relpath(folder, self.out),
            reasons,
            time.monotonic() - one.since,
        )

    def close(self) -> None:
        """Ends what runs. Its unfinished run stays, and the next call goes on with it."""
        for one in self.running:
            with suppress(ProcessLookupError):
                if isinstance(one.process, subprocess.Popen) and os.name == "posix":
                    os.killpg(one.process.pid, signal.SIGKILL)
                else:
                    one.process.kill()
            one.process.wait()
            one.place.cleanup()
        self.running.clear()

    def rows(self) -> list[Ended]:
        """Of all fits, in the order of the file."""
        waiting = (Ended(entry.name, entry.words, "waiting") for entry in self._entries)
        return [self.ended.get(item.name, item) for item in waiting]

    def _write(self) -> None:
        rows = self.rows()
        write_json(
            self.out / STATE,
            {"schema": SCHEMA, "fits": [row.as_json() for row in rows]},
        )
        write_pages(self.out, rows)


class ClusterBatch(Batch):
    """The same by the workers of a cluster: they have the files of the batch under the same paths,
    and Blender as a module."""

    def __init__(
        self, entries: Sequence[Entry], home: Path, out: Path, client: Client, again: bool
    ) -> None:
        """As of Batch. Raises BadInput where there is no worker."""
        self._client = client
        self._share, self.at_once = share_of(client)
        super().__init__(entries, home, out, (), again)

    def _start(self, entry: Entry, unfinished: Path | None, threads: int | None) -> None:
        place = tempfile.TemporaryDirectory(prefix="selenite-batch-", ignore_cleanup_errors=True)
        folder = self.out / entry.name
        kept = (f"--out={folder}", "--json")
        resumed = None if self._again else ("fit", *entry.resumed_words, *kept)
        task = Task(
            ("fit", *entry.words, *kept), resumed, str(folder), str(self._home),
            str(_log(self.out, entry)),
        )  # fmt: skip
        process = ThereProcess(self._client, task, self._share, SUFFIX, Path(place.name) / "out")
        self.running.append(_Running(entry, process, place, time.monotonic(), False))


def _work(batch: Batch, jobs: int) -> None:
    threads = max(1, (os.cpu_count() or 1) // jobs) if jobs > 1 else None
    count = len(batch.waiting)
    with bar("fitting") as shown:
        while batch.waiting or batch.running:
            while batch.waiting and len(batch.running) < jobs:
                batch.start(threads)
            names = ", ".join(one.entry.name for one in batch.running)
            left = len(batch.waiting) + len(batch.running)
            shown.update((count - left) / count, note=f"{count - left} of {count}: {names}")
            time.sleep(_POLL)
            batch.poll(threads)


def _report(batch: Batch) -> dict[str, object]:
    rows = batch.rows()
    wrong = [row for row in rows if row.status != "done"]
    say(f"{len(rows) - len(wrong)} of {len(rows)} fits are done; results in {batch.out}")
    report: dict[str, object] = {
        "folder": str(batch.out),
        "fits": [row.as_json() for row in rows],
    }
    if wrong:
        named = listed(row.name for row in wrong)
        report["error"] = (
            f"{len(wrong)} of {len(rows)} fits have no result: {named}; {PAGE} has the reasons"
        )
    return report


def _ended_before(out: Path, entries: Sequence[Entry]) -> dict[str, Ended]:
    """What an earlier call has done of the same words, and whose results are still there."""
    try:
        state = read_json(out / STATE)
        if not isinstance(state, dict) or state["schema"] != SCHEMA:
            return {}
        rows = [Ended.of_json(item) for item in state["fits"]]
    except (ValueError, KeyError, TypeError):
        return {}  # there is none
    wanted = {entry.name: entry.words for entry in entries}
    return {
        row.name: replace(row)
        for row in rows
        if row.status == "done" and wanted.get(row.name) == row.words and row.is_there(out)
    }


def _unfinished(folder: Path) -> Path | None:
    """The newest run there that was interrupted."""
    found = sorted(folder.glob(f"*{SUFFIX}")) if folder.is_dir() else []
    return found[-1] if found else None


def _log(out: Path, entry: Entry) -> Path:
    return out / f"{entry.name}.log"


def host() -> list[str]:
    """The words that run a command line in a process of its own, up to its request."""
    from ...scene_read.blender_process import blender_words

    return blender_words(_CHILD)
