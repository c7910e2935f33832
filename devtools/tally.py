# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests counted in JUnit reports, and how long they took the last time."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from process import BUILD, say

REPORTS = BUILD / "test-reports"
DURATIONS = BUILD / "test-durations.json"


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


def read_report(report: Path, status: int) -> Tally:
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


def last_durations(suite: str) -> dict[str, float]:
    """Seconds by name, of what has run in this checkout before."""
    return _durations().get(suite, {})


def keep_durations(suite: str, seconds: Mapping[str, float]) -> None:
    known = _durations()
    known.setdefault(suite, {}).update(seconds)
    partial = DURATIONS.with_suffix(".partial")
    partial.write_text(json.dumps(known))
    partial.replace(DURATIONS)


def _durations() -> dict[str, dict[str, float]]:
    return json.loads(DURATIONS.read_text()) if DURATIONS.is_file() else {}
