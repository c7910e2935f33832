# SPDX-License-Identifier: GPL-3.0-or-later
"""The normals that shading takes, as Cycles has them: of flat faces that are not planar, and of
meshes with flat and smooth faces."""

import bpy
import numpy as np
import pytest
from made_scenes import read
from node_probes import Probe, shifted

pytestmark = pytest.mark.blender

EXACT = 1e-4


def _probe(tmp_path):
    """A ball whose vertices go in and out: none of its quads is planar."""
    probe = Probe("sphere", tmp_path)
    mesh = bpy.data.objects["Body"].data
    positions = np.array([item.co for item in mesh.vertices])
    size = 1 + 0.06 * np.sin(np.arange(len(positions)) * 2.3)
    for item, place in zip(mesh.vertices, positions * size[:, None], strict=True):
        item.co = place
    return probe, mesh


def _smooth(mesh, rule):
    for index, polygon in enumerate(mesh.polygons):
        polygon.use_smooth = bool(rule(index))


def _sharp(mesh, rule):
    for index, edge in enumerate(mesh.edges):
        edge.use_edge_sharp = bool(rule(index))


def _flip(mesh, rule):
    for index, polygon in enumerate(mesh.polygons):
        if rule(index):
            polygon.flip()
    mesh.update()


def _forget_flat(mesh):
    if "sharp_face" in mesh.attributes:
        mesh.attributes.remove(mesh.attributes["sharp_face"])


CASES = {
    "all flat": lambda mesh: _smooth(mesh, lambda _: False),
    "some flat": lambda mesh: _smooth(mesh, lambda index: index % 3),
    "some flat, a sharp edge": lambda mesh: (
        _smooth(mesh, lambda index: index % 3),
        _sharp(mesh, lambda index: index == 5),
    ),
    "some flat, all edges sharp": lambda mesh: (
        _smooth(mesh, lambda index: index % 3),
        _sharp(mesh, lambda _: True),
    ),
    "all smooth, all edges sharp": lambda mesh: _sharp(mesh, lambda _: True),
    "no flag, all edges sharp": lambda mesh: (_forget_flat(mesh), _sharp(mesh, lambda _: True)),
    "some wound the other way, a sharp edge": lambda mesh: (
        _flip(mesh, lambda index: index % 7 == 0),
        _sharp(mesh, lambda index: index == 5),
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_normals_are_those_of_cycles(name, tmp_path):
    probe, mesh = _probe(tmp_path)
    _smooth(mesh, lambda _: True)
    CASES[name](mesh)
    mesh.update()

    def make(graph):
        return shifted(graph, graph.node("NewGeometry").outputs["Normal"])

    # Flat normals jump from face to face: on an edge another triangle may be hit.
    assert probe.difference(make, 0.97) < EXACT


def _with_custom_normals(length):
    """A node group that gives each corner a normal of its own."""
    tree = bpy.data.node_groups.new("Normals", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    give = tree.nodes.new("GeometryNodeSetMeshNormal")
    give.mode, give.domain = "FREE", "CORNER"
    index = tree.nodes.new("GeometryNodeInputIndex")
    random = tree.nodes.new("FunctionNodeRandomValue")
    random.data_type = "FLOAT_VECTOR"
    random.inputs["Min"].default_value = (-0.4, -0.4, 0.6)
    random.inputs["Max"].default_value = (0.4, 0.4, 1)
    unit = tree.nodes.new("ShaderNodeVectorMath")
    unit.operation = "NORMALIZE" if length == "equal" else "ADD"
    tree.links.new(index.outputs[0], random.inputs["ID"])
    tree.links.new(random.outputs[0], unit.inputs[0])
    normal = next(item for item in give.inputs if item.name == "Custom Normal")
    tree.links.new(unit.outputs[0], normal)
    tree.links.new(start.outputs[0], give.inputs[0])
    tree.links.new(give.outputs[0], end.inputs[0])
    bpy.data.objects["Body"].modifiers.new("Normals", "NODES").node_group = tree


@pytest.mark.skipif(not hasattr(bpy.types, "GeometryNodeSetMeshNormal"), reason="Blender < 4.5")
def test_a_vertex_has_the_custom_normal_of_its_last_corner(tmp_path):
    probe, mesh = _probe(tmp_path)
    _smooth(mesh, lambda _: True)
    _sharp(mesh, lambda index: index % 4 == 0)
    _with_custom_normals("equal")

    def make(graph):
        return shifted(graph, graph.node("NewGeometry").outputs["Normal"])

    assert probe.difference(make, 0.97) < EXACT


@pytest.mark.skipif(not hasattr(bpy.types, "GeometryNodeSetMeshNormal"), reason="Blender < 4.5")
def test_custom_normals_of_different_length_are_refused(tmp_path):
    _probe(tmp_path)
    _with_custom_normals("random")
    problems = [item.line() for item in read().problems]
    assert problems == [
        "Object 'Body': its custom normals differ in length, by which Cycles weights them; "
        "normalize them before the node Set Mesh Normal"
    ]
