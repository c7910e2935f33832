# SPDX-License-Identifier: GPL-3.0-or-later
"""A photo in which no light was on is refused before a fit, not fitted for minutes."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from selenite.fit.diagnosis.darkness import problems_of_darkness
from selenite.scene_read.values import LightValues, MaterialValues, SceneValues, WorldValues

ALL: dict[str, Any] = {"lamps": None, "world": True, "places": {}}
WHITE, BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)


def lamp(name: str, power: float = 10.0) -> LightValues:
    return LightValues(name, "POINT", np.eye(4), power, WHITE, 1.0, "W", {"radius": 0.1})


def material(**values: Any) -> MaterialValues:  # noqa: ANN401
    return MaterialValues("Body", values, multi_ggx=False, flavour="2")


def photo(name: str, **lights: Any) -> Any:  # noqa: ANN401
    return SimpleNamespace(id=name, lights=ALL | lights)


def unknown(owner: str, name: str) -> Any:  # noqa: ANN401
    kind = "emission" if name in ("power", "strength", "emission_strength") else "surface"
    return SimpleNamespace(owner=owner, parameter=SimpleNamespace(effect=kind, scale="linear"))


def objects(scene: SceneValues, *photos: Any, fitted: Any = ()) -> list[str]:  # noqa: ANN401
    found = problems_of_darkness(scene, photos, [unknown(*pair) for pair in fitted], ())
    return [item.object for item in found]


@pytest.mark.parametrize(
    ("color", "strength", "dark"), [(BLACK, 1.0, True), (WHITE, 0.0, True), (WHITE, 1.0, False)]
)
def test_a_scene_without_light_is_refused(color: Any, strength: float, dark: bool) -> None:  # noqa: ANN401, FBT001
    """A new material of Blender 3 has an emission strength of 1 and black."""
    body = material(emission_color=color, emission_strength=(strength,))
    scene = SceneValues(materials=[body], lights=[lamp("Key", 0.0)])
    assert objects(scene, photo("a")) == (["Scene"] if dark else [])


def test_a_light_that_is_fitted_is_one() -> None:
    scene = SceneValues(materials=[material()], lights=[lamp("Key", 0.0)])
    for owner, name in (("Key", "power"), ("World", "strength"), ("Body", "emission_strength")):
        assert not objects(scene, photo("a"), fitted=[(owner, name)])
    assert objects(scene, photo("a"), fitted=[("Body", "roughness")]) == ["Scene"]


def test_a_photo_whose_lights_are_off_is_named() -> None:
    scene = SceneValues(materials=[material()], lights=[lamp("Key"), lamp("Spare", 0.0)])
    photos = [
        photo("lit", lamps=["Key"], world=False),
        photo("spare", lamps=["Spare"], world=False),
        photo("none", lamps=[]),
    ]
    assert objects(scene, *photos) == ["Photo 'spare'", "Photo 'none'"]
    scene.world = WorldValues(color=WHITE, strength=1.0)
    assert objects(scene, *photos) == ["Photo 'spare'"], "its world was off too"
    assert not objects(scene, *photos, fitted=[("Spare", "power")])
    (problem,) = problems_of_darkness(scene, [photos[1]], (), ())
    assert problem.cause == "its lights give no light (lamp 'Spare', world off)"
