# SPDX-License-Identifier: GPL-3.0-or-later
"""What is said of light, reflectance and gains that compensate for each other."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "addon"))

from selenite.fit.diagnosis.gauge import gauges, remarks  # noqa: E402
from selenite.scene_read.values import SceneValues  # noqa: E402


def result(*directions: tuple[list[str], list[str]]) -> dict[str, Any]:
    """Of a fit whose report has these directions: components, captures."""
    weak = [
        {"deviation": 0.3, "components": names, "captures": captures}
        for names, captures in directions
    ]
    return {"report": {"weak_directions": weak}}


def test_light_and_color_are_said_once_for_all_channels_with_what_helps() -> None:
    found = gauges(
        result(
            (["World:strength", "Body:base_color[0]", "Body:roughness"], []),
            (["Body:base_color[1]", "World:strength"], []),
        )
    )
    assert len(found) == 1
    assert found[0].as_json() == {
        "parameters": ["World:strength", "Body:base_color"],
        "captures": [],
    }
    text = found[0].text()
    assert text.startswith("World:strength and Body:base_color compensate for each other")
    assert "grey card" in text
    assert "one lamp" in text
    assert "gain of none" not in text, "no gain takes part"


def test_gains_take_part_with_their_own_cure() -> None:
    (found,) = gauges(result((["Body:base_color[2]"], ["Front", "Back"])))
    assert found.as_json() == {"parameters": ["Body:base_color"], "captures": ["Front", "Back"]}
    text = found.text()
    assert text.startswith(
        "Body:base_color and the gains of Front and Back compensate for each other"
    )
    assert "gain of none" in text
    assert "lamp" not in text


def test_other_weak_directions_are_no_matter_of_brightness() -> None:
    assert gauges(result((["Body:ior", "Body:transmission"], []))) == []
    assert gauges(result((["Key:power", "Fill:power"], []))) == [], "two of one kind"
    assert gauges({}) == [], "there was no refinement"
    assert gauges({"report": {}}) == []


def test_what_shares_nothing_stays_apart() -> None:
    found = gauges(
        result((["Key:power", "Head:base_color[0]"], []), (["Base:albedo[1]"], ["Left"]))
    )
    assert [one.parameters for one in found] == [("Key:power", "Head:base_color"), ("Base:albedo",)]


def said_before(names: list[str], *gains: str) -> list[str]:
    """Of photos with these gains, in a scene that has nothing else."""
    captures: Any = [SimpleNamespace(free_gain=gain) for gain in gains]
    return remarks(SceneValues(), captures, names)


def test_before_a_fit_free_gains_are_told_with_what_makes_up_for_them() -> None:
    for name in ("Body:base_color", "Body:albedo_grid", "Key:power", "World:color"):
        (text,) = said_before(["Body:ior", name], "one", "one")
        assert text.startswith(f"The gain of every photo is free, and {name} can compensate for it")
    both = said_before(["Body:base_color", "World:environment"], "one")
    assert "World:environment can compensate" in both[0], "light comes first"
    assert not said_before(["Body:ior"], "one"), "no matter of brightness"
    assert not said_before(["Body:base_color"], "one", "none"), "one photo holds it"
    assert not said_before(["Body:base_color"]), "no photos"


def test_a_material_that_is_not_fitted_is_named_as_what_brightness_rests_on() -> None:
    """Beside it the prior alone does not hold the brightness. A light has no such hold."""
    scene: Any = SimpleNamespace(
        materials=[SimpleNamespace(name=name) for name in ("Body", "Ground", "Lid")],
        objects=[
            SimpleNamespace(visible_to_camera=seen, materials=[name])
            for seen, name in ((True, "Body"), (True, "Ground"), (False, "Lid"))
        ],
        lights=[],
    )
    captures: Any = [SimpleNamespace(free_gain="scalar")]
    (text,) = remarks(scene, captures, ["Body:base_color"])
    assert "unless the color of 'Ground' in the scene is right and counts" in text
    for names in (["Body:base_color", "Ground:base_color"], ["Body:base_color", "Key:power"]):
        (text,) = remarks(scene, captures, names)
        assert "only the prior of a gain" in text
