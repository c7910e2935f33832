# SPDX-License-Identifier: GPL-3.0-or-later
"""The shape of a mesh in the panel, beside a roughness: from ticks to a shape key, and back."""

import bpy
import made_scenes as made
import numpy as np
import pytest
import undo_steps

from selenite.interface import request

pytestmark = [pytest.mark.blender, pytest.mark.blender34]

NAME = "vertex_positions"


def shown():
    """(n, 3): where a render has the vertices."""
    return np.array(made.read().meshes[0].positions)


@pytest.fixture
def settings(addon, tmp_path):
    """A ball with a photo of another brightness."""
    made.studio(base_color=(0.5, 0.4, 0.3), roughness=0.5)
    path = made.photo(tmp_path / "Camera.exr", value=0.15)
    found = bpy.context.scene.selenite
    bpy.context.view_layer.objects.active = bpy.data.objects["Body"]
    bpy.ops.selenite.refresh_rows()
    bpy.ops.selenite.add_capture()
    found.captures[0].photo = bpy.data.images.load(str(path))
    found.height, found.iterations, found.tolerance = 16, 5, 0.0
    found.picture_spp, found.threads = 8, 1
    found.output = str(tmp_path / "out")
    for row in found.rows:
        row.enabled = row.parameter in (NAME, "roughness")
    return found


def test_shape_and_roughness_are_asked_for_together(settings):
    found = request.run_request(bpy.context.scene, made.read())
    assert {item.parameter for item in found.unknowns} == {NAME, "roughness"}
    assert found.stages == ()  # the plan makes them


def test_a_fit_in_stages_is_applied_undone_and_restored(settings):
    before = shown()
    assert bpy.ops.selenite.start() == {"FINISHED"}
    result = next(r for r in settings.results if r.parameter == NAME)
    fitted = np.load(result.grid_file)
    assert fitted.shape == before.shape and not np.allclose(fitted, before)
    assert any(r.parameter == "roughness" for r in settings.results)
    assert np.array_equal(shown(), before)
    undo_steps.prepare()
    assert bpy.ops.selenite.apply("EXEC_DEFAULT", True) == {"FINISHED"}
    assert np.allclose(shown(), fitted, atol=1e-5)
    undo_steps.undo()
    assert np.allclose(shown(), before, atol=1e-6)
    assert bpy.data.objects["Body"].data.shape_keys is None
    assert bpy.ops.selenite.apply() == {"FINISHED"}
    assert bpy.ops.selenite.restore() == {"FINISHED"}
    assert np.allclose(shown(), before, atol=1e-6)
    assert bpy.data.objects["Body"].data.shape_keys is None
