# SPDX-License-Identifier: GPL-3.0-or-later
"""What is read from scenes made by script; expected numbers are known on paper."""

import math

import bpy
import made_scenes as made
import numpy as np
import pytest

from selenite.scene_read import hosts

pytestmark = [pytest.mark.blender, pytest.mark.blender34]


def test_camera_keeps_lens_and_loses_scale():
    item = made.camera(lens=35, sensor_fit="VERTICAL", sensor_height=20, shift_x=0.1)
    item.scale = (2, 2, 2)
    bpy.context.scene.render.resolution_percentage = 51
    bpy.context.scene.render.pixel_aspect_y = 1.25
    camera = made.read().cameras[0]
    assert (camera.lens_mm, camera.sensor_fit, camera.sensor_height) == (35, "VERTICAL", 20)
    assert camera.shift_x == pytest.approx(0.1)
    assert (camera.width, camera.height) == (16, 12)  # 32 x 24 at 51 %, rounded down
    assert camera.pixel_aspect_y == 1.25
    np.testing.assert_allclose(camera.matrix[:3, :3], np.eye(3), atol=1e-7)
    np.testing.assert_allclose(camera.matrix[:3, 3], (0, 0, 5))


def test_panoramic_camera_is_left_out_by_name():
    made.camera("Wide", type="PANO")
    made.camera("Plain", type="ORTHO", ortho_scale=3)
    made.triangle()
    values = made.read()
    assert [camera.name for camera in values.cameras] == ["Plain"]
    assert "Wide" in values.unusable_cameras
    assert not values.problems


def test_modifiers_are_applied_at_the_level_of_a_render():
    bpy.ops.mesh.primitive_cube_add()
    modifier = bpy.context.object.modifiers.new("Smooth", "SUBSURF")
    modifier.levels, modifier.render_levels = 1, 3
    values = made.read()
    assert values.triangle_count() == 12 * 4**3
    assert not [text for text in values.warnings if "level" in text]


def test_instances_share_one_mesh():
    one = made.triangle("One")
    made.add("Two", one.data).location = (3, 0, 0)
    collection = bpy.data.collections.new("Group")
    collection.objects.link(one)
    holder = made.add("Holder", None)
    holder.instance_type, holder.instance_collection = "COLLECTION", collection
    holder.scale = (1, -1, 1)
    values = made.read()
    assert len(values.meshes) == 1
    assert len(values.objects) == 3
    signs = sorted(np.sign(np.linalg.det(item.matrix[:3, :3])) for item in values.objects)
    assert signs == [-1, 1, 1]


def test_what_does_not_render_is_left_out():
    made.triangle("Shown")
    made.triangle("Hidden").hide_render = True
    collection = bpy.data.collections.new("Off")
    bpy.context.scene.collection.children.link(collection)
    collection.hide_render = True
    item = made.triangle("InOff")
    bpy.context.scene.collection.objects.unlink(item)
    collection.objects.link(item)
    assert [item.name for item in made.read().objects] == ["Shown"]


def test_viewport_hidden_object_is_read():
    made.triangle("Shown").location.z = 1  # not on top of the other one
    made.triangle("Forgotten").hide_viewport = True
    values = made.read()
    assert sorted(item.name for item in values.objects) == ["Forgotten", "Shown"]
    assert not [text for text in values.warnings if "'Forgotten'" in text]


