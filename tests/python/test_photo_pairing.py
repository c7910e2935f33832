# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos that are paired with the wrong camera, by small renders of each."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from selenite.capture import pairing

NAMES = ("Front", "Side", "Back")


def view_of(camera: str) -> np.ndarray:
    """A picture with shapes of its own, (48, 64, 3)."""
    rng = np.random.default_rng(NAMES.index(camera) + 1)
    blocks = rng.uniform(0.1, 1.0, (6, 8))
    return np.repeat(np.kron(blocks, np.ones((8, 8)))[..., None], 3, axis=2)


def photo(name: str, camera: str, shows: str, exposure: float = 1.0) -> Any:
    """Of another exposure, colour and light; only the shapes are those of a render."""
    light = np.linspace(0.5, 1.5, 64)[None, :, None]
    picture = view_of(shows) * exposure * light * np.array([0.9, 0.5, 0.2])
    return SimpleNamespace(
        id=name, camera=camera, reference=picture, weight=np.ones((48, 64)), frame=(), lights={}
    )


@pytest.fixture
def rendered(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Cameras in the order in which they are rendered."""
    found: list[str] = []

    def render(_scene: Any, capture: Any) -> np.ndarray:
        found.append(capture.camera)
        return view_of(capture.camera)

    def replaced(item: Any, **changes: Any) -> Any:
        return SimpleNamespace(**(vars(item) | changes))

    monkeypatch.setattr(pairing, "_rendered", render)
    monkeypatch.setattr(pairing, "replace", replaced)
    return found


def test_photos_of_their_own_cameras_are_no_problem(rendered: list[str]) -> None:
    photos = [photo(name, name, name, 3.0) for name in NAMES]
    found = pairing.paired(photos, NAMES, None)
    assert found.camera == {} and found.problems(photos) == []
    assert np.diag(found.correlation).min() > 0.9 and rendered == list(NAMES)


def test_two_photos_that_are_swapped_are_named_with_their_cameras(rendered: list[str]) -> None:
    shown = {"Front": "Side", "Side": "Front", "Back": "Back"}
    photos = [photo(name, name, shown[name], 0.3) for name in NAMES]
    found = pairing.paired(photos, NAMES, None)
    assert found.camera == {"Front": "Side", "Side": "Front"}
    (problem,) = found.problems(photos)
    assert problem.object == "Photos 'Front', 'Side'" and problem.kind == pairing.KIND
    assert "'Front' like camera 'Side'" in problem.cause and len(rendered) == 3


def test_three_photos_in_a_circle_and_one_of_a_camera_without_a_photo(rendered: list[str]) -> None:
    circle = dict(zip(NAMES, (*NAMES[1:], NAMES[0]), strict=True))
    photos = [photo(name, name, circle[name]) for name in NAMES]
    assert pairing.paired(photos, NAMES, None).camera == circle
    alone = [photo("Front", "Front", "Back"), photo("Side", "Side", "Side")]
    assert pairing.paired(alone, NAMES, None).camera == {"Front": "Back"}
    assert rendered


def test_what_is_not_clear_is_not_said(rendered: list[str]) -> None:
    """A photo of nothing in the scene; two photos of one place; a photo that is black."""
    noise = photo("Front", "Front", "Front")
    noise.reference = np.random.default_rng(9).uniform(0.1, 1.0, (48, 64, 3))
    black = photo("Side", "Side", "Side")
    black.reference = np.zeros((48, 64, 3))
    assert pairing.paired([noise, black], NAMES, None).camera == {}
    twice = [photo("Front", "Front", "Back"), photo("Side", "Side", "Back")]
    assert pairing.paired(twice, NAMES, None).camera == {}
    taken = [photo("Front", "Front", "Back"), photo("Back", "Back", "Back")]
    assert pairing.paired(taken, NAMES, None).camera == {}
    assert rendered
