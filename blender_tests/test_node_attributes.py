# SPDX-License-Identifier: GPL-3.0-or-later
"""What nodes ask of the mesh: pointiness, and the alpha of attributes, as Cycles has them."""

import bpy
import made_scenes as made
import numpy as np
import pytest
from node_probes import Probe, shifted

from selenite.scene_read.scene import read_scene

pytestmark = pytest.mark.blender

EXACT = 1e-4


@pytest.fixture
def bumpy(tmp_path):
    """A ball whose vertices go in and out, one face cut off from the rest at the same place."""
    probe = Probe("sphere", tmp_path)
    mesh = bpy.data.objects["Body"].data
    positions = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", positions)
    size = 1 + 0.06 * np.sin(np.arange(len(mesh.vertices)) * 2.3).astype(np.float32)
    mesh.vertices.foreach_set("co", (positions.reshape(-1, 3) * size[:, None]).ravel())
    mesh.update()
    bpy.context.view_layer.objects.active = bpy.data.objects["Body"]
    modifier = bpy.data.objects["Body"].modifiers.new("Split", "EDGE_SPLIT")
    modifier.split_angle = 0.5
    return probe


def test_pointiness_is_that_of_cycles(bumpy):
    def make(graph):
        return graph.node("NewGeometry").outputs["Pointiness"]

    assert bumpy.difference(make, 0.99) < EXACT


@pytest.mark.parametrize(("kind", "domain"), [("BYTE_COLOR", "CORNER"), ("FLOAT_COLOR", "POINT")])
def test_alpha_of_attributes_is_that_of_cycles(bumpy, kind, domain):
    mesh = bpy.data.objects["Body"].data
    colors = mesh.color_attributes.new("Paint", kind, domain)
    for number, item in enumerate(colors.data):
        item.color = (0.2, 0.4, 0.6, 0.25 + 0.7 * (number % 7) / 6)

    def by_name(graph):
        return graph.node("Attribute", attribute_name="Paint").outputs["Alpha"]

    def usual(graph):
        return graph.node("VertexColor").outputs["Alpha"]

    def of_a_map(graph):
        return graph.node("Attribute", attribute_name="UVMap").outputs["Alpha"]

    # Values of corners jump from face to face: on an edge another face may be hit.
    share = 0.9 if domain == "CORNER" else 0.99
    for make in (by_name, usual, of_a_map):
        assert bumpy.difference(make, share) < EXACT, make.__name__


#: Types of attributes, and the member with the value.
TYPES = {
    "FLOAT": "value",
    "INT": "value",
    "INT8": "value",
    "BOOLEAN": "value",
    "FLOAT2": "vector",
    "FLOAT_VECTOR": "vector",
    "FLOAT_COLOR": "color",
    "BYTE_COLOR": "color",
    "QUATERNION": "value",
}


def _numbered(mesh, name, kind, domain):
    """An attribute that differs from place to place."""
    attribute = mesh.attributes.new(name, kind, domain)
    for number, item in enumerate(attribute.data):
        value = getattr(item, TYPES[kind])
        share = (number % 5) / 5
        if hasattr(value, "__len__"):
            setattr(item, TYPES[kind], [0.1 + share / (1 + i) for i in range(len(value))])
        else:
            setattr(item, TYPES[kind], share if kind == "FLOAT" else type(value)(number % 3))


def _given(name, output):
    def make(graph):
        return shifted(graph, graph.node("Attribute", attribute_name=name).outputs[output])

    return make


@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize("domain", ["POINT", "FACE", "CORNER", "EDGE"])
def test_attributes_are_those_of_cycles(bumpy, kind, domain):
    if domain == "EDGE" and kind in {"QUATERNION", "BYTE_COLOR", "FLOAT_COLOR", "INT8"}:
        pytest.skip("how Blender blends these over edges is not read")
    bpy.data.objects["Body"].modifiers.clear()
    _numbered(bpy.data.objects["Body"].data, "Own", kind, domain)
    share = 0.99 if domain in {"POINT", "EDGE"} else 0.9
    for output in ("Vector", "Fac", "Alpha"):
        assert bumpy.difference(_given("Own", output), share) < EXACT, output


