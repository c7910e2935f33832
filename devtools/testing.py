# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev test`: every suite, each runner's result added up, one closing line."""

from __future__ import annotations

import argparse
import asyncio
import math
import os
import shutil
import time
from collections.abc import Mapping
from pathlib import Path

from native_tests import run_native
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
    """Runs the suites one after another. Two runs in one checkout would share the reports."""
    with alone("tests"):
        return _run_suites(options)


def _run_suites(options: argparse.Namespace) -> int:
    shutil.rmtree(REPORTS, ignore_errors=True)
    REPORTS.mkdir(parents=True)
    started = time.monotonic()
    total = Tally()
    lines = []
    for name, suite in SUITES.items():
        if options.suites or options.files:
            wanted = name in options.suites
            wanted |= any(_suite_of(path) == name for path in options.files)
            if not wanted:
                continue
        say(f"tests: {name}")
        before = time.monotonic()
        tally = suite(options)
        lines.append(f"{name:<10} {tally.line()} in {time.monotonic() - before:.0f} s")
        total += tally
    print("\n" + "\n".join(lines))
    print(f"{'all':<10} {time.monotonic() - started:.0f} s, reports in {REPORTS.relative_to(ROOT)}")
    print(total.line(), flush=True)
    if total.passed + total.failed == 0:
        say("no test ran")
    return 0 if total.failed == 0 and total.passed > 0 else 1


def _suite_of(path: Path) -> str:
    if path.suffix == ".cpp":
        return "native"
    folder = path.relative_to(ROOT).parts[0] if path.is_relative_to(ROOT) else ""
    return "blender" if folder == "blender_tests" else "python"


def _python(options: argparse.Namespace) -> Tally:
    """pytest of the modules, in one process."""
    files = [path for path in options.files if _suite_of(path) == "python"]
    words = _pytest_words("python", files or [ROOT / "tests" / "python"], options)
    return asyncio.run(_pytest("python", [PYTHON, RUN_PYTEST, *words], options))


def _blender(options: argparse.Namespace) -> Tally:
    """pytest with bpy: a process per file, because one process can load one Blender once."""
    runs: dict[Path, list[str | Path]] = {}
    for path in _blender_files(options):
        runs[path] = [PYTHON, RUN_PYTEST, *_pytest_words(path.stem, [path], options)]
    return _files_side_by_side("blender", runs, options)


def _blender34(options: argparse.Namespace) -> Tally:
    """The files that know the marker blender34, inside Debian's Blender."""
    files = [path for path in _blender_files(options) if "mark.blender34" in path.read_text()]
    if not files:
        return Tally()
    blender = os.environ.get("SELENITE_BLENDER34") or shutil.which("blender")
    if blender is None:
        raise Failed("no 'blender' found; SELENITE_BLENDER34 may name it")
    start = [blender, "-b", "--factory-startup", "--python-exit-code", "1"]
    runs: dict[Path, list[str | Path]] = {}
    for path in files:
        words = _pytest_words(path.stem, [path], options, "blender34")
        runs[path] = [*start, "--python", RUN_IN_BLENDER, "--", *words]
    return _files_side_by_side("blender34", runs, options)


def _blender_files(options: argparse.Namespace) -> list[Path]:
    if options.files:
        return [path for path in options.files if _suite_of(path) == "blender"]
    return sorted((ROOT / "blender_tests").glob("test_*.py"))


def _files_side_by_side(
    suite: str, runs: Mapping[Path, list[str | Path]], options: argparse.Namespace
) -> Tally:
    """A process for each file, those that take longest first."""
    known = last_durations(suite)
    seconds = {}

    def expected(path: Path) -> tuple[float, int]:  # what never ran may take long
        return known.get(path.stem, math.inf), path.stat().st_size

    async def run(path: Path) -> Tally:
        begun = time.monotonic()
        tally = await _pytest(f"{suite}.{path.stem}", runs[path], options)
        seconds[path.stem] = time.monotonic() - begun
        return tally

    async def run_all() -> list[Tally]:
        return await side_by_side(run(path) for path in sorted(runs, key=expected, reverse=True))

    tallies = asyncio.run(run_all())
    keep_durations(suite, seconds)
    return sum(tallies, Tally())


def _pytest_words(
    name: str, files: list[Path], options: argparse.Namespace, marker: str = ""
) -> list[str]:
    words = [str(path) for path in files]
    words += ["-p", "no:cacheprovider", "-o", f"junit_suite_name={name}"]
    if options.k:
        words += ["-k", options.k]
    markers = [marker] if marker else []
    if options.fast:
        markers.append("not slow")
    if markers:
        words += ["-m", " and ".join(markers)]
    return [*words, *options.extra]


async def _pytest(name: str, command: list[str | Path], options: argparse.Namespace) -> Tally:
    """Runs pytest and shows what it printed when it has ended, so that no two are mixed."""
    report, log = REPORTS / f"{name}.xml", REPORTS / f"{name}.log"
    command = [*command, f"--junit-xml={report}"]
    status = await run_limited(command, options.limit, _environment(name), log)
    print(log.read_text(errors="replace"), end="", flush=True)
    return read_report(report, status)


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


SUITES = {"native": run_native, "python": _python, "blender": _blender, "blender34": _blender34}
