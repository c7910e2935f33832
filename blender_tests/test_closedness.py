# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts of open edges, windings and bodies turned inside out, on meshes with known answers."""

import numpy as np
import pytest

from selenite.scene_read.closedness import Closedness, survey

pytestmark = [pytest.mark.blender, pytest.mark.blender34]

FACES = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))


def cube(size=1.0, at=(0.0, 0.0, 0.0), inwards=False):
    """A closed cube of 12 triangles with its lowest corner at `at`."""
    corners = [(i & 1, i >> 1 & 1, i >> 2) for i in range(8)]
    triangles = [t for a, b, c, d in FACES for t in ((a, b, c), (a, c, d))]
    positions = np.array(corners, np.float32) * np.float32(size) + np.array(at, np.float32)
    triangles = np.array(triangles)
    return positions, triangles[:, ::-1] if inwards else triangles


def joined(*meshes):
    """Several meshes as one, without merging."""
    starts = np.cumsum([0, *(len(positions) for positions, _ in meshes)])
    return (
        np.concatenate([positions for positions, _ in meshes]),
        np.concatenate([t + start for (_, t), start in zip(meshes, starts, strict=False)]),
    )


def without(mesh, *indices):
    positions, triangles = mesh
    return positions, np.delete(triangles, indices, axis=0)


def turned(mesh, *indices):
    """Some triangles wound the other way."""
    positions, triangles = mesh
    triangles = triangles.copy()
    triangles[list(indices)] = triangles[list(indices), ::-1]
    return positions, triangles


def cut_apart(mesh):
    """Every triangle with corners of its own, as files without shared vertices have it."""
    positions, triangles = mesh
    return positions[triangles.ravel()], np.arange(triangles.size).reshape(-1, 3)


def walled():
    """A cube with a wall inside that shares four edges with it."""
    positions, triangles = cube()
    return positions, np.concatenate([triangles, [(0, 4, 7), (0, 7, 3)]])


def strip():
    """A band of Moebius: six squares, the last joined to the first crosswise."""
    angles = 2 * np.pi * np.arange(6) / 6
    rows = [
        (
            np.cos(a) * (2 + s * np.cos(a / 2)),
            np.sin(a) * (2 + s * np.cos(a / 2)),
            s * np.sin(a / 2),
        )
        for a in angles
        for s in (-0.5, 0.5)
    ]
    squares = [(2 * i, 2 * i + 1, 2 * i + 3, 2 * i + 2) for i in range(5)] + [(10, 11, 0, 1)]
    triangles = [t for a, b, c, d in squares for t in ((a, b, c), (a, c, d))]
    return np.array(rows, np.float32), np.array(triangles)


CASES = {
    "closed": (cube(), {}),
    "cut apart": (cut_apart(cube()), {}),
    "one triangle gone": (without(cube(), 5), {"open_edges": 3}),
    "one square gone": (without(cube(), 4, 5), {"open_edges": 4}),
    "one triangle turned": (turned(cube(), 3), {"disagreeing_faces": 1}),
    "two triangles turned": (turned(cube(), 0, 10), {"disagreeing_faces": 2}),
    "all but one turned": (turned(cube(inwards=True), 3), {"disagreeing_faces": 1}),
    "inside out": (cube(inwards=True), {"inside_out": 1}),
    "inside out and cut apart": (cut_apart(cube(inwards=True)), {"inside_out": 1}),
    "one of two inside out": (
        joined(cube(), cube(at=(3, 0, 0), inwards=True)),
        {"bodies": 2, "inside_out": 1},
    ),
    "two apart": (joined(cube(), cube(at=(3, 0, 0))), {"bodies": 2}),
    "hollow": (joined(cube(3), cube(at=(1, 1, 1), inwards=True)), {"bodies": 2}),
    "inside out hollow": (
        joined(cube(3, inwards=True), cube(at=(1, 1, 1))),
        {"bodies": 2, "inside_out": 1},
    ),
    "stone in a hollow": (
        joined(cube(5), cube(3, (1, 1, 1), inwards=True), cube(1, (2, 2, 2))),
        {"bodies": 3},
    ),
    "nested": (joined(cube(3), cube(at=(1, 1, 1))), {"bodies": 2, "nested": 1}),
    "wall inside": (walled(), {"crowded_edges": 4, "loose_crowded_edges": 4}),
    "touching along an edge": (joined(cube(), cube(at=(1, 1, 0))), {"crowded_edges": 1}),
    "doubled": (joined(cube(), cube()), {"crowded_edges": 18, "doubled_faces": 12}),
    "flat corner": (
        (cube()[0], np.concatenate([cube()[1], [(0, 1, 1)]])),
        {},
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_counts(name):
    (positions, triangles), wrong = CASES[name]
    flat = int((triangles == np.roll(triangles, -1, axis=1)).any(axis=1).sum())
    expected = {"triangles": len(triangles) - flat, "bodies": 1, **wrong}
    assert survey(positions, triangles) == Closedness(**expected)


def test_harmless_and_harmful_faults():
    harmless = {name for name, (mesh, _) in CASES.items() if survey(*mesh).encloses}
    assert harmless == {
        "closed",
        "cut apart",
        "two apart",
        "hollow",
        "stone in a hollow",
        "nested",
        "touching along an edge",
        "flat corner",
    }
    leaking = {name for name, (mesh, _) in CASES.items() if survey(*mesh).leaks}
    assert leaking == {"one triangle gone", "one square gone", "wall inside"}


@pytest.mark.parametrize("size", [1e-6, 1e6])
@pytest.mark.parametrize("name", CASES)
def test_size_and_place_do_not_matter(name, size):
    (positions, triangles), _ = CASES[name]
    # A power of two nearby scales and moves float32 without rounding.
    factor = np.float32(2.0 ** np.round(np.log2(size)))
    moved = (positions + np.float32(64)) * factor
    assert survey(moved, triangles) == survey(positions, triangles)


def test_a_surface_with_one_side_disagrees_with_itself():
    found = survey(*strip())
    assert found.open_edges == 12
    assert found.disagreeing_faces > 0


def test_many_turned_faces_of_a_large_mesh_are_counted():
    """A torus of 20,000 triangles, so that no pole spoils the count; every 50th is turned."""
    u, v = np.meshgrid(np.arange(100), np.arange(100), indexing="ij")
    a, b = 2 * np.pi * u / 100, 2 * np.pi * v / 100
    ring = 2 + np.cos(b)
    positions = np.stack([ring * np.cos(a), ring * np.sin(a), np.sin(b)], -1).reshape(-1, 3)

    def index(i, j):
        return (i % 100 * 100 + j % 100).ravel()

    corners = [index(u, v), index(u + 1, v), index(u + 1, v + 1), index(u, v + 1)]
    triangles = np.concatenate(
        [np.stack([corners[i] for i in t], -1) for t in ((0, 1, 2), (0, 2, 3))]
    )
    assert survey(positions.astype(np.float32), triangles) == Closedness(20000, bodies=1)
    chosen = np.arange(0, 20000, 50)
    assert survey(*turned((positions, triangles), *chosen)).disagreeing_faces == len(chosen)


def test_nothing_is_nothing():
    assert survey(np.zeros((3, 3), np.float32), np.zeros((0, 3), int)) == Closedness(0)
    assert survey(np.zeros((3, 3), np.float32), np.array([(0, 1, 2)])) == Closedness(0)
