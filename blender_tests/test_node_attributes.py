# SPDX-License-Identifier: GPL-3.0-or-later
"""What nodes ask of the mesh: pointiness, and the alpha of attributes, as Cycles has them."""

import bpy
import numpy as np
import pytest
from node_probes import Probe

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
