# SPDX-License-Identifier: GPL-3.0-or-later
"""What another photo adds: linear algebra on paper, directions in words."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "addon"))

from selenite.advice.information import fisher  # noqa: E402
from selenite.advice.next_camera import report  # noqa: E402
from selenite.advice.next_camera.candidates import Candidate, looking_at  # noqa: E402


def test_python_reads_the_native_errors() -> None:
    """What they are on paper: tests/fit/fisher_information_test.cpp."""
    ranges = np.array([1.0, 1.0])
    before = fisher.errors([np.diag([1e4, 0.0])], ranges)
    assert before == pytest.approx([0.01, 0.29], rel=1e-3)
    assert fisher.determined(before, ranges).tolist() == [True, False]
    after = fisher.errors([np.diag([1e4, 0.0]), np.diag([0.0, 1e4])], ranges)
    assert fisher.gain(before, after, [[0], [1]]) == pytest.approx(np.log(29) / 2, rel=1e-3)


def place(azimuth: float, elevation: float, existing: bool = False) -> Candidate:
    camera: Any = SimpleNamespace(name="Side", matrix=np.eye(4))
    return Candidate(camera, azimuth, elevation, existing)


@pytest.mark.parametrize(
    ("candidate", "words"),
    [
        (place(0, 38), "from the side of 'Front', 38° up"),
        (place(-90, 12), "90° to the left of 'Front', 12° up"),
        (place(90.4, 0), "90° to the right of 'Front', level"),
        (place(180, -20), "from behind, opposite 'Front', 20° down"),
        (place(45, 85), "from straight above"),
        (place(45, 10, existing=True), "camera 'Side'"),
    ],
)
def test_directions_are_told_in_words(candidate: Candidate, words: str) -> None:
    assert report.where(candidate, "Front") == words


@pytest.mark.parametrize("position", [(3.0, 4.0, 5.0), (0.0, 0.0, 2.0), (1.0, 0.0, -7.0)])
def test_a_camera_looks_at_the_centre_and_stands_upright(position: tuple[float, ...]) -> None:
    centre = np.array([1.0, -2.0, 0.5])
    matrix = looking_at(np.array(position) + centre, centre)
    turn = matrix[:3, :3]
    assert turn.T @ turn == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1)
    towards = -np.array(position) / np.linalg.norm(position)
    assert -turn[:, 2] == pytest.approx(towards)
    assert turn[2, 0] == pytest.approx(0)  # the horizon is level
    assert turn[2, 1] >= -1e-12
