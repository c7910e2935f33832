# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev test`: which files share a process, and what a crash of one of them costs the others."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "devtools"))

import testing  # noqa: E402
from tally import Tally  # noqa: E402

PASSES = "def test_it():\n    assert True\n"
FAILS = "def test_it():\n    assert False\n"
CRASHES = "import os\n\n\ndef test_it():\n    os._exit(11)\n"


@pytest.fixture
def written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder for test files, whose reports are beside them."""
    monkeypatch.setattr(testing, "REPORTS", tmp_path)
    monkeypatch.setattr(testing, "BUILD", tmp_path)
    return tmp_path


def files(folder: Path, *texts: str) -> tuple[Path, ...]:
    found = []
    for number, text in enumerate(texts):
        found.append(folder / f"test_{number}.py")
        found[-1].write_text(text)
    return tuple(found)


def ended(group: tuple[Path, ...]) -> Tally:
    words = ("-p", "no:cacheprovider", "-q")
    start = (sys.executable, ROOT / "devtools" / "run_pytest.py")
    run = testing.Run("blender", start, group, words, 60.0)
    return asyncio.run(testing._pytest(run)).tally


def test_quick_files_share_a_process_and_a_slow_one_has_its_own(written: Path) -> None:
    slow = "import pytest\n\npytestmark = pytest.mark.slow\n"
    texts = [PASSES] * (testing.FILES + 1)
    group = files(written, slow, *texts)
    found = list(testing._groups(list(group)))
    assert found[0] == group[:1]
    assert [len(one) for one in found] == [1, testing.FILES, 1]
    assert sum(found, ()) == group


def test_a_test_that_fails_is_counted_once(written: Path) -> None:
    assert ended(files(written, PASSES, FAILS, PASSES)) == Tally(passed=2, failed=1)


def test_after_a_crash_the_files_run_alone(written: Path) -> None:
    group = files(written, PASSES, CRASHES, PASSES)
    assert ended(group) == Tally(passed=2, failed=1)
    logs = {path.name for path in written.glob("*.log")}
    assert logs == {"blender.test_0_2.log", *(f"blender.test_{n}.log" for n in range(3))}
