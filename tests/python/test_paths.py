# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths that a user may give: every fault is a sentence; names of files are never the same."""

from __future__ import annotations

import itertools
import os
import shutil
import sys
import tracemalloc
from contextlib import nullcontext
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "addon"))

from selenite import atomic_files, paths  # noqa: E402
from selenite.atomic_files import write_json  # noqa: E402
from selenite.json_text import json_text, read_json  # noqa: E402

NOT_UTF8 = os.fsdecode(b"caf\xe9")


def test_names_without_need_stay_and_the_others_get_numbers() -> None:
    names = ["a b", "Front#2", "a/b", "a_b", "Key Light"]
    assert paths.file_stems(names) == {
        "a b": "a_b-2", "Front#2": "Front#2", "a/b": "a_b-3", "a_b": "a_b",
        "Key Light": "Key_Light",
    }  # fmt: skip


@pytest.mark.parametrize(
    "names",
    [
        ["a_b-2", "a b", "a/b", "a_b"],
        ["Cam", "cam", "CAM"],
        ["caf\u00e9", "cafe\u0301", "CAF\u00c9"],  # as macOS and Windows see them: one name
        ["x" * 300, "x" * 301, "\u00e9" * 200],
        ["", "_", "/", "\n", ".", ".."],
        [NOT_UTF8, os.fsdecode(b"caf\xe8"), "caf_"],
        ["stra\u00dfe", "STRASSE"],
        ["nul", "NUL", "_nul", "nul.left"],
    ],
)
def test_stems_are_never_the_same_file(names: list[str]) -> None:
    for order in itertools.islice(itertools.permutations(names), 6):
        stems = paths.file_stems(order)
        assert list(stems) == list(order)
        assert len({stem.casefold() for stem in stems.values()}) == len(names)
        for stem in stems.values():
            assert 1 <= len(stem.encode()) <= 160
            assert "/" not in stem and not stem.startswith(".")


def test_no_stem_is_a_device_of_windows() -> None:
    names = ["CON", "Aux.left", "COM1", "lpt9", "COM0", "console", "nul_"]
    assert list(paths.file_stems(names).values()) == [
        "_CON", "_Aux.left", "_COM1", "_lpt9", "COM0", "console", "nul_",
    ]  # fmt: skip


@pytest.mark.parametrize(("windows", "tries"), [(True, 3), (False, 1)])
def test_a_file_that_windows_holds_is_tried_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, windows: bool, tries: int
) -> None:
    """Windows alone refuses to replace what another program reads."""
    done = []

    def refused_twice(partial: Path, target: Path) -> None:
        done.append(target)
        if len(done) < 3:
            raise PermissionError(13, "Permission denied", str(target))
        partial.rename(target)

    monkeypatch.setattr(Path, "replace", refused_twice)
    monkeypatch.setattr(atomic_files, "_WINDOWS", windows)
    expected = nullcontext() if windows else pytest.raises(PermissionError)
    with expected:
        atomic_files.write_json(tmp_path / "a.json", {"a": 1})
    assert len(done) == tries
    assert sorted(item.name for item in tmp_path.iterdir()) == ["a.json"] * windows


def test_a_file_that_stays_held_is_refused_in_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(_partial: Path, _target: Path) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "replace", refused)
    monkeypatch.setattr(atomic_files, "_WINDOWS", True)
    monkeypatch.setattr(atomic_files, "_PATIENCE", 0.1)
    with pytest.raises(PermissionError):
        atomic_files.write_json(tmp_path / "a.json", {"a": 1})
    assert not list(tmp_path.iterdir())


