# SPDX-License-Identifier: GPL-3.0-or-later
"""Scale, ground and repair of an imported reconstruction: numbers of known bodies, and one undo
step each."""

import math

import bmesh
import bpy
import made_scenes as made
import numpy as np
import pytest
import reconstructed
import undo_steps
from drawn_panels import draw
from mathutils import Vector

from selenite.importers import imported, mesh_repair
from selenite.importers.to_blender import TO_FILE
from selenite.interface import panels
from selenite.interface.importing import tools as import_tools
from selenite.problems import BadInput

pytestmark = [pytest.mark.blender, pytest.mark.blender34, pytest.mark.usefixtures("addon")]


@pytest.fixture
def pebble(tmp_path):
    """The imported collection, in a file of its own."""
    _, words = reconstructed.written(tmp_path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    file, _, cameras, _, photos = words["metashape"]
    bpy.ops.selenite.import_reconstruction(filepath=file, cameras=cameras, photos=photos)
    bpy.context.view_layer.update()
    return imported.collection_of(bpy.context.scene, None)


def chosen(*items):
    for item in bpy.context.scene.objects:
        item.select_set(item in items)
    bpy.context.view_layer.objects.active = items[0]
    bpy.context.view_layer.update()


def cameras():
    return [item for item in bpy.context.scene.objects if item.type == "CAMERA"]


def pixels(scene):
    """Where each capture has the vertices of the pebble."""
    from selenite.capture.scene_captures import captures_of

    places = reconstructed.vertices_of(bpy.data.objects["pebble"])
    return [reconstructed.shown_at(scene, one, places) for one in captures_of(scene)]


def file_places(collection, places):
    matrix = np.array(collection[TO_FILE]).reshape(4, 4)
    return places @ matrix[:3, :3].T + matrix[:3, 3]


def test_scale_from_two_cameras_keeps_what_photos_show(pebble):
    scene = bpy.context.scene
    first, second = cameras()[:2]
    item = bpy.data.objects["pebble"]
    before = pixels(scene)
    in_file = file_places(pebble, reconstructed.vertices_of(item))
    chosen(first, second)
    undo_steps.prepare()
    assert bpy.ops.selenite.set_scale("EXEC_DEFAULT", True, length=2.5) == {"FINISHED"}
    bpy.context.view_layer.update()
    distance = (first.matrix_world.translation - second.matrix_world.translation).length
    assert distance == pytest.approx(2.5, rel=1e-6)
    assert tuple(first.scale) == pytest.approx((1, 1, 1), abs=1e-6)
    assert np.abs(np.array(pixels(scene)) - before).max() < 0.01
    after = file_places(pebble, reconstructed.vertices_of(item))
    assert np.abs(after - in_file).max() < 1e-6
    undo_steps.undo()


def test_scale_from_two_vertices_counts_scene_units(pebble):
    scene = bpy.context.scene
    scene.unit_settings.scale_length = 0.001  # a Blender unit is a millimetre
    item = bpy.data.objects["pebble"]
    chosen(item)
    bpy.ops.object.mode_set(mode="EDIT")
    scratch = bmesh.from_edit_mesh(item.data)
    scratch.verts.ensure_lookup_table()
    for vertex in scratch.verts:
        vertex.select_set(vertex.index in (0, 200))
    scratch.select_flush_mode()
    bmesh.update_edit_mesh(item.data)
    assert bpy.ops.selenite.set_scale(length=0.05) == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    places = reconstructed.vertices_of(item)
    assert np.linalg.norm(places[0] - places[200]) == pytest.approx(50, rel=1e-5)


def test_ground_from_three_objects(pebble):
    scene = bpy.context.scene
    before = pixels(scene)
    empties = []
    for place in ((0.0, 0.0, -0.03), (0.1, 0.0, -0.05), (0.0, 0.1, -0.02)):
        empty = made.add("Point", None)
        empty.location = place
        pebble.objects.link(empty)  # it turns with the rest
        empties.append(empty)
    chosen(*empties)
    undo_steps.prepare()
    assert bpy.ops.selenite.set_ground("EXEC_DEFAULT", True) == {"FINISHED"}
    bpy.context.view_layer.update()
    assert max(abs(one.matrix_world.translation.z) for one in empties) < 1e-7
    assert np.mean([one.matrix_world.translation.z for one in cameras()]) > 0
    assert np.abs(np.array(pixels(scene)) - before).max() < 0.01
    undo_steps.undo()


def test_what_is_picked_wrongly_changes_nothing(pebble):
    before = [item.matrix_world.copy() for item in pebble.all_objects]
    chosen(cameras()[0])
    with pytest.raises(RuntimeError, match="1 points are selected"):
        bpy.ops.selenite.set_scale(length=1.0)
    with pytest.raises(RuntimeError, match="select 3 vertices"):
        bpy.ops.selenite.set_ground()
    line = [made.add("Point", None) for _ in range(3)]
    for number, empty in enumerate(line):
        empty.location = (number, number, number)
    chosen(*line)
    with pytest.raises(RuntimeError, match="lie in one line"):
        bpy.ops.selenite.set_ground()
    assert [item.matrix_world for item in pebble.all_objects] == before


#: Directions from the middle of a ball, in which no two faces are equally near.
ABOVE, BELOW, ASIDE = (0.31, 0.17, 0.9), (0.31, 0.17, -0.9), (0.9, 0.31, 0.17)


def without_face(item, count=1, at=ASIDE):
    """The faces next to a place: a sphere's have another order in each run of Blender 3.4."""
    scratch = bmesh.new()
    scratch.from_mesh(item.data)
    place = Vector(at)
    faces = sorted(scratch.faces, key=lambda one: (one.calc_center_median() - place).length)
    bmesh.ops.delete(scratch, geom=faces[:count], context="FACES")
    scratch.to_mesh(item.data)
    scratch.free()


def ball(segments=32):
    """A ball of radius 0.05, with a UV map."""
    item = made.sphere("Ball", made.material("Wax"), segments)
    item.scale = (0.05, 0.05, 0.05)
    chosen(item)
    return item


def test_holes_are_filled(tmp_path):
    item = ball()
    whole = mesh_repair.state_of(item)
    assert whole.found.encloses
    without_face(item, 3)
    count = mesh_repair.state_of(item).found.open_edges
    assert count == 8
    undo_steps.prepare()
    assert bpy.ops.selenite.fill_holes("EXEC_DEFAULT", True) == {"FINISHED"}
    filled = mesh_repair.state_of(item)
    assert filled.found.encloses
    assert filled.volume == pytest.approx(whole.volume, rel=0.002)
    assert f"{count} open edges" in import_tools.FOUND[bpy.context.scene.name][0]
    layer = item.data.uv_layers[0].data
    assert all(0 <= x <= 1 for one in layer for x in one.uv)
    with pytest.raises(RuntimeError, match="it has no hole"):
        bpy.ops.selenite.fill_holes()
    undo_steps.undo()
    assert mesh_repair.state_of(bpy.data.objects["Ball"]).found.open_edges == count


def test_a_seam_is_no_hole():
    """Corners of their own on both sides of a cut, as files have them."""
    item = ball()
    scratch = bmesh.new()
    scratch.from_mesh(item.data)
    bmesh.ops.split_edges(scratch, edges=[e for e in scratch.edges if abs(e.verts[0].co.z) < 0.1])
    scratch.to_mesh(item.data)
    scratch.free()
    assert mesh_repair.state_of(item).found.encloses
    with pytest.raises(RuntimeError, match="it has no hole"):
        bpy.ops.selenite.fill_holes()


def test_a_remesh_is_closed_and_keeps_the_volume():
    item = ball()
    other = bpy.data.objects.new("Other", item.data)  # shares the mesh, and keeps it
    shared = len(item.data.polygons)
    without_face(item, 1)
    undo_steps.prepare()
    assert bpy.ops.selenite.remesh("EXEC_DEFAULT", True, voxels=80) == {"FINISHED"}
    after = mesh_repair.state_of(item)
    assert after.found.encloses
    assert after.volume == pytest.approx(4 / 3 * math.pi * 0.05**3, rel=0.03)
    assert item.data.materials[0].name == "Wax"
    assert len(other.data.polygons) == shared - 1
    assert "UV map is lost" in import_tools.FOUND[bpy.context.scene.name][-1]
    with pytest.raises(BadInput, match="give a larger one"):
        mesh_repair.remesh(item, 1e-9)
    undo_steps.undo()


def of_two_materials(*places):
    """A ball that is Skin below z = 0.7 and Wax above, with holes of three faces at `places`."""
    item = ball()
    item.data.materials.append(made.material("Skin"))
    for polygon in item.data.polygons:
        polygon.material_index = int(polygon.center.z < 0.7)
    for place in places:
        without_face(item, 3, place)
    return item


def test_a_filled_hole_has_the_material_around_it():
    item = of_two_materials(ABOVE, BELOW)
    before = len(item.data.polygons)
    assert bpy.ops.selenite.fill_holes() == {"FINISHED"}
    new = item.data.polygons[before:]
    assert {polygon.material_index for polygon in new} == {0, 1}
    assert all(polygon.material_index == int(polygon.center.z < 0.7) for polygon in new)


def test_a_filled_hole_between_two_materials_has_one_of_them():
    item = of_two_materials()
    item.data.materials.append(made.material("Bone"))
    for polygon in item.data.polygons:
        if polygon.center.z < 0:
            polygon.material_index = 2
    without_face(item, 4, (0.6, 0.31, 0.7))
    before = len(item.data.polygons)
    assert bpy.ops.selenite.fill_holes() == {"FINISHED"}
    old, new = item.data.polygons[:before], item.data.polygons[before:]
    around = {
        one.material_index
        for one in old
        if set(one.vertices) & {vertex for polygon in new for vertex in polygon.vertices}
    }
    assert around == {0, 1}, "the hole lies between two materials"
    assert {polygon.material_index for polygon in new} <= around


def test_a_remesh_of_several_materials_has_one_and_says_so():
    item = of_two_materials(ASIDE)
    assert bpy.ops.selenite.remesh(voxels=20) == {"FINISHED"}
    assert {polygon.material_index for polygon in item.data.polygons} == {0}
    lines = import_tools.FOUND[bpy.context.scene.name]
    assert lines[-1] == "all its faces have the material 'Wax' now"


def test_thickness_and_mean_free_path():
    item = ball(64)
    material = item.data.materials[0]
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeVolumePrincipled")
    node.inputs["Density"].default_value = 40.0
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Volume"])
    bpy.context.scene.cursor.location = (0.2, 0.0, 0.0)
    assert bpy.ops.selenite.thickness() == {"FINISHED"}
    thick, path = import_tools.FOUND[bpy.context.scene.name]
    assert float(thick.split()[2]) == pytest.approx(100, rel=0.003)
    assert "25 mm" in path and "3.99 of it" in path
    assert bpy.ops.selenite.measure() == {"FINISHED"}
    lines = import_tools.FOUND[bpy.context.scene.name]
    assert lines[0] == "Ball: 0.1 x 0.1 x 0.1 m"
    assert lines[1].startswith("Ball is closed") and "volume 52" in lines[1]
    without_face(item, 3)
    assert bpy.ops.selenite.measure() == {"FINISHED"}
    assert "not closed" in import_tools.FOUND[bpy.context.scene.name][1]


def test_the_panel_has_a_button_for_each(pebble):
    assert "selenite.import_reconstruction" in draw(panels.SELENITE_PT_captures)
    drawn = draw(import_tools.SELENITE_PT_reconstruction)
    for name in ("set_scale", "set_ground", "measure", "fill_holes", "remesh"):
        assert f"selenite.{name}" in drawn
    chosen(bpy.data.objects["pebble"])
    bpy.ops.selenite.measure()
    assert "closed" in draw(import_tools.SELENITE_PT_reconstruction)
