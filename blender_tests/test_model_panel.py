# SPDX-License-Identifier: GPL-3.0-or-later
"""Models of a body from the panel: the process on a copy, the list, Apply, Restore and undo."""

from pathlib import Path

import bpy
import drawn_panels
import made_scenes as made
import pytest
import undo_steps
from photographed_ball import studio

from selenite.interface import panels, state
from selenite.interface.operators import models
from selenite.interface.progress.head import next_step
from selenite.scene_read.shading import volumes as volume_nodes
from selenite.write_back import body_models

pytestmark = [pytest.mark.blender, pytest.mark.usefixtures("addon")]


def opened(tmp_path, translucent):
    """The scene of the ball in the panel, with its photos as captures."""
    start, _ = studio(tmp_path, translucent)
    bpy.ops.wm.open_mainfile(filepath=start)
    settings = bpy.context.scene.selenite
    for index in range(4):
        row = settings.captures.add()
        row.camera = bpy.data.objects[f"Camera {index}"]
        row.photo = bpy.data.images.load(str(tmp_path / f"{index}.exr"))
    settings.height, settings.iterations, settings.spp = 20, 20, 32
    settings.picture_spp, settings.output = 16, str(tmp_path / "fits")
    return settings


def volumes(material):
    return [n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeVolumePrincipled"]


def test_models_are_fitted_applied_and_taken_back(tmp_path):
    settings = opened(tmp_path, translucent=True)
    settings.body = "auto"
    assert next_step(bpy.context.scene) == ("selenite.fit_models", "PLAY")
    assert bpy.ops.selenite.fit_models() == {"FINISHED"}
    rows = {row.name: row for row in settings.models}
    assert rows["medium"].kept and 0 < rows["medium"].error < 0.3 * rows["opaque"].error
    assert "medium" in models.news(settings)[0] and "times better" in models.news(settings)[0]
    # Nothing in the scene has changed yet.
    assert [item.name for item in bpy.data.materials] == ["Body"]
    assert not volumes(bpy.data.materials["Body"])
    drawn = drawn_panels.draw(panels.SELENITE_PT_head) + drawn_panels.draw(
        panels.SELENITE_PT_models
    )
    assert "selenite.apply_model" in drawn and "models" in drawn

    settings.active_model = list(rows).index("medium")
    undo_steps.prepare()
    assert bpy.ops.selenite.apply_model("EXEC_DEFAULT", True) == {"FINISHED"}
    shown = next(item for item in bpy.data.objects if item.type == "MESH")
    assert shown.active_material.name == "Body" and volumes(shown.active_material)
    settings = bpy.context.scene.selenite
    assert settings.body == "ticked" and settings.model_applied == "medium"
    assert any(row.parameter == "extinction" for row in settings.rows)

    undo_steps.undo()
    assert not volumes(bpy.data.materials["Body"])
    undo_steps.redo()
    assert volumes(bpy.data.materials["Body"])
    assert bpy.ops.selenite.restore_model() == {"FINISHED"}
    assert not volumes(bpy.data.materials["Body"])
    assert [item.name for item in bpy.data.materials] == ["Body"]


def test_too_few_photos_and_an_unclear_material_are_said_before_a_process_starts(tmp_path):
    made.studio()
    made.sphere("Other", made.material("Second"))
    made.save(tmp_path / "scene.blend")
    settings = bpy.context.scene.selenite
    row = settings.captures.add()
    row.camera = bpy.data.objects["Camera"]
    row.photo = bpy.data.images.load(str(made.photo(tmp_path / "Camera.exr")))
    settings.body = "medium"
    with pytest.raises(RuntimeError, match="there are 1; .* Body set to As Ticked"):
        bpy.ops.selenite.fit_models()
    said = " ".join(item.line() for item in state.PROBLEMS[bpy.context.scene.name])
    assert "its material is not clear: 'Body', 'Second'" in said
    assert state.MODELS.job is None


def test_a_model_of_another_file_replaces_the_material_and_comes_back(tmp_path):
    material = made.studio()
    before = made.save(tmp_path / "before.blend")
    body_models.make_medium(material)
    other = made.save(tmp_path / "other.blend")
    bpy.ops.wm.open_mainfile(filepath=before)
    scene, body = bpy.context.scene, bpy.data.objects["Body"]
    found = body_models.take(scene, bpy.data.materials["Body"], Path(other))
    assert body.active_material == found and found.name == "Body" and volumes(found)
    again = body_models.give_back(scene, found)
    assert body.active_material == again and again.name == "Body" and not volumes(again)
    with pytest.raises(Exception, match="cannot be read"):
        body_models.take(scene, again, tmp_path / "none.blend")
    assert body.active_material == again and again.name == "Body"


def test_forms_of_a_body_are_what_fits_begin_with():
    material = made.studio()
    body_models.make_medium(material)
    (volume,) = volumes(material)
    volume.inputs["Absorption Color"].default_value = (0.2, 0.4, 0.6, 1.0)
    body_models.make_grey(material)
    source, reason = volume_nodes.find_node(material)
    medium = volume_nodes.read(source, "")
    assert not reason and medium["albedo"] != pytest.approx((0.9, 0.9, 0.9), abs=0.01)
    assert medium["extinction"] == pytest.approx([medium["extinction"][0]] * 3)
    body_models.make_subsurface(material)
    inputs = made.principled(material).inputs
    weight = "Subsurface Weight" if "Subsurface Weight" in inputs else "Subsurface"
    assert inputs[weight].default_value == pytest.approx(0.9)
    scale = inputs["Subsurface Scale"].default_value
    assert scale == pytest.approx(0.1 * max(bpy.data.objects["Body"].dimensions), rel=0.2)
    assert not material.node_tree.get_output_node("CYCLES").inputs["Volume"].is_linked