def test_curves_and_texts_come_as_meshes_once():
    curve = bpy.data.curves.new("Tube", "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", 0.1
    spline = curve.splines.new("BEZIER")
    spline.bezier_points.add(1)
    spline.bezier_points[1].co = (1, 0, 0)
    made.add("Tube", curve)
    made.add("Wire", bpy.data.curves.new("Wire", "CURVE"))
    text = bpy.data.curves.new("Text", "FONT")
    text.body, text.extrude = "Hi", 0.1
    made.add("Text", text)
    values = made.read()
    assert sorted(item.name for item in values.objects) == ["Text", "Tube"]
    assert not [problem for problem in values.problems if "Wire" in problem.object]


def test_empty_mesh_is_warned_of_and_nan_vertices_are_counted():
    made.add("Nothing", bpy.data.meshes.new("Nothing"))
    mesh = bpy.data.meshes.new("Holed")
    mesh.from_pydata(
        [(0, 0, 0), (1, 0, 0), (0, 1, 0), (math.nan, 1, 1)], [], [(0, 1, 2), (1, 3, 2)]
    )
    made.add("Holed", mesh)
    values = made.read()
    assert [text for text in values.warnings if "no faces" in text] == [
        "Object 'Nothing': its mesh has no faces, so it renders as nothing"
    ]
    assert any("'Holed': 1 triangles" in text for text in values.warnings)
    assert values.triangle_count() == 1
    assert math.isnan(mesh.vertices[3].co[0])  # the user's mesh is not touched


def test_material_per_face_and_missing_slot():
    first, second = made.material("First"), made.material("Second")
    mesh = bpy.data.meshes.new("Pair")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)], [], [(0, 1, 2), (1, 3, 2)])
    mesh.materials.append(first)
    mesh.materials.append(second)
    mesh.polygons[1].material_index = 1
    made.add("Pair", mesh)
    made.triangle("Bare")
    values = made.read()
    objects = {item.name: item for item in values.objects}
    assert objects["Pair"].materials == ("First", "Second")
    assert objects["Bare"].materials == ("(no material)",)
    pair = values.meshes[objects["Pair"].mesh]
    np.testing.assert_array_equal(pair.material_slots, [0, 1])
    grey = next(item for item in values.materials if item.name == "(no material)")
    assert grey.values == {"base_color": (0.8, 0.8, 0.8), "specular_level": (0.0,)}


def test_principled_values_by_parameter_name():
    made.triangle(
        material=made.material(
            base_color=(0.1, 0.2, 0.3), roughness=0.25, transmission=0.75, ior=1.3
        )
    )
    values = made.read().owners["Body"].values
    assert values["base_color"] == pytest.approx((0.1, 0.2, 0.3))
    assert values["roughness"] == pytest.approx((0.25,))
    assert values["transmission"] == pytest.approx((0.75,))
    assert values["ior"] == pytest.approx((1.3,))


def _grouped(material):
    """Puts the Principled node into a group whose Roughness is an input of the group."""
    tree = material.node_tree
    group = bpy.data.node_groups.new("Shader", "ShaderNodeTree")
    inner = group.nodes.new("ShaderNodeBsdfPrincipled")
    entry, leave = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    if hasattr(group, "interface"):
        group.interface.new_socket("Gloss", in_out="INPUT", socket_type="NodeSocketFloat")
        group.interface.new_socket("BSDF", in_out="OUTPUT", socket_type="NodeSocketShader")
    else:
        group.inputs.new("NodeSocketFloat", "Gloss")
        group.outputs.new("NodeSocketShader", "BSDF")
    group.links.new(entry.outputs[0], inner.inputs["Roughness"])
    group.links.new(inner.outputs[0], leave.inputs[0])
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    node.inputs["Gloss"].default_value = 0.35
    reroute = tree.nodes.new("NodeReroute")
    tree.links.new(node.outputs[0], reroute.inputs[0])
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    tree.links.new(reroute.outputs[0], output.inputs["Surface"])
    return node


def test_groups_and_reroutes_are_looked_through():
    material = made.material()
    node = _grouped(material)
    made.triangle(material=material)
    values = made.read()
    assert not [problem for problem in values.problems if "Material" in problem.object]
    assert values.owners["Body"].values["roughness"] == pytest.approx((0.35,))
    assert "roughness" not in values.owners["Body"].fixed
    assert "base_color" not in values.owners["Body"].fixed
    second = material.node_tree.nodes.new("ShaderNodeGroup")
    second.node_tree = node.node_tree  # the inside is shared now
    owner = made.read().owners["Body"]
    assert "2 users" in owner.fixed["base_color"]
    assert "roughness" not in owner.fixed


def test_reasons_against_fitting():
    material = made.material()
    tree = material.node_tree
    value = tree.nodes.new("ShaderNodeValue")
    value.outputs[0].default_value = 0.6
    tree.links.new(value.outputs[0], made.socket(material, "roughness"))
    made.socket(material, "ior").driver_add("default_value")
    made.socket(material, "transmission").keyframe_insert("default_value", frame=1)
    made.triangle(material=material)
    owner = made.read().owners["Body"]
    assert owner.values["roughness"] == pytest.approx((0.6,))
    assert owner.fixed["roughness"].startswith("linked to node 'Value'")
    assert owner.fixed["ior"].startswith("driven")
    assert owner.fixed["transmission"].startswith("keyframed")
    assert "base_color" not in owner.fixed


