# SPDX-License-Identifier: GPL-3.0-or-later
"""Grids in .npy and .vol files: what is written is read again, and what is wrong is refused."""

from __future__ import annotations

import io
import os
import pickle
import struct
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "addon"))

from selenite import grid_files  # noqa: E402
from selenite.problems import BadInput  # noqa: E402


def grid(channels: int = 3) -> np.ndarray:
    """2 slices of 3 rows of 4 voxels, every number another."""
    return np.linspace(0, 1, 24 * channels, dtype=np.float32).reshape(2, 3, 4, channels)


def header(**changes: int | bytes) -> bytes:
    """The first 48 bytes of a .vol of 4 x 3 x 2 voxels of one channel."""
    fields = {"word": b"VOL", "version": 3, "encoding": 1, "nx": 4, "ny": 3, "nz": 2, "channels": 1}
    fields |= changes
    return struct.pack("<3sB5i6f", *fields.values(), 0, 0, 0, 1, 1, 1)


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("ending", ["npy", "vol"])
def test_what_is_written_is_read_again(tmp_path: Path, channels: int, ending: str) -> None:
    path, values = tmp_path / f"grid.{ending}", grid(channels)
    if ending == "npy":
        grid_files.write_npy(path, values)
    else:
        grid_files.write_vol(path, values, np.array([-1, 0, 2.5]), np.array([1, 3, 4]))
    found = grid_files.read(str(path))
    assert found.dtype == np.float32
    assert np.array_equal(found, values)


def test_vol_is_laid_out_as_mitsuba_reads_it(tmp_path: Path) -> None:
    path = tmp_path / "grid.vol"
    grid_files.write_vol(path, grid(), np.array([-1, 0, 2.5]), np.array([1, 3, 4]))
    data = path.read_bytes()
    assert data[:4] == b"VOL\x03"
    assert struct.unpack_from("<5i", data, 4) == (1, 4, 3, 2, 3)
    assert struct.unpack_from("<6f", data, 24) == (-1, 0, 2.5, 1, 3, 4)
    # Voxel (x, y, z) = (1, 2, 1), channel 2, at ((z ny + y) nx + x) channels + 2.
    at = 48 + 4 * (((1 * 3 + 2) * 4 + 1) * 3 + 2)
    assert struct.unpack_from("<f", data, at)[0] == grid()[1, 2, 1, 2]


def test_numbers_may_lack_the_last_axis(tmp_path: Path) -> None:
    np.save(tmp_path / "grid.npy", grid(1)[..., 0].astype(np.float64))
    assert np.allclose(grid_files.read(str(tmp_path / "grid.npy")), grid(1))


NUMBERS = grid(1).tobytes()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "shorter than a header"),
        (header(word=b"VOX") + NUMBERS, "does not begin with VOL"),
        (header(version=2) + NUMBERS, "version 3"),
        (header(encoding=3) + NUMBERS, "encoding is 3"),
        (header(channels=6) + NUMBERS, "6 channels"),
        (header(nx=0) + NUMBERS, "its size is 2 x 3 x 0"),
        (header(nx=-4) + NUMBERS, "its size is 2 x 3 x -4"),
        # 2^36 numbers: refused before memory is asked for
        (header(nx=4096, ny=4096, nz=4096) + NUMBERS, "at most 4096"),
        (header() + NUMBERS[:-4], "it holds 23 numbers, its header announces 24"),
        (header() + NUMBERS + b"\0", "its header announces 24"),
    ],
)
def test_a_bad_vol_is_refused_by_name(tmp_path: Path, content: bytes, words: str) -> None:
    path = tmp_path / "bad.vol"
    path.write_bytes(content)
    with pytest.raises(BadInput, match="bad.vol") as error:
        grid_files.read(str(path))
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (np.zeros((2, 3), np.float32), "not (nz, ny, nx)"),
        (np.zeros((2, 3, 4, 2), np.float32), "2 channels"),
        (np.zeros((2, 3, 4), np.uint8), "type uint8, not float"),
        (np.array([{}], object), "cannot be read"),
        (np.zeros((1, 1, 5000), np.float32), "at most 4096"),
    ],
)
def test_a_bad_npy_is_refused_by_name(tmp_path: Path, values: np.ndarray, words: str) -> None:
    path = tmp_path / "bad.npy"
    np.save(path, values)
    with pytest.raises(BadInput, match="bad.npy") as error:
        grid_files.read(str(path))
    assert words in str(error.value)


def _archive() -> bytes:
    packed = io.BytesIO()
    np.savez(packed, np.zeros((2, 2, 2)))
    return packed.getvalue()


@pytest.mark.parametrize(
    "content",
    [
        b"",
        _archive(),
        pickle.dumps({"a": 1}),
        b"\x93NUMPY\x01\x00\x10\x00{'descr': '<f4', ",
        b"\x93NUMPY\x01\x00\x08\x00[1, 2]  ",
        b"\x93NUMPY\x09\x00\x08\x00[1, 2]  ",
    ],
)
def test_an_npy_that_is_no_array_is_refused_by_name(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "bad.npy"
    path.write_bytes(content)
    with pytest.raises(BadInput, match="cannot be read") as error:
        grid_files.read(str(path))
    assert "bad.npy" in str(error.value)


def test_a_fortran_array_keeps_its_places(tmp_path: Path) -> None:
    values = np.arange(24, dtype=float).reshape(2, 3, 4)
    np.save(tmp_path / "a.npy", np.asfortranarray(values))
    assert np.array_equal(grid_files.read(str(tmp_path / "a.npy"))[..., 0], values)


def test_other_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="ending '.txt' is not known"):
        grid_files.read(str(tmp_path / "grid.txt"))
    with pytest.raises(BadInput, match="cannot be read"):
        grid_files.read(str(tmp_path / "missing.vol"))


def npy(header: str, version: bytes = b"\x01\x00") -> bytes:
    """A .npy with that header and no numbers."""
    text = header.encode()
    return b"\x93NUMPY" + version + struct.pack("<H", len(text)) + text


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x93NUMPY",
        b"\x80\x04K\x01.",  # a pickle
        b"PK\x03\x04" + bytes(100),  # an archive: a .npz under another name
        npy("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 2, 2)}"),
        npy("{'descr': '|O', 'fortran_order': False, 'shape': (1, 1, 1)}"),
        npy("{'descr': '<f4', 'fortran_order': False, 'shape': (-1, 1, 1)}"),
        npy("{'descr': '<f4', 'fortran_order': False, 'shape': (99999999999999999999, 1, 1)}"),
        npy("{'descr': 7, 'fortran_order': False, 'shape': (1, 1, 1)}"),
        npy("{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (1, 1, 1)}"),
        npy("{" * 500),
        npy("(" * 5000),
        npy("{'descr'"),
        npy("\x00"),
        npy("{'descr': '<f4', 'fortran_order': False, 'shape': (0, 2, 2)}"),
        b"\x93NUMPY\x09\x00" + bytes(100),
    ],
)
def test_what_is_no_npy_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "grid.npy").write_bytes(content)
    with pytest.raises(BadInput, match=r"grid\.npy': cannot be read"):
        grid_files.read(str(tmp_path / "grid.npy"))


@pytest.mark.parametrize("ending", ["npy", "vol"])
def test_folders_and_pipes_are_no_grids(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"grid.{ending}"
    path.mkdir()
    with pytest.raises(BadInput, match="it is a folder"):
        grid_files.read(str(path))
    path.rmdir()
    os.mkfifo(path)
    with pytest.raises(BadInput, match="it is a pipe"):
        grid_files.read(str(path))
