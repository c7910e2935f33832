# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles, normals, UVs and slots of meshes made by script."""

import bpy
import made_scenes as made
import numpy as np
import pytest

pytestmark = [pytest.mark.blender, pytest.mark.blender34]


def test_triangle_with_uvs_and_normals():
    made.triangle()
    mesh = made.read().meshes[0]
    np.testing.assert_array_equal(mesh.triangles, [[0, 1, 2]])
    np.testing.assert_array_equal(mesh.positions, [(0, 0, 0), (2, 0, 0), (0, 1, 0)])
    np.testing.assert_allclose(mesh.corner_normals, np.tile((0, 0, 1), (3, 1)), atol=1e-7)
    (name, uvs), *rest = mesh.uv_maps
    assert name == "UVMap" and not rest
    np.testing.assert_array_equal(uvs, [(0, 0), (1, 0), (0, 1)])
    assert mesh.positions.dtype == np.float32 and mesh.triangles.dtype == np.int32


def test_smooth_sphere_has_radial_normals():
    made.sphere(segments=32)
    mesh = made.read().meshes[0]
    corners = mesh.positions[mesh.triangles.ravel()]
    np.testing.assert_allclose(mesh.corner_normals, corners, atol=0.02)


def test_flat_faces_keep_their_own_normal():
    bpy.ops.mesh.primitive_cube_add(size=2)
    mesh = made.read().meshes[0]
    assert len(mesh.triangles) == 12
    np.testing.assert_allclose(np.abs(mesh.corner_normals).max(axis=1), 1, atol=1e-6)


def test_each_triangle_of_a_bent_flat_face_has_its_own_normal():
    bpy.ops.mesh.primitive_plane_add(size=2)
    bpy.context.object.data.vertices[3].co.z = 1
    mesh = made.read().meshes[0]
    corners = mesh.positions[mesh.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert abs(normals[0] @ normals[1]) < 0.9
    np.testing.assert_allclose(mesh.corner_normals, np.repeat(normals, 3, axis=0), atol=1e-6)


def test_smooth_faces_average_over_flat_ones():
    """As in Cycles, where no edge is sharp: the rim of a cylinder with flat caps leans outwards."""
    bpy.ops.mesh.primitive_cylinder_add(vertices=16, radius=1, depth=2)
    for polygon in bpy.context.object.data.polygons:
        polygon.use_smooth = len(polygon.vertices) == 4
    mesh = made.read().meshes[0]
    sides = np.abs(mesh.corner_normals[:, 2]) < 0.99
    assert sides.sum() == 3 * 32
    # By angles of corners: 90 degrees of two quads against the cap's own.
    cap = np.pi * (1 - 2 / 16)
    tilt = cap / np.hypot(cap, 2 * np.pi / 2 * np.cos(np.pi / 16))
    np.testing.assert_allclose(np.abs(mesh.corner_normals[sides, 2]), tilt, atol=1e-4)


@pytest.mark.parametrize(
    ("smooth", "sharp"), [("no", False), ("all", False), ("some", True), ("all", True)]
)
def test_normals_are_those_that_blender_splits(smooth, sharp):
    mesh = made.sphere(segments=12).data
    for index, polygon in enumerate(mesh.polygons):
        polygon.use_smooth = {"no": False, "all": True}.get(smooth, index % 3 > 0)
    if sharp:
        for edge in list(mesh.edges)[::7]:
            edge.use_edge_sharp = True
    if hasattr(mesh, "use_auto_smooth"):
        mesh.use_auto_smooth, mesh.auto_smooth_angle = sharp, 0.4
        mesh.calc_normals_split()
    read = made.read().meshes[0]
    mesh.calc_loop_triangles()
    expected = [list(normal) for item in mesh.loop_triangles for normal in item.split_normals]
    np.testing.assert_allclose(read.corner_normals, expected, atol=1e-6)


def test_each_triangle_has_the_slot_of_its_face():
    item = made.sphere(segments=12)
    for name in ("First", "Second", "Third"):
        item.data.materials.append(made.material(name))
    for index, polygon in enumerate(item.data.polygons):
        polygon.material_index = index % 5  # of which two are not there
    read = made.read().meshes[0]
    item.data.calc_loop_triangles()
    expected = [min(one.material_index, 2) for one in item.data.loop_triangles]
    np.testing.assert_array_equal(read.material_slots, expected)


@pytest.mark.parametrize("number", [float("inf"), float("nan"), 1e19])
def test_faces_of_a_vertex_that_is_nowhere_are_left_out_with_a_warning(number):
    bpy.ops.mesh.primitive_cube_add(size=2)
    bpy.context.object.data.vertices[0].co.x = number
    read = made.read()
    (mesh,) = read.meshes
    assert np.isfinite(mesh.positions).all() and np.abs(mesh.positions).max() <= 1
    left = 12 - len(mesh.triangles)
    assert 3 <= left <= 6  # triangles of three quads
    assert read.warnings == [
        f"Object 'Cube': {left} triangles with vertices that are not finite are left out, as in "
        "Cycles"
    ]


@pytest.mark.parametrize(("place", "named"), [(1e3, False), (1e6, True)])
def test_triangles_that_reach_far_away_are_named(place, named):
    bpy.ops.mesh.primitive_cube_add(size=0.5)
    bpy.context.object.data.vertices[7].co.x = place  # no quad is folded
    bpy.ops.mesh.primitive_plane_add(size=1e7)  # large, and not long
    said = made.read().warnings
    triangles = " of its triangles are 30000 times as long as others"  # of three quads
    expected = [f"Object 'Cube': {count}{triangles}" for count in range(3, 7)]
    assert [text.partition(": Cycles")[0] in expected for text in said] == ([True] * named)