def test_a_texture_without_image_and_a_node_below_a_bump_are_named_together():
    material = made.material()
    tree = material.node_tree
    image = tree.nodes.new("ShaderNodeTexImage")
    bump, height = tree.nodes.new("ShaderNodeBump"), tree.nodes.new("ShaderNodeAmbientOcclusion")
    tree.links.new(height.outputs["AO"], bump.inputs["Height"])
    tree.links.new(image.outputs["Color"], made.socket(material, "base_color"))
    tree.links.new(bump.outputs["Normal"], made.principled(material).inputs["Normal"])
    made.triangle(material=material)
    text = "\n".join(problem.line() for problem in made.read().problems)
    assert "Image Texture" in text and "Occlusion" in text and "Material 'Body'" in text


@pytest.mark.skipif(not hosts.is_version_3(), reason="all lobes are modelled since Blender 4")
def test_lobes_that_the_model_lacks_are_warned_of():
    material = made.material()
    names = ("Clearcoat", "Sheen", "Subsurface", "Anisotropic")
    for name in names:
        made.principled(material).inputs[name].default_value = 0.5
    made.triangle(material=material)
    for name in names:
        assert any(f"'{name}' is not modelled" in text for text in made.read().warnings)


@pytest.mark.skipif(not hosts.is_version_3(), reason="Specular Tint is a colour since Blender 4")
@pytest.mark.parametrize("tint", [0.0, 0.25])
def test_specular_tint_of_blender_3_is_rendered_and_not_fitted(tint):
    material = made.material()
    socket = made.principled(material).inputs["Specular Tint"]
    socket.default_value = tint
    made.triangle(material=material)
    read = made.read()
    assert read.owners["Body"].values["specular_tint"] == pytest.approx((tint,) * 3)
    assert "of another kind" in read.owners["Body"].fixed["specular_tint"]
    assert not [text for text in read.warnings if "Specular Tint" in text]
    value = material.node_tree.nodes.new("ShaderNodeTexImage")
    material.node_tree.links.new(value.outputs["Color"], socket)
    read = made.read()
    assert read.owners["Body"].values["specular_tint"] == (0.0,) * 3
    assert [text for text in read.warnings if "'Specular Tint' is left out" in text]


def test_defaults_of_the_node_are_not_warned_of():
    made.triangle(material=made.material())
    assert not [text for text in made.read().warnings if "Multiscatter" not in text]


def test_material_without_nodes_is_grey_and_fixed():
    material = bpy.data.materials.new("Old")
    material.use_nodes = False
    material.diffuse_color = (0.2, 0.4, 0.6, 1)
    made.triangle(material=material)
    values = made.read()
    assert values.materials[0].values["base_color"] == pytest.approx((0.2, 0.4, 0.6))
    assert "Use Nodes" in values.owners["Old"].fixed["roughness"]


@pytest.mark.parametrize(
    ("kind", "settings", "shape"),
    [
        ("POINT", {"shadow_soft_size": 0.25}, {"radius": 0.25}),
        ("SUN", {"angle": 0.1}, {"angle": 0.1}),
        ("SPOT", {"spot_size": 0.7, "spot_blend": 0.3}, {"size": 0.7, "blend": 0.3}),
        ("AREA", {"shape": "ELLIPSE", "size": 2, "size_y": 3}, {"size_x": 2, "size_y": 3}),
        ("AREA", {"shape": "DISK", "size": 2}, {"size_x": 2, "size_y": 2, "shape": "DISK"}),
    ],
)
def test_lights(kind, settings, shape):
    made.light(kind=kind, energy=12, color=(1, 0.5, 0.25), **settings)
    values = made.read()
    light = values.lights[0]
    assert (light.kind, light.power, light.radiance_scale) == (kind, 12, 1)
    assert light.color == (1, 0.5, 0.25)
    for name, expected in shape.items():
        assert light.shape[name] == (
            expected if isinstance(expected, str) else pytest.approx(expected)
        )
    np.testing.assert_allclose(light.matrix[:3, :3], made.rotation_x(0.3), atol=1e-6)
    assert light.light_units == ("v3" if bpy.app.version < (4, 0, 0) else "v4")
    assert values.owners["Key"].fixed == {}


