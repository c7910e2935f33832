# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev test`: every suite, each runner's result added up, one closing line."""

from __future__ import annotations

import argparse
import asyncio
import math
import os
import shutil
import time
from collections.abc import Coroutine, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import gui_test
from native_tests import NativeSuite
from process import BUILD, PYTHON, ROOT, Failed, alone, run_limited, say, side_by_side
from tally import REPORTS, Tally, keep_durations, last_durations, read_report

RUN_PYTEST = ROOT / "devtools" / "run_pytest.py"
RUN_IN_BLENDER = ROOT / "devtools" / "run_in_blender.py"


def parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="./dev test",
        description="Runs the tests and closes with 'N passed, N failed'.",
        epilog="A test file runs alone. What follows '--' goes to GoogleTest or pytest as it is.",
    )
    parser.add_argument("suites", nargs="*", metavar="SUITE|FILE", help=", ".join(SUITES))
    parser.add_argument("-k", metavar="NAME", help="only tests whose name contains NAME")
    parser.add_argument("--fast", action="store_true", help="leave out the tests marked slow")
    parser.add_argument(
        "--preset", default="release", help="for the native suite (sanitize, exact, thread)"
    )
    parser.add_argument(
        "--limit",
        type=float,
        default=1800,
        help="seconds for a process of pytest; the native suite has twice that (%(default)s)",
    )
    own, extra = arguments, []
    if "--" in arguments:
        split = arguments.index("--")
        own, extra = arguments[:split], arguments[split + 1 :]
    options = parser.parse_args(own)
    options.extra = extra
    options.files = [Path(word).resolve() for word in options.suites if word not in SUITES]
    options.suites = [word for word in options.suites if word in SUITES]
    for path in options.files:
        if not path.exists():
            raise Failed(f"neither a suite ({', '.join(SUITES)}) nor a file: {path}")
    return options


def run_tests(options: argparse.Namespace) -> int:
    """Runs the suites. Two runs in one checkout would share the reports."""
    with alone("tests"):
        return _run_suites(options)


def _run_suites(options: argparse.Namespace) -> int:
    shutil.rmtree(REPORTS, ignore_errors=True)
    REPORTS.mkdir(parents=True)
    started = time.monotonic()
    wanted = [name for name in SUITES if _is_wanted(name, options)]
    tallies = {}
    lines = []
    others = [name for name in wanted if name != "window"]
    if others:
        say(f"tests: {', '.join(others)}")
    native = NativeSuite(options) if "native" in wanted else None
    with_pytest = [name for name in wanted if name in PYTEST_SUITES]
    runs = [run for name in with_pytest for run in PYTEST_SUITES[name](options)]
    ended = _run_side_by_side(runs, native)
    if native is not None:
        tallies["native"] = native.tally()
        took = f"its tests took {native.seconds:.0f} s"
        lines.append(f"{'native':<10} {tallies['native'].line()}; {took}")
    for name in with_pytest:
        own = [item for item in ended if item.run.suite == name]
        keep_durations(name, {item.run.name: item.seconds for item in own})
        tallies[name] = sum((item.tally for item in own), Tally())
        seconds = sum(item.seconds for item in own)
        lines.append(f"{name:<10} {tallies[name].line()}; its processes took {seconds:.0f} s")
    if "window" in wanted:
        say("tests: window")
        begun = time.monotonic()
        tallies["window"] = gui_test.short_run(WINDOW_SECONDS)
        seconds = time.monotonic() - begun
        lines.append(f"{'window':<10} {tallies['window'].line()} in {seconds:.0f} s")
    total = sum(tallies.values(), Tally())
    print("\n" + "\n".join(lines))
    print(f"{'all':<10} {time.monotonic() - started:.0f} s, reports in {REPORTS.relative_to(ROOT)}")
    print(total.line(), flush=True)
    if total.passed + total.failed == 0:
        say("no test ran")
    return 0 if total.failed == 0 and total.passed > 0 else 1


def _is_wanted(suite: str, options: argparse.Namespace) -> bool:
    if suite == "window" and (options.k or options.extra):
        return False  # these choose tests of the other runners
    if not options.suites and not options.files:
        return True
    return suite in options.suites or any(_suite_of(path) == suite for path in options.files)


def _suite_of(path: Path) -> str:
    if path.suffix == ".cpp":
        return "native"
    folder = path.relative_to(ROOT).parts[0] if path.is_relative_to(ROOT) else ""
    return "blender" if folder == "blender_tests" else "python"


@dataclass(frozen=True)
class Run:
    """A process of pytest. start: its command, before files and `words`."""

    suite: str
    start: tuple[str | Path, ...]
    files: tuple[Path, ...]
    words: tuple[str, ...]
    limit: float  # seconds

    @property
    def name(self) -> str:
        """Of its first file and how many more, as "test_baking_7"; the suite of a folder."""
        first = self.files[0]
        if first.is_dir():
            return self.suite
        more = len(self.files) - 1
        return f"{first.stem}_{more}" if more else first.stem

    @property
    def command(self) -> list[str | Path]:
        return [*self.start, *self.files, "-o", f"junit_suite_name={self.name}", *self.words]

    @property
    def is_slow(self) -> bool:
        """What takes longer than others, as long as it has never run."""
        return any(path.is_dir() or SLOW in path.read_text() for path in self.files)

    def apart(self) -> list[Run]:
        """A process for each file."""
        return [replace(self, files=(path,)) for path in self.files]


