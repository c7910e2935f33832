# SPDX-License-Identifier: GPL-3.0-or-later
"""The stages of a fit that moves vertices and fits more."""

from __future__ import annotations

import pytest

from selenite.fit.staging.request import StageRequest
from selenite.fit.staging.shape_apart import apart

_SHAPE = "Body:vertex_positions"


def _stages(rest: str, stages: tuple[StageRequest, ...] = ()) -> list[tuple[str, str, int | None]]:
    found = apart((_SHAPE, rest), stages, 40, [])
    assert all(len(stage.parameters) == 1 for stage in found)
    return [(stage.name, stage.parameters[0], stage.iterations) for stage in found]


@pytest.mark.parametrize("image", ["Body:base_color_texture", "Body:vertex_colors"])
def test_a_shape_takes_four_turns_with_an_image(image: str) -> None:
    assert _stages(image) == [
        ("start of the rest", image, 10),
        ("together 1: shape of Body", _SHAPE, 10), ("together 1: rest", image, 10),
        ("together 2: shape of Body", _SHAPE, 10), ("together 2: rest", image, 10),
        ("together 3: shape of Body", _SHAPE, 10), ("together 3: rest", image, 10),
        ("together 4: shape of Body", _SHAPE, 10), ("together 4: rest", image, 40),
    ]  # fmt: skip


def test_a_shape_comes_before_its_turns_with_a_colour() -> None:
    names = [name for name, _, _ in _stages("Body:base_color")]
    assert names[:3] == ["start of the rest", "shape of Body", "rest"]
    assert len(names) == 7


def test_a_stage_with_both_becomes_turns() -> None:
    image = "Body:base_color_texture"
    found = _stages(image, (StageRequest("all", (_SHAPE, image), 20),))
    assert [name for name, _, _ in found][:2] == ["all 1: shape of Body", "all 1: rest"]
    assert [count for _, _, count in found] == [5, 5] * 3 + [5, 20]
