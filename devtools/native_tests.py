# SPDX-License-Identifier: GPL-3.0-or-later
"""The native suite: each GoogleTest program in shards, each shard in one process.

A process for each test, as ctest would start them, takes longer to make tables than to test. When
a test crashes or hangs, it is counted as failed, and another process goes on with the tests after
it: each test that was chosen is counted once, whatever happens to the others.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import re
import signal
import subprocess
import tempfile
import time
from collections.abc import Coroutine
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

from process import BUILD, JOBS, ROOT, Failed, started
from tally import REPORTS, Tally, keep_durations, last_durations, read_report

TEST_LIMIT = 900  # seconds for one test, on a loaded machine
USUAL_SECONDS = 0.05  # of a test that has not run here before
NOT_XML = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


@dataclass
class Case:
    """What became of a test."""

    name: str
    outcome: str  # passed, failed, skipped
    seconds: float
    text: str


@dataclass
class Program:
    """A GoogleTest program and the chosen ones of its tests."""

    room: str
    path: Path
    tests: list[str]


@dataclass
class Shard:
    """Tests that share a process."""

    program: Program
    seconds: float = 0  # expected
    tests: list[str] = field(default_factory=list)


class Reader:
    """Follows what GoogleTest prints, line by line."""

    START = re.compile(r"\[ RUN      \] (\S+)\s*$")
    END = re.compile(r"\[ +(OK|FAILED|SKIPPED) +\] (\S+?)(?:, .*)? \((\d+) ms\)\s*$")
    OUTCOMES = {"OK": "passed", "FAILED": "failed", "SKIPPED": "skipped"}

    def __init__(self) -> None:
        self.running = ""
        self.text = ""  # of the running test, or what was printed since the last one

    def read(self, line: str) -> Case | None:
        """The test that ends with this line, if one does."""
        start = self.START.search(line)
        if start and not self.running:
            self.running, self.text = start[1], ""
            return None
        end = self.END.search(line)
        if end and end[2] == self.running:
            case = Case(end[2], self.OUTCOMES[end[1]], int(end[3]) / 1000, self.text)
            self.running = self.text = ""
            return case
        self.text += line
        return None


class NativeSuite:
    """Its shards, which whoever runs the suites starts among other processes."""

    def __init__(self, options: argparse.Namespace) -> None:
        """`options` as of `./dev test`."""
        self._options, self._env = options, _environment(options.preset)
        self._key = f"native.{options.preset}"
        programs = _programs(BUILD / options.preset, self._env, options)
        known = last_durations(self._key)
        self._shards = [shard for program in programs for shard in _shards(program, known)]
        self._cases: list[Case] = []

    def jobs(self) -> list[tuple[float, Coroutine[None, None, None]]]:
        """(seconds that it may take, what runs it) of each shard."""
        deadline = time.monotonic() + 2 * self._options.limit
        return [(shard.seconds, self._run(shard, deadline)) for shard in self._shards]

    @property
    def seconds(self) -> float:
        """Of all tests that have ended."""
        return sum(case.seconds for case in self._cases)

    def tally(self) -> Tally:
        """After the end of all jobs: writes the report."""
        report = REPORTS / "native.xml"
        _write_report(report, self._cases)
        keep_durations(self._key, {case.name: case.seconds for case in self._cases})
        return read_report(report, 0)

    async def _run(self, shard: Shard, deadline: float) -> None:
        self._cases += await _run_shard(shard, self._env, self._options, deadline)


def _environment(preset: str) -> dict[str, str]:
    """Variables of the test preset: what the sanitizers are told."""
    presets = json.loads((ROOT / "CMakePresets.json").read_text())["testPresets"]
    for entry in presets:
        if entry["name"] == preset:
            variables = entry.get("environment", {}).items()
            return {name: text.replace("${sourceDir}", str(ROOT)) for name, text in variables}
    raise Failed(f"CMakePresets.json has no test preset '{preset}'")


def _programs(build: Path, env: dict[str, str], options: argparse.Namespace) -> list[Program]:
    """The programs that have chosen tests; tests/CMakeLists.txt lists them all."""
    found = []
    for line in (build / "tests" / "programs.txt").read_text().splitlines():
        room, path = line.split(" ", 1)
        tests = _chosen_tests(room, Path(path), build, env, options)
        if tests:
            found.append(Program(room, Path(path), tests))
    return found


def _chosen_tests(
    room: str, path: Path, build: Path, env: dict[str, str], options: argparse.Namespace
) -> list[str]:
    files = {file for file in options.files if file.suffix == ".cpp"}
    chosen = []
    with tempfile.TemporaryDirectory() as folder:
        listing = Path(folder) / "tests.json"
        command = [str(path), "--gtest_list_tests", f"--gtest_output=json:{listing}"]
        quiet = subprocess.run(command, env={**os.environ, **env}, capture_output=True, text=True)
        if quiet.returncode != 0:
            raise Failed(f"{path.name} cannot list its tests: {quiet.stdout}{quiet.stderr}")
        suites = json.loads(listing.read_text())["testsuites"]
    for suite in suites:
        for test in suite["testsuite"]:
            name = f"{suite['name']}.{test['name']}"
            whole = f"{room}.{name}"
            wanted = not options.k or options.k in whole
            wanted &= not (options.fast and "Slow" in whole)
            # __FILE__ as the compiler was told it: from the folder of the build
            wanted &= not files or (build / test["file"]).resolve() in files
            if wanted:
                chosen.append(name)
    return chosen


def _shards(program: Program, known: dict[str, float]) -> list[Shard]:
    """Shards that take equally long: the longest test first, each into the shortest shard."""
    shards = [Shard(program) for _ in range(max(2, JOBS))]
    expected = {name: known.get(f"{program.room}.{name}", USUAL_SECONDS) for name in program.tests}
    for name in sorted(program.tests, key=lambda name: expected[name], reverse=True):
        shortest = min(shards, key=lambda shard: shard.seconds)
        shortest.tests.append(name)
        shortest.seconds += expected[name]
    return [shard for shard in shards if shard.tests]


async def _run_shard(
    shard: Shard, env: dict[str, str], options: argparse.Namespace, deadline: float
) -> list[Case]:
    """Runs all tests of the shard, in one process more after each that ends too early."""
    cases: list[Case] = []
    left = shard.tests
    while left:
        ended = await _run_process(shard.program, left, env, options, deadline)
        cases += ended
        names = {case.name for case in ended}
        before, left = left, [name for name in left if name not in names]
        if left == before or time.monotonic() > deadline:
            break
    for name in left:
        cases.append(Case(name, "failed", 0, "did not run\n"))
        _show(shard.program, cases[-1])
    for case in cases:
        case.name = f"{shard.program.room}.{case.name}"
    return cases


async def _run_process(
    program: Program,
    tests: list[str],
    env: dict[str, str],
    options: argparse.Namespace,
    deadline: float,
) -> list[Case]:
    """The tests that ended; whatever else goes wrong with the process is one that failed."""
    command: list[str | Path] = [program.path, *options.extra, "--gtest_color=no"]
    command += ["--gtest_brief=0", "--gtest_print_time=1", f"--gtest_filter={':'.join(tests)}"]
    clock = time.monotonic  # that of the loop
    limit = min(TEST_LIMIT, options.limit)
    cases: list[Case] = []
    reader = Reader()

    def ended(case: Case) -> None:
        cases.append(case)
        _show(program, case)

    async with started(command, env, asyncio.subprocess.PIPE) as process:
        assert process.stdout is not None
        begun, fault = clock(), ""
        try:
            while True:
                async with asyncio.timeout_at(min(begun + limit, deadline)):
                    line = await process.stdout.readline()
                if not line:
                    break
                before = reader.running
                if case := reader.read(line.decode(errors="replace")):
                    ended(case)
                if reader.running != before:
                    begun = clock()
            async with asyncio.timeout_at(min(begun + limit, deadline)):
                status = await process.wait()
            expected = 1 if any(case.outcome == "failed" for case in cases) else 0
            if reader.running or status != expected:
                fault = f"the process ended with {_meaning(status)}"
        except TimeoutError:
            fault = f"ended after {clock() - begun:.0f} s"
    if fault:
        name = reader.running or f"(after {cases[-1].name if cases else 'the start'})"
        ended(Case(name, "failed", clock() - begun, f"{reader.text}{fault}\n"))
    return cases


def _meaning(status: int) -> str:
    return f"status {status}" if status >= 0 else f"signal {signal.Signals(-status).name}"


def _show(program: Program, case: Case) -> None:
    """What passes is counted at the end; what fails is shown in full."""
    if case.outcome != "passed":
        print(f"{case.outcome}: {program.room}.{case.name}\n{case.text}", end="", flush=True)


def _write_report(report: Path, cases: list[Case]) -> None:
    """JUnit: a `testcase` for each test, with what it printed if it did not pass."""
    suite = ElementTree.Element("testsuite", name="native", tests=str(len(cases)))
    for case in cases:
        group, _, name = case.name.rpartition(".")
        words = {"classname": group, "name": name, "time": f"{case.seconds:.3f}"}
        entry = ElementTree.SubElement(suite, "testcase", words)
        if case.outcome != "passed":
            kind = "failure" if case.outcome == "failed" else "skipped"
            reason = ElementTree.SubElement(entry, kind, message=case.outcome)
            reason.text = NOT_XML.sub("?", case.text)
    ElementTree.ElementTree(suite).write(report, encoding="utf-8", xml_declaration=True)
