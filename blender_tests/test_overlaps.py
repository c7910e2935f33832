# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces on top of each other are named, where they are seen.

Which of them Cycles shows otherwise was looked at with bpy 4.5: see `geometry/overlaps.py`.
"""

import math

import bmesh
import bpy
import made_scenes as made
import numpy as np
import pytest

from selenite.cycles_check.render import render
from selenite.scene_read.scene import read_scene

pytestmark = pytest.mark.blender
ON_TOP = "have faces in one plane on top of each other"
TWICE, WALL = "it is there twice at one place", "it shares a wall with"


def plane(name, size=6.0, place=(0, 0, 0), turned=(0, 0, 0), **values):
    bpy.ops.mesh.primitive_plane_add(size=size, location=place, rotation=turned)
    return named(name, **values)


def cube(name, size=1.0, place=(0, 0, 0), **values):
    bpy.ops.mesh.primitive_cube_add(size=size, location=place)
    return named(name, **values)


def named(name, **values):
    item = bpy.context.object
    item.name = item.data.name = name
    item.data.materials.append(made.material(name, **values))
    return item


def area(name, place, size=1.0):
    lamp = made.light(name, "AREA", size=size)
    lamp.location, lamp.rotation_euler = place, (0, 0, 0)
    return lamp


def room():
    """A floor at z = 0, seen from above."""
    made.camera(distance=5)
    made.world()
    return plane("Floor")


def said(*parts):
    """Warnings and problems with one of these parts, of overlaps if none is given."""
    read = read_scene(bpy.context.scene)
    texts = [*read.warnings, *(item.line() for item in read.problems)]
    parts = parts or (ON_TOP, TWICE, WALL)
    return [text for text in texts if any(part in text for part in parts)]


def pairs():
    """The names of each message, which stand between quotes."""
    return [tuple(text.split("'")[1:4:2]) for text in said()]


def _floor_twice():
    plane("Twin", size=4)
    return [("Floor", "Twin")]


def _turned_over():
    plane("Twin", turned=(math.pi, 0, 0))
    return [("Floor", "Twin")]


def _poster_on_a_wall():
    cube("Wall", 2, (0, 0, 1))
    plane("Poster", 0.5, (0.2, 0.1, 2))
    return [("Wall", "Poster")]


def _flush_boxes():
    cube("Box", 2, (0, 0, 1))
    cube("Panel", 1, (0, 0, 1.5))
    return [("Box", "Panel")]


def _poster_on_a_mirrored_wall():
    cube("Wall", 2, (0, 0, 1)).scale.x = -1
    plane("Poster", 0.5, (0.2, 0.1, 2))
    return [("Wall", "Poster")]


def _glass_on_the_floor():
    cube("Glass", 1, (0, 0, 0.5), transmission=1.0)
    return [("Floor", "Glass")]


def _lamp_in_a_ceiling():
    plane("Ceiling", place=(0, 0, 3), turned=(math.pi, 0, 0))
    area("Key", (0, 0, 3))
    return [("Ceiling", "Key")]


def _lamps_in_one_plane():
    area("Key", (0, 0, 3))
    area("Fill", (0.5, 0.2, 3))
    return [("Key", "Fill")]


def _smooth_body_twice():
    one = made.sphere("Ball", made.material("Ball"))
    one.location.z = 2
    other = one.copy()
    other.data = one.data.copy()
    bpy.context.scene.collection.objects.link(other)
    other.name = "Copy"
    return [("Ball", "Copy")]


SEEN = (
    _floor_twice, _turned_over, _poster_on_a_wall, _poster_on_a_mirrored_wall, _flush_boxes,
    _glass_on_the_floor, _lamp_in_a_ceiling, _lamps_in_one_plane, _smooth_body_twice,
)  # fmt: skip


@pytest.mark.parametrize("make", SEEN, ids=lambda make: make.__name__.strip("_"))
def test_what_cycles_shows_otherwise_is_named(make) -> None:
    room()
    expected = {frozenset(pair) for pair in make()}
    found = pairs()
    assert {frozenset(pair) for pair in found} == expected
    assert len(found) == len(expected)


def _box_on_the_floor():
    cube("Box", 1, (0, 0, 0.5))


def _boxes_side_by_side():
    """In a row to the left and the right of the camera, which is on both sides of what touches."""
    for number in range(4):
        cube(f"Box {number}", 1, (number - 1.5, 0, 0.5))


def _tiles_that_touch():
    bpy.data.objects.remove(bpy.data.objects["Floor"])
    plane("Left", 1, (-0.5, 0, 0))
    plane("Right", 1, (0.5, 0, 0))


def _a_hair_above():
    plane("Twin", place=(0, 0, 1e-6))


def _lamp_below_a_ceiling():
    plane("Ceiling", place=(0, 0, 3), turned=(math.pi, 0, 0))
    area("Key", (0, 0, 2.999))


def _lamps_side_by_side():
    area("Key", (0, 0, 3))
    area("Fill", (1, 0, 3))


UNSEEN = (
    _box_on_the_floor, _boxes_side_by_side, _tiles_that_touch, _a_hair_above,
    _lamp_below_a_ceiling, _lamps_side_by_side,
)  # fmt: skip


@pytest.mark.parametrize("make", UNSEEN, ids=lambda make: make.__name__.strip("_"))
def test_what_agrees_with_cycles_is_not(make) -> None:
    room()
    make()
    assert pairs() == []


def test_instances_at_one_place_are_named_once() -> None:
    room()
    group = bpy.data.collections.new("Group")
    item = cube("Box", 1)
    bpy.context.scene.collection.objects.unlink(item)
    group.objects.link(item)
    for number in range(2):
        empty = made.add(f"Empty {number}", None)
        empty.location.z = 2
        empty.instance_type, empty.instance_collection = "COLLECTION", group
    (text,) = said("is there more than once")
    assert text.startswith("Object 'Box' is there more than once at one place")


def refused():
    return [item.line() for item in read_scene(bpy.context.scene).problems]


def _floor_there_twice():
    plane("Twin")
    return [("Floor", "Twin")]


@pytest.mark.parametrize("make", [_floor_there_twice, _smooth_body_twice])
def test_two_objects_that_are_one_are_refused(make) -> None:
    room()
    ((first, second),) = make()
    (text,) = refused()
    assert text == (
        f"Object '{first}': it is there twice at one place, the other time as object '{second}', "
        "which Cycles shows otherwise (with shadows, or black); delete one of both"
    )


def test_a_wall_of_glass_that_two_bodies_share_is_refused() -> None:
    room()
    cube("Vessel", 1, (0, 0, 2), transmission=1.0)
    cube("Liquid", 0.5, (0, 0, 2.25), transmission=1.0)
    (text,) = refused()
    assert text.startswith("Object 'Vessel': it shares a wall with object 'Liquid', and light")
    bpy.data.objects["Liquid"].location.z = 2.2
    assert refused() == []


def test_faces_of_glass_on_top_of_others_are_not_said_to_render_alike() -> None:
    room()
    ball = made.sphere("Ball", made.material("Ball", transmission=1.0))
    ball.location.z = 2
    mesh = bmesh.new()
    mesh.from_mesh(ball.data)
    mesh.faces.ensure_lookup_table()
    bmesh.ops.duplicate(mesh, geom=mesh.faces[:3])
    mesh.to_mesh(ball.data)
    (text,) = said("does not come out as from a closed body")
    assert "Cycles shows faces on top of others otherwise" in text
    assert "renders the same" not in text


def test_many_pairs_are_counted() -> None:
    room()
    for number in range(5):
        plane(f"Sheet {number}", size=1 + 0.1 * number)
    assert len(said()) == 8
    (text,) = said("more pairs")
    assert text == "7 more pairs have faces on top of each other"  # 15 pairs of six planes


CORNERS = [(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]


@pytest.mark.parametrize(
    ("faces", "count"),
    [
        ([(0, 1, 2, 3), (0, 3, 2, 1)], 4),  # a card with a back
        ([(0, 1, 2, 3), (4, 5, 6, 7)], 4),
        ([(0, 1, 2, 3), (5, 6, 7, 4)], 4),  # by the other diagonal
        ([(0, 1, 2), (0, 1, 3)], 2),  # folded
        ([(0, 1, 2), (0, 2, 3)], 0),
    ],
)
def test_faces_of_a_mesh_that_lie_on_each_other_are_counted(faces, count) -> None:
    room()
    mesh = bpy.data.meshes.new("Card")
    mesh.from_pydata([*CORNERS, *CORNERS], [], faces)
    made.add("Card", mesh)
    found = said("lie on each other")
    assert [text.split(" of its")[0] for text in found] == [f"Mesh 'Card': {count}"] * bool(count)


def test_faces_of_a_mesh_in_one_plane_without_a_common_edge_are_estimated() -> None:
    """A sheet of a quarter of the area inside another one."""
    room()
    mesh = bpy.data.meshes.new("Card")
    inner = [(0.5 + (x - 0.5) / 2, 0.5 + (y - 0.5) / 2, z) for x, y, z in CORNERS]
    mesh.from_pydata([*CORNERS, *inner], [], [(0, 1, 2, 3), (4, 5, 6, 7)])
    made.add("Card", mesh)
    (text,) = said("other faces of its own")
    part = float(text.split(": ")[1].split(" %")[0])
    assert part == pytest.approx(40, abs=4)  # 2 * 0.25 of 1.25; 5 standard deviations
    for vertex in mesh.vertices[4:]:
        vertex.co.z += 1e-4
    assert said("other faces of its own") == []


@pytest.mark.parametrize("transmission", [0.0, 1.0])
def test_doubled_faces_stop_glass_alone(transmission) -> None:
    """Light enters a body of glass twice, or not at all; an opaque one is rendered as if its faces
    were there once."""
    room()
    mesh = bpy.data.meshes.new("Card")
    mesh.from_pydata(CORNERS, [], [(0, 1, 2, 3), (0, 3, 2, 1)])
    made.add("Card", mesh).data.materials.append(made.material("Card", transmission=transmission))
    read = read_scene(bpy.context.scene)
    assert [item.object for item in read.problems] == ["Mesh 'Card'"] * (transmission > 0)
    assert any("lie on each other" in text for text in read.warnings) is (transmission == 0)


@pytest.mark.parametrize("kind", ["Glass", "Refraction", "Translucent", "Diffuse"])
def test_a_clear_shader_on_a_floor_is_named(kind) -> None:
    """Nobody sees the faces between a floor and an opaque body."""
    room()
    body = cube("Body", 1, (0, 0, 0.5))
    tree = body.data.materials[0].node_tree
    node = tree.nodes.new(f"ShaderNodeBsdf{kind}")
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    assert pairs() == [("Floor", "Body")] * (kind != "Diffuse")


def test_a_body_that_was_joined_with_its_copy_is_counted() -> None:
    room()
    bpy.ops.mesh.primitive_uv_sphere_add(location=(0, 0, 2))
    first = named("Ball")
    triangles = sum(len(face.vertices) - 2 for face in first.data.polygons)
    bpy.ops.object.duplicate()
    first.select_set(True)
    bpy.ops.object.join()
    (text,) = said("lie on each other")
    assert f"': {2 * triangles} of its triangles" in text


def test_cycles_shows_a_floor_that_is_there_twice_in_shadow(tmp_path) -> None:
    """What the warning is for: less than 80 % of the light of a single floor, and all of it where
    the second one is 1e-6 units above."""
    room()

    def light():
        scene = bpy.context.scene
        return float(np.mean(render(scene, "Camera", (16, 16), 64, 1, tmp_path / "x.exr")))

    alone = light()
    twin = plane("Twin")
    assert light() < 0.8 * alone
    twin.location.z = 1e-6
    assert light() == pytest.approx(alone, rel=0.02)
