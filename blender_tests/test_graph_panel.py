# SPDX-License-Identifier: GPL-3.0-or-later
"""Constants of a node graph in the panel: listed, ticked, fitted, applied, restored, undone."""

import re

import bpy
import drawn_panels
import made_scenes as made
import pytest
import recording_fit
import undo_steps

from selenite.interface.result.panel import SELENITE_PT_result as Result
from selenite.interface.rows.panel import SELENITE_PT_parameters as Parameters

pytestmark = [pytest.mark.blender, pytest.mark.blender34, pytest.mark.usefixtures("addon")]

RAMP, FACTOR, ROUGH = "Worn.color[1]", "Coat.Fac", "Gloss.Roughness"


def graph():
    """The nodes of the ball: a diffuse colour by a ramp of two stops, and some gloss."""
    tree = bpy.data.materials["Body"].node_tree
    return {node.name: node for node in tree.nodes}


@pytest.fixture
def settings(tmp_path):
    material = made.studio()
    tree = material.node_tree
    tree.nodes.remove(made.principled(material))
    make = tree.nodes.new
    ramp, mapping = make("ShaderNodeValToRGB"), make("ShaderNodeMapping")
    diffuse, gloss = make("ShaderNodeBsdfDiffuse"), make("ShaderNodeBsdfGlossy")
    mix, coordinates = make("ShaderNodeMixShader"), make("ShaderNodeTexCoord")
    for node, name in ((ramp, "Worn"), (mix, "Coat"), (gloss, "Gloss"), (mapping, "Where")):
        node.name = name
    mapping.inputs["Location"].default_value = (-0.5, 0.25, 0.5)
    gloss.inputs["Roughness"].default_value = 0.4
    mix.inputs[0].default_value = 0.25
    ramp.color_ramp.elements[1].color = (0.8, 0.4, 0.2, 1)
    for output, target in (
        (coordinates.outputs["Object"], mapping.inputs["Vector"]),
        (mapping.outputs[0], ramp.inputs["Fac"]),
        (ramp.outputs["Color"], diffuse.inputs["Color"]),
        (diffuse.outputs[0], mix.inputs[1]),
        (gloss.outputs[0], mix.inputs[2]),
        (mix.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"]),
    ):
        tree.links.new(output, target)
    made.save(tmp_path / "scene.blend")
    found = bpy.context.scene.selenite
    bpy.ops.selenite.refresh_rows()
    capture = found.captures.add()
    capture.camera = bpy.data.objects["Camera"]
    path = made.photo(tmp_path / "photo.exr", size=(48, 36), value=0.25)
    capture.photo = bpy.data.images.load(str(path))
    found.height, found.output = 12, str(tmp_path / "fits")
    return found


def rows(settings):
    return {row.parameter: row for row in settings.rows if row.owner == "Body"}


def fitted(settings, monkeypatch, *names):
    recorded = recording_fit.install(monkeypatch)
    for name in names:
        rows(settings)[name].enabled = True
    assert bpy.ops.selenite.start() == {"FINISHED"}
    return recorded.fit


def test_constants_of_the_graph_are_rows(settings):
    found = rows(settings)
    assert {RAMP, FACTOR, ROUGH, "Worn.color[0]", "Gloss.Color"} <= set(found)
    assert "Diffuse BSDF.Color" not in found, "it is linked"
    assert "base_color" not in found, "a graph has no inputs of a Principled BSDF"
    row = found[RAMP]
    assert (row.label, row.width, row.is_colour) == ("Worn: Color [1]", 3, True)
    assert row.value == "0.80 0.40 0.20"
    assert found[FACTOR].value == "0.250"
    assert (found[FACTOR].minimum, found[FACTOR].maximum) == (0, 1)
    place = found["Where.Location"]
    assert place.is_vector and not place.is_colour
    assert place.minimum < -0.5 and place.maximum > 0.5
    assert "Body:Worn.color[1]" in row.tip
    assert "rows" in drawn_panels.draw(Parameters)


def test_usual_are_colours_and_roughness(settings):
    for row in settings.rows:
        row.enabled = False
    bpy.ops.selenite.tick_usual()
    ticked = {name for name, row in rows(settings).items() if row.enabled}
    assert ticked == {"Worn.color[0]", RAMP, "Gloss.Color", ROUGH}


def test_ticks_starts_and_bounds_reach_the_native_fit_and_stay(settings, monkeypatch):
    row = rows(settings)[RAMP]
    row.minimum, row.maximum, row.use_start, row.start = 0.1, 0.9, True, (0.3, 0.5, 0.7)
    fit = fitted(settings, monkeypatch, RAMP, FACTOR)
    by_name = {item.parameter: item for item in fit.unknowns}
    assert set(by_name) == {RAMP, FACTOR}
    assert by_name[RAMP].start == pytest.approx([0.3, 0.5, 0.7])
    assert (by_name[RAMP].minimum, by_name[RAMP].maximum) == pytest.approx((0.1, 0.9))
    bpy.ops.selenite.refresh_rows()
    row = rows(settings)[RAMP]
    assert row.enabled and row.maximum == pytest.approx(0.9) and row.use_start
    bpy.ops.selenite.reset_rows()
    assert rows(settings)[RAMP].maximum == pytest.approx(1)


def test_apply_restore_and_undo_reach_the_nodes(settings, monkeypatch):
    fit = fitted(settings, monkeypatch, RAMP, FACTOR, "Where.Location")

    def now():
        nodes = graph()
        color = list(nodes["Worn"].color_ramp.elements[1].color)
        place = list(nodes["Where"].inputs["Location"].default_value)
        return color, nodes["Coat"].inputs[0].default_value, place

    before = (pytest.approx([0.8, 0.4, 0.2, 1]), pytest.approx(0.25), [-0.5, 0.25, 0.5])
    best = {name: pytest.approx(value) for name, value in fit.best.items()}
    assert now() == before
    text = drawn_panels.draw(Result)
    assert re.search(r"Wor\S* Col\S* \[1\]", text) and "swatch" in text
    undo_steps.prepare()
    assert bpy.ops.selenite.apply("EXEC_DEFAULT", True) == {"FINISHED"}
    color, factor, place = now()
    assert color[:3] == best["Body:" + RAMP] and color[3] == 1
    assert [factor] == best["Body:" + FACTOR]
    assert place == best["Body:Where.Location"]
    undo_steps.undo()
    assert now() == before
    undo_steps.redo()
    assert bpy.ops.selenite.restore() == {"FINISHED"}
    assert now() == before


def test_a_node_that_is_gone_is_told_and_nothing_is_written(settings, monkeypatch):
    fitted(settings, monkeypatch, RAMP, FACTOR)
    graph()["Worn"].name = "Renamed"
    with pytest.raises(RuntimeError, match=r"Worn\.color"):
        bpy.ops.selenite.apply()
    assert graph()["Coat"].inputs[0].default_value == pytest.approx(0.25)


def test_labels_are_in_the_language_of_the_interface(settings):
    view = bpy.context.preferences.view
    language = "de_DE" if bpy.app.version < (4, 0) else "de"
    if language not in bpy.app.translations.locales:
        pytest.skip("this Blender has no German")
    before = view.language, view.use_translate_interface
    view.language, view.use_translate_interface = language, True
    try:
        bpy.ops.selenite.refresh_rows()
        assert rows(settings)[ROUGH].label == "Gloss: Rauheit"
    finally:
        view.language, view.use_translate_interface = before
