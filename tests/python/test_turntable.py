# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that turns with the camera, and shifts of photos that are not to be believed."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from selenite.capture.prepared import Capture, without_photo
from selenite.capture.views import View
from selenite.fit.diagnosis.course import FIRST_ITERATION, diagnose
from selenite.fit.diagnosis.turntable import light_turns
from selenite.report.aligned import doubtful, sentences
from selenite.report.results import _capture_entry

SIZE, RADIUS, COUNT = 40, 15.0, 8
ANGLES = np.linspace(0, 2 * np.pi, COUNT, endpoint=False)


def ball(lamp: float) -> tuple[np.ndarray, np.ndarray]:
    """A matte ball under a lamp at that angle from the camera, and which pixels show it."""
    y, x = (np.mgrid[:SIZE, :SIZE] - SIZE / 2 + 0.5) / RADIUS
    inside = x * x + y * y < 1
    z = np.sqrt(np.clip(1 - x * x - y * y, 0, 1))
    lit = 0.1 + np.clip(np.sin(lamp) * x + np.cos(lamp) * z, 0, 1)
    picture = np.where(inside, lit, 0)
    return np.repeat(picture[..., None], 3, axis=2).astype(np.float32), inside


def views(photo_lamps: np.ndarray, render_lamps: np.ndarray) -> list[View]:
    """Photos and renders under lamps at these angles from their cameras."""
    found = []
    for index, (own, other) in enumerate(zip(photo_lamps, render_lamps, strict=True)):
        photo, inside = ball(own)
        found.append(View(f"{index}", photo, inside.astype(np.float32), ball(other)[0]))
    return found


def azimuths(angles: np.ndarray = ANGLES) -> dict[str, float]:
    return {f"{index}": float(angle) for index, angle in enumerate(angles)}


def test_light_that_turns_with_the_camera_is_seen_and_no_silhouette_is_blamed() -> None:
    turned = views(np.full(COUNT, 0.8), 0.8 - ANGLES)
    (note,) = light_turns(turned, azimuths())
    assert note.startswith("The right side is the bright one in 8 photos") and "turntable" in note
    rows = FIRST_ITERATION + 1
    history = {
        "iteration": np.arange(rows), "validation": np.full(rows, np.nan),
        "validation_standard_error": np.full(rows, np.nan), "values": {},
    }  # fmt: skip
    notes = diagnose(history, [], turned, azimuths=azimuths())
    assert note in notes and not any("silhouette" in text for text in notes)
    # Without the cameras' places it is not known, and the silhouette is.
    assert any("silhouette" in text for text in diagnose(history, [], turned))


@pytest.mark.parametrize(
    ("photos", "renders", "angles"),
    [
        (0.8 - ANGLES, 0.8 - ANGLES, ANGLES),  # the scene's own lamp
        (0.8 - ANGLES, -0.8 - ANGLES, ANGLES),  # a wrong one that stands still
        (np.full(COUNT, 0.8), np.full(COUNT, 0.8), ANGLES),  # lamps of captures follow the camera
        (np.zeros(COUNT), -ANGLES, ANGLES),  # a flash: no side is the bright one
        (np.full(COUNT, 0.8), 0.8 - ANGLES, ANGLES / 8),  # cameras on one side
    ],
)
def test_other_light_is_no_turntable(
    photos: np.ndarray, renders: np.ndarray, angles: np.ndarray
) -> None:
    assert light_turns(views(photos, renders), azimuths(angles)) == []


def aligned(*shifts: tuple[float, float, float]) -> tuple[list[Capture], dict[str, object]]:
    """Photos of 40 x 30 pixels and what the native fit says of their shifts."""
    blank = np.zeros((30, 40, 3), np.float32)
    one = Capture("", "Front", "", (40, 30), blank, blank[..., 0] + 1, 4 / 3, align=True)
    captures = [replace(one, id=f"{index}") for index in range(len(shifts))]
    rows = {item.id: {"shift": shift} for item, shift in zip(captures, shifts, strict=True)}
    return captures, {"captures": rows, "stages": ({"height": 30},)}


def test_a_shift_at_its_limit_and_one_far_from_the_others_are_named() -> None:
    usual = [(0.3, 0.1, 0.0), (0.2, -0.1, 0.0), (0.4, 0.0, 0.001), (0.3, 0.0, 0.0)]
    assert doubtful(*aligned(*usual)) == {}
    found = doubtful(*aligned(*usual, (2.5, 0.0, 0.0), (0.0, -4.0, 0.0), (0.0, 0.0, -0.16)))
    assert found == {"4": "apart", "5": "limit", "6": "limit"}
    at_limit, apart = sentences(found)
    assert "limit of 4 pixels for '5', '6'" in at_limit and "moves '4' farther" in apart
    captures, result = aligned(*usual, (0.0, -4.0, 0.0))
    doubted = result | {"doubtful_shifts": doubtful(captures, result)}
    rows = [_capture_entry(item, doubted)["shift_believed"] for item in captures]
    assert rows == [True] * 4 + [False]
    # All cameras of a rig that is off by the same: no photo lies apart.
    assert doubtful(*aligned(*[(2.5 + x, y, 0.0) for x, y, _ in usual])) == {}


def test_what_noise_hides_is_no_number() -> None:
    (capture,), _ = aligned((0.0, 0.0, 0.0))
    for share, shown in ((0.0, None), (0.2, 0.2)):
        row = {"unexplained": share, "shift": (0.0, 0.0, 0.0)}
        assert _capture_entry(capture, {"captures": {"0": row}})["unexplained"] == shown


def test_cameras_without_a_photo_are_one_line() -> None:
    cameras = [SimpleNamespace(name=f"C{index}") for index in range(9)]
    scene, asked = SimpleNamespace(cameras=cameras), [SimpleNamespace(camera="C0")]
    line = without_photo(scene, asked)  # type: ignore[arg-type]
    assert line == "8 of 9 cameras have no photo: 'C1', 'C2', 'C3' and 5 more"
    assert without_photo(scene, [SimpleNamespace(camera=item.name) for item in cameras]) == ""  # type: ignore[arg-type,misc]
