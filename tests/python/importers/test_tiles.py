# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures in UDIM tiles: a material for each tile, and faces within its picture."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from selenite.importers.readers import tiles
from selenite.importers.reconstruction import MeshMaterial, ReconstructedMesh

sys.path.insert(0, str(Path(__file__).parent))

from known import picture  # noqa: E402

#: Squares of the UV plane in which faces lie: the tiles 1001, 1002, 1012, 1001.
SQUARES = np.array([(0, 0), (1, 0), (1, 1), (0, 0)])
CORNERS = np.array([(0.0, 0.0), (1.0, 0.0), (0.25, 1.0)])


def mesh(texture: Path, squares: np.ndarray = SQUARES) -> ReconstructedMesh:
    count = len(squares)
    triangles = np.arange(3 * count).reshape(-1, 3)
    uvs = CORNERS + squares[:, None]
    skin = MeshMaterial("skin", texture)
    return ReconstructedMesh("m", np.zeros((3 * count, 3)), triangles, uvs, materials=(skin,))


@pytest.mark.parametrize("name", ["a.<UDIM>.png", "a.1001.png", "a.1002.png"])
def test_each_tile_is_a_material_of_its_own(tmp_path: Path, name: str) -> None:
    for number in (1001, 1002, 1012):
        picture(tmp_path / f"a.{number}.png")
    found, remarks = tiles.split(mesh(tmp_path / name))
    assert remarks == [] and found.uvs is not None and found.material_of is not None
    np.testing.assert_array_equal(found.uvs, np.broadcast_to(CORNERS, (4, 3, 2)))
    assert [one.name for one in found.materials] == ["skin.1001", "skin.1002", "skin.1012"]
    textures = [one.texture for one in found.materials]
    assert textures == [tmp_path / f"a.{number}.png" for number in (1001, 1002, 1012)]
    assert found.material_of.tolist() == [0, 1, 2, 0]


def test_a_tile_that_is_not_there_is_told_and_white(tmp_path: Path) -> None:
    for number in (1001, 1012):
        picture(tmp_path / f"a_{number}.png")
    squares = np.concatenate([SQUARES, [(-1, 0)]])
    found, remarks = tiles.split(mesh(tmp_path / "a_<UDIM>.png", squares))
    assert remarks == [
        "a tile outside of 1001 to 1999 of the texture 'a_<UDIM>.png' is not there: its faces are "
        "white",
        "tile 1002 of the texture 'a_<UDIM>.png' is not there: its faces are white",
    ]
    assert found.material_of is not None
    white = [one.texture is None for one in found.materials]
    assert [white[index] for index in found.material_of] == [False, True, False, False, True]


@pytest.mark.parametrize(
    ("names", "named", "squares"),
    [
        (["a.1001.png"], "a.1001.png", SQUARES),  # a picture that repeats
        (["a.1001.png", "a.1002.png"], "a.1001.png", np.zeros((4, 2))),
        (["IMG_1024.png", "IMG_1025.png"], "other.png", SQUARES),
        (["a.11001.png", "a.11002.png"], "a.11001.png", SQUARES),
    ],
)
def test_what_only_looks_like_tiles_stays(
    tmp_path: Path, names: list[str], named: str, squares: np.ndarray
) -> None:
    for name in names:
        picture(tmp_path / name)
    before = mesh(tmp_path / named, squares)
    found, remarks = tiles.split(before)
    assert found is before and remarks == []


def test_places_far_outside_are_no_tiles(tmp_path: Path) -> None:
    picture(tmp_path / "a.1001.png")
    far = np.array([(0, 0), (1e30, 0), (0, -1e30), (np.nan, 0)])
    found, remarks = tiles.split(mesh(tmp_path / "a.<UDIM>.png", far))
    assert found.material_of is not None and len(remarks) == 1
    textures = [found.materials[index].texture for index in found.material_of]
    assert textures == [tmp_path / "a.1001.png", None, None, None]


def test_no_tile_is_read_through_a_link_out_of_the_folder(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    picture(tmp_path / "a.1002.png")
    picture(tmp_path / "in" / "a.1001.png")
    (tmp_path / "in" / "a.1002.png").symlink_to(tmp_path / "a.1002.png")
    found, remarks = tiles.split(mesh(tmp_path / "in" / "a.<UDIM>.png"))
    assert len(remarks) == 2 and [one.texture for one in found.materials][1:] == [None, None]
