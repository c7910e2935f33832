# SPDX-License-Identifier: GPL-3.0-or-later
"""devtools/native_tests.py: every chosen test is counted once, whatever happens to the others."""

from __future__ import annotations

import argparse
import asyncio
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "devtools"))

import native_tests  # noqa: E402
import process  # noqa: E402
import tally  # noqa: E402

# Speaks as GoogleTest does. What a test does, its name says.
PROGRAM = f"""#!{sys.executable}
import json, os, signal, sys, time

NAMES = ["Passes", "Fails", "Crashes", "Skips", "Hangs", "TalksLongSlow"]
options = dict(word.partition("=")[::2] for word in sys.argv[1:])
if "--gtest_list_tests" in options:
    tests = [dict(name=name, file="../tests/a_test.cpp", line=1) for name in NAMES]
    with open(options["--gtest_output"].removeprefix("json:"), "w") as listing:
        json.dump(dict(testsuites=[dict(name="Small/Case", testsuite=tests)]), listing)
    sys.exit()
with open(os.environ["STARTS"], "a") as starts:
    starts.write(options["--gtest_filter"] + "\\n")
chosen = options["--gtest_filter"].split(":")
failed = []
for name in NAMES:
    name = "Small/Case." + name
    if name not in chosen:
        continue
    print(f"[ RUN      ] {{name}}", flush=True)
    print(f"words of {{name}}", flush=True)
    if "Crashes" in name:
        os.kill(os.getpid(), signal.SIGSEGV)
    if "Hangs" in name:
        time.sleep(60)
    if "Talks" in name:
        print("no end of line", end="")
    outcome = "  FAILED  " if "Fails" in name else "  SKIPPED " if "Skips" in name else "      OK  "
    if "Fails" in name:
        failed.append(name)
        name += ", where GetParam() = a value (of 2 ms)"
    print(f"[{{outcome[:10]}}] {{name}} (250 ms)", flush=True)
for name in failed:
    print(f"[  FAILED  ] {{name}}", flush=True)
print("last words", flush=True)
sys.exit(23 if "--leaks" in options else 1 if failed else 0)
"""


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Runs the program's tests; returns the tally and the filters of its processes."""
    build = tmp_path / "build" / "release"
    (build / "tests").mkdir(parents=True)
    program = build / "tests" / "small_tests"
    program.write_text(PROGRAM)
    program.chmod(0o755)
    (build / "tests" / "programs.txt").write_text(f"small {program}\n")
    monkeypatch.setenv("STARTS", str(tmp_path / "starts.txt"))
    monkeypatch.setattr(native_tests, "BUILD", tmp_path / "build")
    monkeypatch.setattr(native_tests, "REPORTS", tmp_path)
    monkeypatch.setattr(native_tests, "JOBS", 2)
    monkeypatch.setattr(native_tests, "TEST_LIMIT", 3)
    monkeypatch.setattr(tally, "DURATIONS", tmp_path / "durations.json")

    def run_with(**changes) -> tuple[tally.Tally, list[str]]:
        settings = dict(preset="release", k=None, fast=False, files=[], limit=60.0, extra=[])
        suite = native_tests.NativeSuite(argparse.Namespace(**{**settings, **changes}))

        async def run_all() -> None:
            await process.side_by_side(job for _, job in suite.jobs())

        asyncio.run(run_all())
        return suite.tally(), (tmp_path / "starts.txt").read_text().splitlines()

    return run_with


def test_a_crash_and_a_hanging_test_fail_and_the_others_run(run, capsys):
    counted, filters = run()
    assert counted == tally.Tally(passed=2, failed=3, skipped=1)
    assert len(filters) == 3  # two shards, and a process that goes on after the crash
    shown = capsys.readouterr().out
    assert "failed: small.Small/Case.Fails\nwords of Small/Case.Fails\n" in shown
    assert "words of Small/Case.Crashes\nthe process ended with signal SIGSEGV\n" in shown
    assert "words of Small/Case.Hangs\nended after " in shown
    assert "words of Small/Case.Passes" not in shown


def test_tests_are_chosen_by_name_speed_and_file(run, tmp_path):
    counted, filters = run(k="small.Small/Case.Pass")
    assert (counted, filters) == (tally.Tally(passed=1), ["Small/Case.Passes"])
    assert run(k="Slow")[0] == tally.Tally(passed=1)
    assert run(k="TalksLong", fast=True)[0] == tally.Tally()
    assert run(k="Passes", files=[tmp_path / "build/tests/a_test.cpp"])[0] == tally.Tally(passed=1)
    assert run(k="Passes", files=[tmp_path / "build/tests/b_test.cpp"])[0] == tally.Tally()


def test_a_process_that_ends_badly_after_its_tests_is_a_failure(run, capsys):
    counted, _ = run(k="Passes", extra=["--leaks"])
    assert counted == tally.Tally(passed=1, failed=1)
    assert "last words\nthe process ended with status 23\n" in capsys.readouterr().out


def test_the_longest_tests_are_spread_over_the_shards():
    program = native_tests.Program("small", Path("small_tests"), ["A", "B", "C", "D"])
    known = {"small.A": 5.0, "small.B": 1.0, "small.C": 4.0, "small.D": 3.0}
    shards = native_tests._shards(program, known)
    assert sorted(map(sorted, (shard.tests for shard in shards))) == [["A", "B"], ["C", "D"]]


def test_the_sanitizers_are_told_what_the_preset_says():
    suppressions = ROOT / "cmake" / "thread_sanitizer.supp"
    options = native_tests._environment("thread")["TSAN_OPTIONS"]
    assert options == f"halt_on_error=1:suppressions={suppressions}"
    assert suppressions.is_file()
    with pytest.raises(native_tests.Failed, match="no test preset 'fast'"):
        native_tests._environment("fast")