@dataclass(frozen=True)
class Ended:
    """What became of it."""

    run: Run
    tally: Tally
    seconds: float


def _python(options: argparse.Namespace) -> list[Run]:
    """pytest of the modules, in one process."""
    files = [path for path in options.files if _suite_of(path) == "python"]
    files = files or [ROOT / "tests" / "python"]
    words = _pytest_words(options)
    return [Run("python", (PYTHON, RUN_PYTEST), tuple(files), words, options.limit)]


def _blender(options: argparse.Namespace) -> list[Run]:
    """pytest with bpy."""
    start, words = (PYTHON, RUN_PYTEST), _pytest_words(options)
    groups = _groups(_blender_files(options))
    return [Run("blender", start, files, words, options.limit) for files in groups]


def _blender34(options: argparse.Namespace) -> list[Run]:
    """The files that know the marker blender34, inside Debian's Blender."""
    files = [path for path in _blender_files(options) if "mark.blender34" in path.read_text()]
    if not files:
        return []
    blender = os.environ.get("SELENITE_BLENDER34") or shutil.which("blender")
    if blender is None:
        raise Failed("no 'blender' found; SELENITE_BLENDER34 may name it")
    start = (blender, "-b", "--factory-startup", "--python-exit-code", "1",
             "--python", RUN_IN_BLENDER, "--")  # fmt: skip
    words = _pytest_words(options, "blender34")
    return [Run("blender34", start, group, words, options.limit) for group in _groups(files)]


def _groups(files: list[Path]) -> Iterator[tuple[Path, ...]]:
    """Files that share a process: most tests take less time than a start of Blender. What is slow
    has a process of its own, so that no core waits for a long one at the end."""
    quick = []
    for path in files:
        if SLOW in path.read_text():
            yield (path,)
        else:
            quick.append(path)
    for first in range(0, len(quick), FILES):
        yield tuple(quick[first : first + FILES])


def _blender_files(options: argparse.Namespace) -> list[Path]:
    if options.files:
        return [path for path in options.files if _suite_of(path) == "blender"]
    return sorted((ROOT / "blender_tests").glob("test_*.py"))


def _run_side_by_side(runs: list[Run], native: NativeSuite | None) -> list[Ended]:
    """All processes, those that take longest first: no core waits for the end of a suite. What
    never ran may take long."""
    known = {suite: last_durations(suite) for suite in {run.suite for run in runs}}
    ended: list[Ended] = []

    async def keep(run: Run) -> None:
        ended.append(await _pytest(run))

    jobs: list[tuple[tuple[float, bool], Coroutine[None, None, None]]] = [
        ((known[run.suite].get(run.name, math.inf), run.is_slow), keep(run)) for run in runs
    ]
    jobs += [((seconds, False), job) for seconds, job in (native.jobs() if native else ())]
    jobs.sort(key=lambda item: item[0], reverse=True)

    async def run_all() -> None:
        await side_by_side(job for _, job in jobs)

    asyncio.run(run_all())
    return ended


def _pytest_words(options: argparse.Namespace, marker: str = "") -> tuple[str, ...]:
    words = ["-p", "no:cacheprovider"]
    if options.k:
        words += ["-k", options.k]
    markers = [marker] if marker else []
    if options.fast:
        markers.append("not slow")
    if markers:
        words += ["-m", " and ".join(markers)]
    return (*words, *options.extra)


async def _pytest(run: Run) -> Ended:
    """Runs pytest and shows what it printed when it has ended, so that no two are mixed. Files that
    shared a process which crashed or hung run again apart: the fault is that of one of them."""
    name = run.name if run.suite == run.name else f"{run.suite}.{run.name}"
    report, log = REPORTS / f"{name}.xml", REPORTS / f"{name}.log"
    command = [*run.command, f"--junit-xml={report}"]
    begun = time.monotonic()
    status = await run_limited(command, run.limit, _environment(name), log)
    print(log.read_text(errors="replace"), end="", flush=True)
    if status in PYTEST_ENDS or len(run.files) == 1:
        tally = read_report(report, status)
    else:
        say(f"{name} ended with status {status}: its files run again, each alone")
        tally = sum([(await _pytest(one)).tally for one in run.apart()], Tally())
    return Ended(run, tally, time.monotonic() - begun)


def _environment(name: str) -> dict[str, str]:
    """A folder of its own for what Blender leaves behind: crash files, quit.blend, settings."""
    scratch = BUILD / "test-scratch" / name
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    return {
        "TMPDIR": str(scratch),
        "BLENDER_USER_RESOURCES": str(scratch),
        "SELENITE_SOURCE_DIR": str(ROOT),
        "PATH": f"{PYTHON.parent}{os.pathsep}{os.environ['PATH']}",
    }


PYTEST_SUITES = {"python": _python, "blender": _blender, "blender34": _blender34}
SUITES = ("native", *PYTEST_SUITES, "window")
#: A file with this has a process of its own; how many of the others share one.
SLOW, FILES = "mark.slow", 8
#: All passed, some failed, none chosen: else pytest has not come to its end.
PYTEST_ENDS = (0, 1, 5)
#: What of ./dev gui-test is part of every run takes at most so long.
WINDOW_SECONDS = 60