@pytest.mark.parametrize(
    ("settings", "scale"),
    [
        ({"kind": "POINT", "shadow_soft_size": 0.5}, 4 * math.pi * 0.25),
        ({"kind": "POINT", "shadow_soft_size": 0.0}, 4),
        ({"kind": "SPOT", "shadow_soft_size": 0.5}, 4 * math.pi * 0.25),
        ({"kind": "SUN", "angle": 0.5}, math.pi * math.sin(0.25) ** 2),
        ({"kind": "SUN", "angle": 0.0}, 1),
        ({"kind": "AREA", "shape": "DISK", "size": 2}, math.pi),
    ],
)
def test_lamps_that_are_not_normalized(settings, scale):
    """Factors as Cycles 4.5 was measured to apply them."""
    item = made.light(**settings)
    if not hasattr(item.data, "normalize"):
        pytest.skip("lamps are always normalized before Blender 4.5")
    item.data.normalize = False
    assert made.read().lights[0].radiance_scale == pytest.approx(scale, rel=1e-6)


def test_exposure_normalize_and_temperature():
    item = made.light(kind="AREA", shape="SQUARE", size=2)
    if not hasattr(item.data, "exposure"):
        pytest.skip("lamps have no exposure before Blender 4.5")
    item.data.exposure, item.data.normalize = 1, False
    item.data.use_temperature = True
    light = made.read().lights[0]
    assert light.radiance_scale == pytest.approx(2 * 4)
    assert light.color == pytest.approx(tuple(item.data.temperature_color))
    assert "temperature" in made.read().owners["Key"].fixed["color"]


def test_names_that_clash_stay_apart():
    made.triangle(material=made.material("Key"))
    made.light("Key")
    values = made.read()
    assert {"Key", "Key (light)"} <= set(values.owners)
    assert values.lights[0].name == "Key (light)"


def test_world_constant():
    made.world((0.1, 0.2, 0.3), 2.5)
    values = made.read()
    assert values.world.color == pytest.approx((0.1, 0.2, 0.3))
    assert values.world.strength == 2.5
    assert values.owners["World"].datablock == "Studio"


@pytest.mark.parametrize("kind", ["POINT", "TEXTURE", "VECTOR"])
def test_environment_rotation_and_row_order(kind):
    pixels = np.arange(4 * 8 * 3, dtype=np.float32).reshape(4, 8, 3)
    made.environment(made.world(), pixels, rotation=(0.4, 0, 0), kind=kind)
    world = made.read().world
    np.testing.assert_array_equal(world.image, pixels)
    expected = made.rotation_x(-0.4 if kind == "TEXTURE" else 0.4)
    np.testing.assert_allclose(world.to_map, expected, atol=1e-6)


def test_world_of_a_shader_for_surfaces_gives_no_light():
    tree = made.world().node_tree
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputWorld")
    tree.links.new(tree.nodes.new("ShaderNodeBsdfDiffuse").outputs[0], output.inputs["Surface"])
    values = made.read()
    assert not [one for one in values.problems if "World" in one.object]
    # As in Cycles: one black pixel.
    np.testing.assert_array_equal(values.world.image, np.zeros((1, 1, 3), np.float32))


def test_world_with_a_volume_is_a_problem():
    tree = made.world().node_tree
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputWorld")
    tree.links.new(tree.nodes.new("ShaderNodeVolumeScatter").outputs[0], output.inputs["Volume"])
    assert any("World 'Studio'" in p.object and "volume" in p.cause for p in made.read().problems)


def test_no_camera_is_a_problem():
    made.triangle()
    assert [p.cause for p in made.read().problems] == ["it has no camera"]


def test_the_scene_builds_natively_and_reads_back():
    from selenite.scene_read.build import build

    made.studio(roughness=0.25)
    made.light(energy=7)
    values = made.read()
    assert not values.problems
    scene = build(values)
    assert scene.get("Body", "roughness") == pytest.approx([0.25])
    assert scene.get("Key", "power") == pytest.approx([7])
    assert scene.triangle_count == values.triangle_count()
