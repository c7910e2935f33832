# SPDX-License-Identifier: GPL-3.0-or-later
"""Places in the checkout, and how the jobs run other programs."""

from __future__ import annotations

import asyncio
import fcntl
import hashlib
import os
import signal
import subprocess
import sys
from collections.abc import AsyncIterator, Coroutine, Iterable, Iterator, Mapping, Sequence
from contextlib import asynccontextmanager, contextmanager, nullcontext
from pathlib import Path
from typing import IO, Any, TypeVar

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "build"
PACKAGE = ROOT / "addon" / "selenite"
VENV = ROOT / ".venv"
PYTHON = VENV / "bin" / "python3"
JOBS = (
    min(2, os.cpu_count() or 1)
    if "SELENITE_JOBS" not in os.environ
    else int(os.environ["SELENITE_JOBS"])
)
TIMED_OUT = 124
LONGEST_LINE = 1 << 24  # bytes of a line that is read from a program

T = TypeVar("T")


class Failed(Exception):
    """A job cannot go on; the text is for the person at the terminal."""


def say(text: str) -> None:
    print(f"dev: {text}", file=sys.stderr, flush=True)


def run(
    command: Sequence[str | Path], cwd: Path = ROOT, env: Mapping[str, str] | None = None
) -> None:
    """Runs a program that has to succeed."""
    words = [str(word) for word in command]
    sys.stdout.flush()
    status = subprocess.call(words, cwd=cwd, env={**os.environ, **(env or {})})
    if status:
        raise Failed(f"'{' '.join(words[:4])} ...' ended with status {status}")


@asynccontextmanager
async def started(
    command: Sequence[str | Path],
    env: Mapping[str, str] | None = None,
    output: IO[str] | int | None = None,
) -> AsyncIterator[asyncio.subprocess.Process]:
    """A program in a process group of its own, which is ended with the block.

    `output` takes what the program prints, its errors with the rest; None for the terminal.
    """
    sys.stdout.flush()
    process = await asyncio.create_subprocess_exec(
        *(str(word) for word in command),
        cwd=ROOT,
        env={**os.environ, **(env or {})},
        stdin=asyncio.subprocess.DEVNULL,
        stdout=output,
        stderr=None if output is None else asyncio.subprocess.STDOUT,
        start_new_session=True,
        limit=LONGEST_LINE,
    )
    try:
        yield process
    finally:
        if process.returncode is None:
            os.killpg(process.pid, signal.SIGKILL)
            await process.wait()


async def run_limited(
    command: Sequence[str | Path],
    seconds: float,
    env: Mapping[str, str] | None = None,
    log: Path | None = None,
) -> int:
    """Runs a program that is ended after `seconds`; what it prints goes into `log` if it is named.

    Blender as a module can hang when its process ends, so every program that imports it goes
    through here. Returns its exit status, or TIMED_OUT.
    """
    with log.open("w") if log else nullcontext() as output:
        async with started(command, env, output) as process:
            try:
                return await asyncio.wait_for(process.wait(), seconds)
            except TimeoutError:
                say(f"ended after {seconds:.0f} s: {command[-1]}")
                return TIMED_OUT


async def side_by_side(jobs: Iterable[Coroutine[Any, Any, T]]) -> list[T]:
    """Results of the jobs, which begin in this order, at most JOBS of them at a time."""
    places = asyncio.Semaphore(JOBS)

    async def in_a_place(job: Coroutine[Any, Any, T]) -> T:
        async with places:
            return await job

    async with asyncio.TaskGroup() as group:
        tasks = [group.create_task(in_a_place(job)) for job in jobs]
    return [task.result() for task in tasks]


def digest(parts: Iterable[Path | str]) -> str:
    """Fingerprint of texts and of files' contents."""
    total = hashlib.sha256()
    for part in parts:
        content = part.read_bytes() if isinstance(part, Path) else part.encode()
        total.update(len(content).to_bytes(8, "little") + content)
    return total.hexdigest()


def is_stamped(stamp: Path, key: str) -> bool:
    """Whether the work with these inputs was finished before."""
    return stamp.is_file() and stamp.read_text() == key


def write_stamp(stamp: Path, key: str) -> None:
    stamp.parent.mkdir(parents=True, exist_ok=True)
    stamp.write_text(key)


def write_if_other(path: Path, text: str) -> None:
    """Writes a file unless it has this text: its time is that of its last change."""
    if not path.is_file() or path.read_text() != text:
        path.write_text(text)


@contextmanager
def alone(what: str) -> Iterator[None]:
    """Keeps two `./dev` of one checkout from doing the same work at the same time."""
    BUILD.mkdir(exist_ok=True)
    with (BUILD / f".{what}.lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            say(f"waiting for another ./dev ({what})")
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield
