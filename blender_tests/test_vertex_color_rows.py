# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours of meshes in the panel: from a tick to the colour attribute, and back."""

import bpy
import made_scenes as made
import numpy as np
import pytest
import undo_steps

from selenite.interface import request

pytestmark = [pytest.mark.blender, pytest.mark.blender34]

NAME = "vertex_colors"


def paint(item):
    """A colour attribute that the item's material shows."""
    mesh = item.data
    attribute = mesh.color_attributes.new("Col", "FLOAT_COLOR", "POINT")
    attribute.data.foreach_set("color", [0.5, 0.4, 0.3, 1.0] * len(attribute.data))
    material = mesh.materials[0]
    node = material.node_tree.nodes.new("ShaderNodeVertexColor")
    node.layer_name = "Col"
    made.link(material, node.outputs["Color"])


def colors():
    data = bpy.data.objects["Body"].data.color_attributes["Col"].data
    return np.array([tuple(one.color) for one in data], np.float32)


@pytest.fixture
def settings(addon, tmp_path):
    """A painted ball, called as its material is, with a photo."""
    made.studio(base_color=(0.5, 0.4, 0.3), roughness=0.5)
    paint(bpy.data.objects["Body"])
    path = made.photo(tmp_path / "Camera.exr", value=0.15)
    found = bpy.context.scene.selenite
    bpy.ops.selenite.refresh_rows()
    bpy.ops.selenite.add_capture()
    found.captures[0].photo = bpy.data.images.load(str(path))
    found.height, found.iterations, found.tolerance = 16, 4, 0.0
    found.picture_spp, found.threads = 8, 1
    found.output = str(tmp_path / "out")
    return found


def row():
    return next(r for r in bpy.context.scene.selenite.rows if r.parameter == NAME)


def test_an_object_has_a_group_of_its_own_where_its_material_shows_colours(settings):
    groups = [(item.kind, item.name) for item in settings.owners]
    assert ("object", "Body") in groups
    assert ("material", "Body") in groups
    rows = [(r.owner, r.parameter) for r in settings.rows if r.kind == "object"]
    assert rows == [("Body", NAME), ("Body", "vertex_positions")]
    assert not row().reason
    row().enabled = True
    bpy.data.objects["Body"].name = "Ball"
    bpy.ops.selenite.refresh_rows()
    assert (row().owner, row().enabled) == ("Ball", True)  # the tick follows the object
    found = request.run_request(bpy.context.scene, made.read())
    assert [(item.owner, item.parameter) for item in found.unknowns] == [("Ball", NAME)]


def test_a_row_that_cannot_be_fitted_says_why(settings):
    bpy.data.objects["Body"].modifiers.new("Subsurf", "SUBSURF")
    bpy.ops.selenite.refresh_rows()
    assert "modifiers make other vertices" in row().reason


def test_a_fit_is_applied_undone_and_restored(settings):
    row().enabled = True
    before = colors()
    assert bpy.ops.selenite.start() == {"FINISHED"}
    result = next(r for r in settings.results if r.parameter == NAME)
    fitted = np.load(result.grid_file)
    assert "% seen by the photos" in result.text
    assert np.array_equal(colors(), before)
    undo_steps.prepare()
    assert bpy.ops.selenite.apply("EXEC_DEFAULT", True) == {"FINISHED"}
    assert np.allclose(colors()[:, :3], fitted, atol=1e-6)
    assert not np.allclose(fitted, before[:, :3])
    undo_steps.undo()
    assert np.array_equal(colors(), before)
    settings = bpy.context.scene.selenite
    assert bpy.ops.selenite.apply() == {"FINISHED"}
    assert bpy.ops.selenite.restore() == {"FINISHED"}
    assert np.array_equal(colors(), before)
    assert not settings.applied
