# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel keeps what the reader warns of with the capture or material, until it is mended."""

import bpy
import made_scenes as made
import pytest
from drawn_panels import draw

from selenite.interface import panels, state, warning_rows
from selenite.interface.rows import panel as rows_panel
from selenite.messages import remark, thing

pytestmark = [pytest.mark.blender, pytest.mark.blender34, pytest.mark.usefixtures("addon")]


def warned(text):
    return f"{text} " in f"{' '.join(draw(rows_panel.SELENITE_PT_parameters).split())} "


def test_a_warning_stays_with_its_material_until_a_read_finds_it_mended():
    material = made.studio()
    body = next(item for item in bpy.data.objects if item.active_material == material)
    made.light("Key", energy=10)
    body.scale = (0, 0, 0)
    bpy.ops.mesh.primitive_cube_add(location=(0, 0, 5))
    other = bpy.context.object
    other.data.materials.append(material)
    bpy.ops.selenite.refresh_rows()
    said = f"Object '{body.name}' is flattened to nothing by its scale and left out"
    assert said in state.WARNINGS[bpy.context.scene.name].of_scene
    assert warned(said)
    bpy.ops.selenite.clear_problems()
    assert warned(said), "it is not a report that vanishes"
    body.scale = (1, 1, 1)
    assert warned(said), "nobody has read the scene again"
    bpy.ops.selenite.refresh_rows()
    assert not warned(said)


def test_a_file_load_clears_the_warnings():
    made.studio()
    bpy.ops.selenite.refresh_rows()
    state.WARNINGS[bpy.context.scene.name].of_scene = ["odd"]
    assert warned("odd")
    state.forget()
    assert not state.WARNINGS and not warned("odd")


def test_a_warning_is_drawn_with_what_it_is_about(tmp_path):
    made.studio()
    bpy.ops.selenite.refresh_rows()
    scene = bpy.context.scene
    row = scene.selenite.captures.add()
    row.camera = bpy.data.objects["Camera"]
    row.photo = bpy.data.images.load(str(made.photo(tmp_path / "a.png")))
    path = bpy.path.abspath(row.photo.filepath)
    of_photo = remark(thing("Photo", path), "it is dark")
    of_camera = remark(thing("Camera", "Camera"), "it is near")
    of_material = remark(thing("Material", "Body"), "it is baked")
    of_other = remark(thing("Mesh", "Body"), "it is folded")
    known = state.WARNINGS[scene.name]
    known.of_scene, known.of_plan = [of_camera, of_material, of_other], [of_photo]
    assert warning_rows.about(scene, warning_rows.of_capture(scene, 0)) == [of_camera, of_photo]
    owner = next(item for item in scene.selenite.owners if item.name == "Body")
    assert warning_rows.about(scene, warning_rows.of_owner(scene, owner)) == [of_material]
    assert warning_rows.others(scene) == [of_other]
    drawn = " ".join(draw(panels.SELENITE_PT_captures).split())
    assert "it is dark" in drawn and "it is near" in drawn and "it is baked" not in drawn
