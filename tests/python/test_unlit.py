# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos that are bright where the renders of an opaque body are dark."""

from __future__ import annotations

import numpy as np
import pytest

from selenite.capture.views import View
from selenite.fit.diagnosis.course import FIRST_ITERATION, diagnose
from selenite.fit.diagnosis.unlit import light_in_the_dark

SIZE, RADIUS = 48, 18.0


def ball(lamp: float, glow: float = 0.0, shift: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """A matte ball under a lamp in that direction (degrees), and which pixels show it. glow: of
    what is not lit, as light that comes through."""
    y, x = (np.mgrid[:SIZE, :SIZE] - SIZE / 2 + 0.5) / RADIUS
    x = x - shift / RADIUS
    inside = x * x + y * y < 1
    z = np.sqrt(np.clip(1 - x * x - y * y, 0, 1))
    turn = np.radians(lamp)
    lit = np.clip(np.sin(turn) * x + np.cos(turn) * z, 0, 1)
    picture = np.where(inside, 0.6 * lit + glow * (1 - lit), 0)
    return np.repeat(picture[..., None], 3, axis=2).astype(np.float32), inside


def views(lamps: tuple[float, ...] = (60, 90, 120, 180), noise: float = 0.02, **photo: float):
    """The photos beside renders of the opaque ball."""
    rng = np.random.default_rng(1)
    found = []
    for lamp in lamps:
        picture, inside = ball(lamp)
        noisy = picture * np.clip(1 + noise * rng.standard_normal(picture.shape), 0, None)
        reference = ball(lamp, **photo)[0]
        weight = inside.astype(np.float32)
        found.append(View(f"{lamp}", reference, weight, noisy.astype(np.float32)))
    return found


def test_light_that_comes_through_the_body_is_seen() -> None:
    (note,) = light_in_the_dark(views(glow=0.1))
    assert note.startswith("4 of 4 photos") and "medium" in note and "light of the room" in note


@pytest.mark.parametrize(
    "photo",
    [
        {},  # opaque
        {"shift": 1.5},  # by a camera that is a little off
        {"glow": 0.012},  # black that is not quite black
    ],
)
def test_an_opaque_body_is_dark_there(photo: dict[str, float]) -> None:
    assert light_in_the_dark(views(**photo)) == []


def test_noise_of_the_renders_is_not_dark() -> None:
    assert light_in_the_dark(views((10, 20, 30, 40), noise=1.5)) == []


def test_two_photos_are_too_few() -> None:
    assert light_in_the_dark(views((90, 120), glow=0.1)) == []


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"opaque": True}, 1),
        ({"opaque": True, "running": True}, 0),  # what is left to do may still light it
        ({"opaque": False}, 0),
    ],
)
def test_it_is_said_at_the_end_of_an_opaque_fit(how: dict[str, bool], said: int) -> None:
    rows = FIRST_ITERATION + 1
    history = {
        "iteration": np.arange(rows),
        "validation": 0.1 * 0.5 ** np.arange(rows),
        "validation_standard_error": np.full(rows, 1e-5),
        "values": {},
    }
    notes = diagnose(history, [], views(glow=0.1), **how)
    assert sum("leaves dark" in note for note in notes) == said


def test_no_silhouette_is_blamed_for_light_in_the_dark() -> None:
    """Light from one side, through the body, moves the middle of what is bright."""
    rows = FIRST_ITERATION + 1
    history = {
        "iteration": np.arange(rows),
        "validation": 0.1 * 0.5 ** np.arange(rows),
        "validation_standard_error": np.full(rows, 1e-5),
        "values": {},
    }
    seen = views(glow=0.3, shift=2.0)
    alone = diagnose(history, [], seen)
    assert any("silhouette" in text for text in alone)
    together = diagnose(history, [], seen, opaque=True)
    assert any("light comes through" in text for text in together)
    assert not any("silhouette" in text for text in together)