def test_what_is_no_file_is_told(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    (tmp_path / "file").write_text("")
    for name, words in {
        "file": "",
        "nowhere": "it does not exist",
        "file/below": "it does not exist",
        "pipe": "it is a pipe or a device",
        ".": "it is a folder",
        "loop": "too many levels of symbolic links",
        "x" * 300: "file name too long",
        "a\0b": "embedded null",
    }.items():
        assert words in paths.why_not_file(f"{tmp_path}/{name}"), name
        assert bool(words) == bool(paths.why_not_file(f"{tmp_path}/{name}")), name
    assert paths.why_not_file("/dev/zero") == "it is a pipe or a device, not a file"


@pytest.mark.parametrize("text", ["~nobody-of-that-name/x", "a\0b", "loop", NOT_UTF8, "x" * 5000])
def test_no_path_raises(text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    monkeypatch.chdir(tmp_path)
    path = paths.absolute(text)
    assert path.is_absolute() or "\0" in text
    assert paths.why_not_file(path)


def test_a_folder_that_cannot_be_written_is_told_and_nothing_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    assert paths.why_not_folder(tmp_path / "new" / "folder") == ""
    assert "'" + str(tmp_path / "file") + "' is not a folder" in paths.why_not_folder(
        tmp_path / "file" / "x"
    )
    assert "is not a folder" in paths.why_not_folder(tmp_path / "loop" / "x")
    assert paths.why_not_folder(tmp_path / ("x" * 300) / "y") == "its name is too long"
    assert sorted(item.name for item in tmp_path.iterdir()) == ["file", "loop"]

    class Usage(NamedTuple):
        total: int
        used: int
        free: int

    monkeypatch.setattr(shutil, "disk_usage", lambda _path: Usage(10**9, 10**9 - 2000, 2000))
    assert paths.why_not_folder(tmp_path, 2000) == ""
    text = "the disk has 2 kB left, and the files take about 5 MB"
    assert paths.why_not_folder(tmp_path, 5_000_000) == text


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_read_only_folder_is_told(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    assert "permission denied" in paths.why_not_folder(tmp_path / "new")
    assert paths.why_not_output(tmp_path / "a.exr")
    tmp_path.chmod(0o700)


def test_outputs_are_files_in_folders_that_exist(tmp_path: Path) -> None:
    assert paths.why_not_output(tmp_path / "a.exr") == ""
    assert paths.why_not_output(tmp_path) == "it is a folder"
    assert paths.why_not_output(tmp_path / "no" / "a.exr") == "its folder does not exist"
    assert "pipe or a device" in paths.why_not_output(Path("/dev/null"))


def test_json_is_json_whatever_the_values(tmp_path: Path) -> None:
    data = {"name": NOT_UTF8, "bad": [float("nan"), (float("inf"), 1.5)], "text": "\u00e9\n"}
    text = json_text(data)
    assert "\n" not in text
    text.encode()  # UTF-8
    write_json(tmp_path / "a.json", data)
    assert read_json(tmp_path / "a.json") == {
        "name": NOT_UTF8, "bad": [None, [None, 1.5]], "text": "\u00e9\n",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"{", "it is not JSON"),
        (b"", "it is not JSON"),
        (b"\xff\xfe{\x00", "it is not text in UTF-8"),
        (b"[" * 100_000, "nested too deeply"),
        (b'{"a": ' + b"9" * 5000 + b"}", "limit"),
        (b" " * 70, "more than"),
    ],
)
def test_what_is_no_json_is_told(content: bytes, words: str, tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_bytes(content)
    largest = 64 if len(content) == 70 else 1 << 20
    with pytest.raises(ValueError, match=words):
        read_json(path, largest)
    with pytest.raises(ValueError, match="pipe or a device"):
        read_json(Path("/dev/zero"))


def test_json_takes_memory_by_the_size_of_its_file(tmp_path: Path) -> None:
    """Not by the largest that is permitted, which a state of a fit reaches only with big grids."""
    path = tmp_path / "a.json"
    write_json(path, {"a": 1})
    tracemalloc.start()
    try:
        assert read_json(path, 1 << 30) == {"a": 1}
        assert tracemalloc.get_traced_memory()[1] < 1 << 20
    finally:
        tracemalloc.stop()
