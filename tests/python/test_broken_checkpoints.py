# SPDX-License-Identifier: GPL-3.0-or-later
"""A record of an unfinished run that is damaged is refused by name, never with a traceback."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench")]

pytest.importorskip("selenite._core", reason="the native module is not built")
from fuzzing import seeds  # noqa: E402

from selenite.fit import checkpoint  # noqa: E402
from selenite.problems import BadInput  # noqa: E402


@pytest.fixture
def run(tmp_path: Path) -> Path:
    seeds.make("checkpoints", tmp_path)
    return tmp_path / "run"


def test_a_whole_record_is_read(run: Path) -> None:
    found = checkpoint.load(run)
    assert found.state is not None
    assert found.state.file.read_bytes() == bytes(range(256)) * 4 and found.state.seconds == 1.0


@pytest.mark.parametrize(
    ("files", "change"),
    [
        ("state.json", lambda data: data[:-20]),
        ("state.json", lambda _: b"[" * 100_000),
        ("state.json", lambda data: data.replace(b'"file"', b'"life"')),
        ("state.json", lambda _: b"\xff\xfe"),
        ("run.json", lambda _: b"[" * 100_000),
        ("run.json", lambda data: data.replace(b"{", b"[", 1)),
    ],
)
def test_a_damaged_file_is_refused_by_name(
    run: Path, files: str, change: Callable[[bytes], bytes]
) -> None:
    (path,) = run.glob(files)
    path.write_bytes(change(path.read_bytes()))
    with pytest.raises(BadInput) as error:
        checkpoint.load(run)
    assert str(run) in str(error.value)
