# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that do not lie where the cameras look."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from selenite.importers.agreement import remarks_on, with_axes_of_cameras
from selenite.importers.reconstruction import (
    Intrinsics,
    MeshMaterial,
    ReconstructedCamera,
    ReconstructedMesh,
    Reconstruction,
)
from selenite.scene_read.lens import LensDistortion

sys.path.insert(0, str(Path(__file__).parent))

from known import HEIGHT, POINTS, WIDTH, known  # noqa: E402

LENS = Intrinsics(WIDTH, HEIGHT, LensDistortion(520.0, 520.0, WIDTH / 2, HEIGHT / 2))
#: What Blender makes of the axes (x, y, z) of a glTF: (x, -z, y).
TURNED = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def mesh(positions: np.ndarray) -> ReconstructedMesh:
    normals = np.broadcast_to([0.0, 1.0, 0.0], (1, 3, 3))
    return ReconstructedMesh("Body", positions, np.array([[0, 1, 2]]), normals=normals)


def cameras(at: np.ndarray, lens: Intrinsics | None = LENS) -> tuple[ReconstructedCamera, ...]:
    found = []
    for one in known():
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = one.rotation.T, one.centre + at
        found.append(ReconstructedCamera(one.label, pose, lens, field_of_view=0.8))
    return tuple(found)


def scene(at: np.ndarray, positions: np.ndarray, lens: Intrinsics | None = LENS) -> Reconstruction:
    return Reconstruction("a", cameras(at, lens), (mesh(positions),))


def test_a_mesh_that_the_cameras_see_is_not_remarked_on() -> None:
    for lens in (LENS, None):
        assert remarks_on(scene(np.zeros(3), POINTS, lens)) == []


def test_a_mesh_elsewhere_is_told() -> None:
    for lens in (LENS, None):
        (remark,) = remarks_on(scene(np.array([0.0, 0.0, 50.0]), POINTS, lens))
        assert remark.startswith("5 of 5 cameras see nothing of the mesh")


def test_no_mesh_and_colours_that_no_fit_reads_are_told() -> None:
    found = scene(np.zeros(3), POINTS)
    (remark,) = remarks_on(replace(found, meshes=()))
    assert remark.startswith("there is no mesh")
    colored = replace(found.meshes[0], colors=np.ones_like(POINTS))
    (remark,) = remarks_on(replace(found, meshes=(colored,)))
    assert remark.startswith("mesh 'Body' has vertex colours")
    textured = replace(colored, materials=(MeshMaterial("", Path("skin.png")),))
    assert remarks_on(replace(found, meshes=(textured,))) == []


def test_a_gltf_in_the_axes_of_the_cameras_is_turned_back() -> None:
    """By what cameras see, where the body is not in the origin; by points, wherever it is."""
    at = np.array([0.0, 9.0, 1.0])
    far = scene(at, POINTS)
    near = replace(scene(np.zeros(3), POINTS), points=POINTS[:50] + 0.01)
    for found, positions in ((far, POINTS + at), (near, POINTS)):
        (kept,), remark = with_axes_of_cameras([mesh(positions)], found, "scan.glb")
        np.testing.assert_array_equal(kept.positions, positions)
        assert "scan.glb' is turned" in remark
        (back,), remark = with_axes_of_cameras([mesh(positions @ TURNED.T)], found, "scan.glb")
        np.testing.assert_allclose(back.positions, positions, atol=1e-15)
        np.testing.assert_allclose(back.normals @ TURNED.T, mesh(positions).normals, atol=1e-15)
        assert "scan.glb' is not turned" in remark


def test_a_gltf_is_as_its_format_says_where_nothing_tells() -> None:
    found = scene(np.zeros(3), POINTS)
    (kept,), remark = with_axes_of_cameras([mesh(POINTS)], found, "scan.glb")
    np.testing.assert_array_equal(kept.positions, POINTS)
    assert "is turned: y points upward in glTF, z here" in remark
