# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev test`: every suite, each runner's result added up, one closing line."""

from __future__ import annotations

import argparse
import os
import re
import shutil
import time
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import environment
from process import BUILD, JOBS, PYTHON, ROOT, Failed, run_limited, say

RUN_PYTEST = ROOT / "devtools" / "run_pytest.py"
RUN_IN_BLENDER = ROOT / "devtools" / "run_in_blender.py"
REPORTS = BUILD / "test-reports"


@dataclass
class Tally:
    """Tests counted in a runner's report."""

    passed: int = 0
    failed: int = 0
    skipped: int = 0

    def __add__(self, other: Tally) -> Tally:
        return Tally(
            self.passed + other.passed, self.failed + other.failed, self.skipped + other.skipped
        )

    def line(self) -> str:
        skipped = f", {self.skipped} skipped" if self.skipped else ""
        return f"{self.passed} passed, {self.failed} failed{skipped}"


def parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="./dev test",
        description="Runs the tests and closes with 'N passed, N failed'.",
        epilog="A test file runs alone. What follows '--' goes to ctest or pytest as it is.",
    )
    parser.add_argument("suites", nargs="*", metavar="SUITE|FILE", help=", ".join(SUITES))
    parser.add_argument("-k", metavar="NAME", help="only tests whose name contains NAME")
    parser.add_argument("--fast", action="store_true", help="leave out the tests marked slow")
    parser.add_argument(
        "--preset", default="release", help="for the native suite (sanitize, exact, thread)"
    )
    parser.add_argument(
        "--limit", type=float, default=1800, help="seconds for one process (%(default)s)"
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
    folder = path.relative_to(ROOT).parts[0] if path.is_relative_to(ROOT) else ""
    return "blender" if folder == "blender_tests" else "python"


def _native(options: argparse.Namespace) -> Tally:
    """GoogleTest through ctest."""
    report = REPORTS / "native.xml"
    preset = options.preset
    if preset != "release":
        environment.build(preset)
    command = ["ctest", "--preset", preset, "-j", str(JOBS), "--output-junit", str(report)]
    if options.k:
        command += ["-R", re.escape(options.k)]
    if options.fast:
        command += ["-E", "Slow"]
    command += ["--no-tests=ignore", *options.extra]
    # What passes is counted at the end; what fails is shown in full.
    uneventful = "^ +Start +[0-9]+: | Passed +[0-9.]+ sec$"
    quiet = f'set -o pipefail; "$@" | grep --line-buffered -vE "{uneventful}"'
    status = run_limited(["bash", "-c", quiet, "ctest", *command], 2 * options.limit)
    return _read(report, status)


def _python(options: argparse.Namespace) -> Tally:
    """pytest of the modules, in one process."""
    files = [path for path in options.files if _suite_of(path) == "python"]
    return _pytest("python", files or [ROOT / "tests" / "python"], options)


def _blender(options: argparse.Namespace) -> Tally:
    """pytest with bpy: a process per file, because one process can load one Blender once."""
    tally = Tally()
    for path in _blender_files(options):
        tally += _pytest(path.stem, [path], options)
    return tally


def _blender34(options: argparse.Namespace) -> Tally:
    """The files that know the marker blender34, inside Debian's Blender."""
    files = [path for path in _blender_files(options) if "mark.blender34" in path.read_text()]
    if not files:
        return Tally()
    blender = os.environ.get("SELENITE_BLENDER34") or shutil.which("blender")
    if blender is None:
        raise Failed("no 'blender' found; SELENITE_BLENDER34 may name it")
    tally = Tally()
    for path in files:
        report = REPORTS / f"blender34.{path.stem}.xml"
        command: list[str | Path] = [blender, "-b", "--factory-startup", "--python-exit-code", "1"]
        command += ["--python", RUN_IN_BLENDER, "--", *_pytest_words(path.stem, [path], options)]
        command += ["-m", "blender34", f"--junit-xml={report}"]
        tally += _read(report, run_limited(command, options.limit, _environment("blender34")))
    return tally


def _blender_files(options: argparse.Namespace) -> list[Path]:
    if options.files:
        return [path for path in options.files if _suite_of(path) == "blender"]
    return sorted((ROOT / "blender_tests").glob("test_*.py"))


def _pytest_words(name: str, files: list[Path], options: argparse.Namespace) -> list[str]:
    words = [str(path) for path in files]
    words += ["-p", "no:cacheprovider", "-o", f"junit_suite_name={name}"]
    if options.k:
        words += ["-k", options.k]
    return [*words, *options.extra]


def _pytest(name: str, files: list[Path], options: argparse.Namespace) -> Tally:
    report = REPORTS / f"{name}.xml"
    command: list[str | Path] = [PYTHON, RUN_PYTEST, *_pytest_words(name, files, options)]
    if options.fast:
        command += ["-m", "not slow"]
    command += [f"--junit-xml={report}"]
    return _read(report, run_limited(command, options.limit, _environment(name)))


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


def _read(report: Path, status: int) -> Tally:
    """Counts a JUnit report. A runner that ends badly without a failed test is itself a failure."""
    tally = Tally()
    if report.is_file():
        for case in ElementTree.parse(report).iter("testcase"):
            if case.find("failure") is not None or case.find("error") is not None:
                tally.failed += 1
            elif case.find("skipped") is not None:
                tally.skipped += 1
            else:
                tally.passed += 1
    nothing_selected = status == 5  # pytest's word for it
    if status != 0 and not nothing_selected and tally.failed == 0:
        say(f"the runner of {report.stem} ended with status {status}: counted as a failure")
        tally.failed += 1
    return tally


SUITES = {"native": _native, "python": _python, "blender": _blender, "blender34": _blender34}