@pytest.mark.skipif(bpy.app.version < (4, 1, 0), reason="Cycles 3 does not show vertex groups")
def test_vertex_groups_are_those_of_cycles(bumpy):
    body = bpy.data.objects["Body"]
    body.modifiers.clear()
    group = body.vertex_groups.new(name="Group")
    for vertex in body.data.vertices:
        if vertex.index % 4:
            group.add([vertex.index], (vertex.index % 5) / 5, "REPLACE")
    for output in ("Color", "Fac", "Alpha"):
        assert bumpy.difference(_given("Group", output), 0.97) < EXACT, output


def test_tangents_of_a_uv_map_are_an_attribute_of_its_name(bumpy):
    bpy.data.objects["Body"].modifiers.clear()
    for output in ("Color", "Fac", "Alpha"):
        assert bumpy.difference(_given("UVMap.tangent", output), 0.9) < EXACT, output


@pytest.mark.parametrize(("most", "count"), [(1.0, 0), (1.5, 1)])
def test_colours_beyond_their_parameter_are_named_without_a_graph(most, count):
    made.studio()
    mesh = bpy.data.objects["Body"].data
    for item in mesh.attributes.new("Own", "FLOAT", "POINT").data:
        item.value = most
    node = mesh.materials[0].node_tree.nodes.new("ShaderNodeAttribute")
    node.attribute_name = "Own"
    made.link(mesh.materials[0], node.outputs["Color"])
    said = [text for text in made.read().warnings if "cut off" in text]
    assert len(said) == count
    assert all("values of colour attribute 'Own' above 1 are cut off" in text for text in said)


@pytest.mark.parametrize(
    "name", ["generated", "pointiness", "random_per_island", "uv", "vertex_color", "N", "position"]
)
def test_what_cycles_makes_itself_has_its_name(bumpy, name):
    mesh = bpy.data.objects["Body"].data
    _numbered(mesh, "Paint", "FLOAT_COLOR", "POINT")
    for output in ("Color", "Fac", "Alpha"):
        assert bumpy.difference(_given(name, output), 0.97) < EXACT, output


@pytest.mark.parametrize("name", ["color", "density", "undeformed", "motion_P", "ptex_uv", "none"])
def test_names_of_other_things_are_0_on_a_mesh(bumpy, name):
    mesh = bpy.data.objects["Body"].data
    if name != "none":
        _numbered(mesh, name, "FLOAT_COLOR", "POINT")
    for output in ("Color", "Fac", "Alpha"):
        assert bumpy.difference(_given(name, output), 0.97) < EXACT, output
        values = read_scene(bpy.context.scene, surveys=False)
        assert not values.problems


def test_an_attribute_of_numbers_is_read_without_a_graph():
    made.studio()
    mesh = bpy.data.objects["Body"].data
    _numbered(mesh, "Own", "FLOAT", "FACE")
    node = mesh.materials[0].node_tree.nodes.new("ShaderNodeAttribute")
    node.attribute_name = "Own"
    made.link(mesh.materials[0], node.outputs["Color"])
    read = made.read()
    assert not read.problems and not read.warnings
    (item,) = read.meshes
    numbers = np.array([item.value for item in mesh.attributes["Own"].data])
    faces = np.array([item.polygon_index for item in mesh.loop_triangles])
    (name, values), *_ = item.colors
    assert name == "Own"
    np.testing.assert_allclose(values[:, 1], np.repeat(numbers[faces], 3), atol=1e-6)


@pytest.mark.skipif(bpy.app.version < (4, 1, 0), reason="Blender 3 splits by angles")
@pytest.mark.parametrize("how", ["sharp edges", "some faces flat"])
def test_islands_are_counted_after_faces_are_split(tmp_path, how):
    probe = Probe("sphere", tmp_path)
    mesh = bpy.data.objects["Body"].data
    for index, edge in enumerate(mesh.edges):
        edge.use_edge_sharp = how == "sharp edges" and index % 2 == 0
    for index, polygon in enumerate(mesh.polygons):
        polygon.use_smooth = how == "sharp edges" or index % 2 == 0

    def make(graph):
        return graph.node("NewGeometry").outputs["Random Per Island"]

    assert probe.difference(make, 0.97) < EXACT
