# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras that the view layer does not evaluate, and what depends on cameras; equal names."""

import math

import bpy
import made_geometry as geometry
import made_scenes as made
import mathutils
import numpy as np
import pytest

pytestmark = [pytest.mark.blender, pytest.mark.blender34]


HIDDEN_CAMERAS = (*geometry.VIEWPORT_ONLY, "excluded", "collection render")


@pytest.mark.parametrize("rig", ["alone", "parent", "parent hidden", "constraint", "driver"])
@pytest.mark.parametrize("how", HIDDEN_CAMERAS)
def test_cameras_that_the_view_layer_does_not_evaluate(how, rig):
    made.camera("Shown")
    made.triangle()
    camera = made.camera("Photo", distance=3)
    camera.location, camera.rotation_euler = (1, 2, 3), (0.3, 0.2, 0.1)
    expected = mathutils.Matrix.LocRotScale(camera.location, camera.rotation_euler, None)
    lens = 50.0
    if rig.startswith("parent"):
        parent = made.add("Rig", None)
        parent.location, parent.rotation_euler = (0, 0, 5), (0, 0, math.pi / 2)
        camera.parent = parent
        expected = (
            mathutils.Matrix.LocRotScale((0, 0, 5), mathutils.Euler((0, 0, math.pi / 2)), None)
            @ expected
        )
        if rig == "parent hidden":
            geometry.hide(parent, "excluded")
    elif rig == "constraint":
        target = made.add("Target", None)
        target.location = (7, 8, 9)
        camera.constraints.new("COPY_LOCATION").target = target
        expected.translation = (7, 8, 9)
    elif rig == "driver":
        camera.driver_add("location", 0).driver.expression = "4 + 5"
        camera.data.driver_add("lens").driver.expression = "2 * 15"
        expected.translation.x, lens = 9, 30.0
    geometry.hide(camera, how)
    values = made.read()
    found = next(item for item in values.cameras if item.name == "Photo")
    np.testing.assert_allclose(found.matrix, np.array(expected), atol=1e-6)
    assert found.lens_mm == pytest.approx(lens)


def test_a_camera_hidden_from_renders_and_bound_to_markers_is_read():
    scene = bpy.context.scene
    made.triangle()
    for number in range(3):
        item = made.camera(f"Photo{number}", distance=2.0 + number)
        item.hide_render = number == 1
        scene.timeline_markers.new(f"M{number}", frame=10 * number).camera = item
    scene.frame_set(12)
    values = made.read()
    assert {item.name: item.matrix[2, 3] for item in values.cameras} == pytest.approx(
        {"Photo0": 2, "Photo1": 3, "Photo2": 4}
    )
    assert [(item.name, item.frame, item.camera.name) for item in scene.timeline_markers] == [
        ("M0", 0, "Photo0"), ("M1", 10, "Photo1"), ("M2", 20, "Photo2")
    ]  # fmt: skip


def test_a_driver_that_reads_the_resolution_sees_that_of_the_scene():
    made.camera()
    scene = bpy.context.scene
    scene.render.resolution_x = 400
    item = made.triangle()
    driver = item.driver_add("location", 0).driver
    variable = driver.variables.new()
    variable.name, variable.targets[0].id_type = "width", "SCENE"
    variable.targets[0].id = scene
    variable.targets[0].data_path = "render.resolution_x"
    driver.expression = "width / 100"
    geometry.hide(item, "object")
    assert made.read().objects[0].matrix[0, 3] == pytest.approx(4)


def test_nodes_that_depend_on_the_camera_are_named():
    if not hasattr(bpy.types, "GeometryNodeInputActiveCamera"):
        pytest.skip("this Blender has no node for the active camera")
    made.camera("One")
    tree = geometry.Tree(geometry.cube())
    info = tree.add("GeometryNodeObjectInfo")
    tree.link(tree.add("GeometryNodeInputActiveCamera"), info)
    tree.link(tree.source, tree.end)
    assert not [text for text in made.read().warnings if "camera" in text]
    made.camera("Two")
    about = [text for text in made.read().warnings if "camera" in text]
    assert len(about) == 1 and "'Body'" in about[0] and "'Nodes'" in about[0]


def test_equal_names_of_two_libraries_stay_apart(tmp_path):
    """Objects, meshes, materials and cameras that two files call the same."""
    for number in (1, 2):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        material = made.material("Paint", roughness=0.2 * number)
        item = made.triangle("Body", material)
        item.location = (number, 0, 0)
        item.hide_render = number == 2
        other = made.triangle("Extra", material)
        other.location = (0, number, 0)
        made.camera("Photo", distance=4.0 + number)
        made.save(tmp_path / f"library{number}.blend")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    made.camera("Photo", distance=9)
    for number in (1, 2):
        path = str(tmp_path / f"library{number}.blend")
        with bpy.data.libraries.load(path, link=True) as (there, here):
            here.objects = list(there.objects)
        for item in here.objects:
            bpy.context.scene.collection.objects.link(item)
    values = made.read()
    assert not values.problems
    places = sorted((item.name, *item.matrix[:2, 3].round(6)) for item in values.objects)
    assert places == [("Body", 1, 0), ("Extra", 0, 1), ("Extra", 0, 2)]
    used = {tuple(item.matrix[:2, 3].round(6)): item.materials[0] for item in values.objects}
    roughness = {place: values.owners[name].values["roughness"][0] for place, name in used.items()}
    assert roughness == pytest.approx({(1, 0): 0.2, (0, 1): 0.2, (0, 2): 0.4})
    cameras = {item.name: item.matrix[2, 3] for item in values.cameras}
    assert cameras.pop("Photo") == pytest.approx(9)
    assert sorted(cameras.values()) == pytest.approx([5, 6])
    assert all("library" in name for name in cameras)
