# SPDX-License-Identifier: GPL-3.0-or-later
"""What a capture says of its photo reaches the native fit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from selenite import _core
from selenite.capture.prepared import Capture

SIZE = 8
POWERS = {"Key": 300.0, "Fill": 120.0}
GAIN = (1.7, 1.0, 0.6)


def floor(world: float = 1.0, fill_at: tuple[float, ...] = (2.0, 0, 2), **powers: float) -> Any:  # noqa: ANN401 - a native Scene has no Python type
    """A matte square from 3 m above, under lamps at its sides."""
    builder = _core.SceneBuilder()
    material = builder.add_material("Floor", {"base_color": [0.5, 0.4, 0.3], "roughness": 1.0})
    corners = np.array([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], np.float32)
    triangles = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    normals = np.tile(np.array([0, 0, 1], np.float32), (6, 1))
    mesh = builder.add_mesh("Floor", corners, triangles, normals, np.zeros(2, np.int32))
    builder.add_object("Floor", mesh, np.eye(4), [material])
    for place, name in (((-2.0, 0, 2), "Key"), (fill_at, "Fill")):
        matrix = np.eye(4)
        matrix[:3, 3] = place
        power = powers.get(name, POWERS[name])
        builder.add_point_light(name, matrix, power, np.ones(3), 0.1, True)
    builder.set_world(np.full(3, 0.05), world)
    above = np.eye(4)
    above[2, 3] = 3
    builder.add_camera("Camera", above, "PERSP", 50, 36, 24, "AUTO", 0, 0, 1, 0.01, 100)
    return builder.build()


def lights(lamps: list[str] | None = None, world: bool = True, **places: tuple) -> dict:
    return {"lamps": lamps, "world": world, "places": places}


def capture(name: str, lamps: list[str] | None = None) -> Capture:
    """Of a scene without the light of other lamps."""
    dark = {lamp: 0.0 for lamp in POWERS if lamps is not None and lamp not in lamps}
    film = _core.render(floor(**dark), "Camera", SIZE, SIZE, 64, threads=1, seed=9)
    picture = np.ascontiguousarray(film.image, np.float32)
    weight = np.ones((SIZE, SIZE), np.float32)
    return Capture(name, "Camera", "", (SIZE, SIZE), picture, weight, 1.0, lights=lights(lamps))


def unknown(owner: str, parameter: str, start: list[float], low: float, high: float) -> Any:  # noqa: ANN401
    return _core.Unknown(owner, parameter, low, high, start)


def fitted(captures: list[Capture], unknowns: list[Any]) -> dict[str, list[float]]:
    settings = {"iterations": 15, "spp": 16, "threads": 1, "search": "off", "refinement_spp": 64}
    photos = [one.native() for one in captures]
    job = _core.Fit(floor(), photos, unknowns, settings)
    job.start()
    job.join()
    assert not job.result().problems
    return job.result().values_best


# The photos have 64 pixels of 64 samples: a percent at most.
def test_lamps_that_were_off_give_the_power_of_the_others() -> None:
    captures = [capture("Left", ["Key"]), capture("Right", ["Fill"])]
    unknowns = [unknown(name, "power", [200], 1, 1000) for name in POWERS]
    values = fitted(captures, unknowns)
    for name, power in POWERS.items():
        assert values[f"{name}:power"] == pytest.approx([power], rel=0.03)


def test_a_gain_is_fitted_or_given() -> None:
    plain, other = capture("Plain"), capture("Other")
    other = Capture(**{**vars(other), "reference": other.reference * np.float32(GAIN)})
    values = fitted([plain, other], [unknown("Other", "gain", [1, 1, 1], 0.1, 10)])
    assert values["Other:gain"] == pytest.approx(GAIN, rel=0.03)
    given = Capture(**{**vars(other), "gain": GAIN})
    values = fitted([plain, given], [unknown("Key", "power", [200], 1, 1000)])
    assert values["Key:power"] == pytest.approx([POWERS["Key"]], rel=0.03)


def test_what_is_wrong_with_them_is_named() -> None:
    def fit(**taken: Any) -> None:  # noqa: ANN401
        photo = capture("Left").native()
        given = {"reference": photo.reference, "id": "Left", **taken}
        _core.Fit(floor(), [_core.Photo("Camera", **given)], [power], {})

    power = unknown("Key", "power", [200], 1, 1000)
    with pytest.raises(
        KeyError, match="Photo 'Left': lamp 'Rim' is not in the scene; lamps: 'Key', "
    ):
        fit(lights=lights(["Rim"]))
    with pytest.raises(ValueError, match="'Key'.*is not a finite number"):
        fit(lights=lights(Key=(np.full((4, 4), np.nan), None)))
    with pytest.raises(
        ValueError, match="key 'lamp' is unknown; the keys are lamps, world, places"
    ):
        fit(lights={"lamp": ["Key"]})
    with pytest.raises(ValueError, match=r"Left:gain = 0 lies outside \[0.001, 1000\]"):
        fit(gain=(1, 0, 1))
    with pytest.raises(ValueError, match="free_gain = 'all' is not one of none, scalar, rgb"):
        fit(free_gain="all")
    power = unknown("Key", "gain", [1, 1, 1], 0.1, 10)
    with pytest.raises(KeyError, match="'Key' is no photo, and 'gain' is a parameter of photos"):
        fit()


def picture(scene: Any) -> np.ndarray:  # noqa: ANN401 - a native Scene has no Python type
    return _core.render(scene, "Camera", SIZE, SIZE, 16, threads=1, seed=3).image


def test_a_scene_under_other_lights_renders_as_one_that_was_built_so() -> None:
    whole = floor()
    assert whole.light_objects == ["Key", "Fill"]
    alone = whole.with_lights(lights(["Key"], world=False))
    np.testing.assert_array_equal(picture(alone), picture(floor(Fill=0.0, world=0.0)))
    there = np.eye(4)
    there[:3, 3] = (0, 2, 2)
    moved = whole.with_lights(lights(Fill=(there, None)))
    np.testing.assert_array_equal(picture(moved), picture(floor(fill_at=(0, 2, 2))))
    half = whole.with_lights(lights(["Fill"], world=False, Fill=(there, 0.5)))
    ones = whole.with_lights(lights(["Fill"], world=False, Fill=(there, None)))
    np.testing.assert_allclose(picture(half), 0.5 * picture(ones), rtol=1e-6)
