# SPDX-License-Identifier: GPL-3.0-or-later
"""Constants of a node graph: which there are, what is usual, both sides of a mixture."""

from __future__ import annotations

import bpy
import node_probes as probes
import numpy as np
import pytest
from node_probes import Graph

from selenite import native, write_back
from selenite.fit.unknowns import usual_requests
from selenite.scene_read import build
from selenite.scene_read.scene import read_scene
from selenite.scene_read.shading.graph import ramps
from selenite.scene_read.values import Owner, SceneValues


def _graph() -> tuple[Graph, bpy.types.Node]:
    tree = probes.scene().node_tree
    tree.nodes.clear()
    return Graph(tree), tree.nodes.new("ShaderNodeOutputMaterial")


def _read() -> tuple[SceneValues, Owner]:
    values = read_scene(bpy.context.scene, surveys=False)
    assert not values.problems, values.problems
    return values, values.owners["Shown"]


def _ramp(graph: Graph, interpolation: str = "LINEAR") -> bpy.types.Node:
    """Three stops over a coordinate."""
    node = graph.node("ValToRGB", {0: probes.part(graph, 0, 0.5)})
    ramp = node.color_ramp
    ramp.interpolation = interpolation
    ramp.elements[0].position = 0.2
    ramp.elements.new(0.6).color = (0.6, 0.1, 0.1, 1)
    ramp.elements[0].color = (0.05, 0.1, 0.4, 1)
    ramp.elements[2].color = (0.9, 0.6, 0.1, 0.5)
    return node


@pytest.mark.parametrize("interpolation", ["LINEAR", "EASE", "CONSTANT", "B_SPLINE", "CARDINAL"])
def test_stops_of_a_ramp_add_up_to_it(interpolation: str) -> None:
    graph, _ = _graph()
    ramp = _ramp(graph, interpolation).color_ramp
    if interpolation == "CARDINAL":  # else it overshoots 0, where Blender cuts it off
        ramp.elements[0].color = (0.3, 0.3, 0.4, 1)
        ramp.elements[1].color = ramp.elements[2].color = (0.5, 0.4, 0.3, 1)
    places = np.linspace(0, 1, 101)
    parts = ramps.shares(ramp, places)
    colors = np.array([item.color[:3] for item in ramp.elements])
    true = np.array([ramp.evaluate(float(x))[:3] for x in places])
    np.testing.assert_allclose(parts @ colors, true, atol=1e-6)
    np.testing.assert_allclose(parts.sum(axis=1), 1)


def test_a_ramp_that_is_no_sum_of_its_stops_is_a_table() -> None:
    graph, output = _graph()
    node = _ramp(graph)
    graph.put(output, "Surface", graph.node("BsdfDiffuse", {"Color": node.outputs[0]}).outputs[0])
    assert "Color Ramp.color[1]" in _read()[1].values
    node.color_ramp.color_mode = "HSV"
    assert "Color Ramp.color[1]" not in _read()[1].values
    node.color_ramp.color_mode = "RGB"
    for number in range(ramps.MOST_STOPS - 2):
        node.color_ramp.elements.new(0.3 + 0.01 * number)
    assert "Color Ramp.color[1]" not in _read()[1].values


def test_a_stop_and_a_colour_node_are_moved_and_written() -> None:
    graph, output = _graph()
    node, rgb = _ramp(graph), graph.node("RGB")
    rgb.outputs[0].default_value = (0.5, 0.6, 0.7, 1)
    mixed = graph.node(
        "Mix",
        {"Factor_Float": 0.25, "A_Color": node.outputs[0], "B_Color": rgb.outputs[0]},
        data_type="RGBA",
        blend_type="MULTIPLY",
    )
    emission = graph.node("Emission", {"Color": mixed.outputs[2]})
    graph.put(output, "Surface", emission.outputs[0])
    values, owner = _read()
    new = {
        "Color Ramp.color[1]": (0.2, 0.7, 0.3),
        "RGB.Color": (0.9, 0.2, 0.4),
        "Mix.Factor": (0.75,),
    }
    assert not owner.fixed.keys() & new.keys()
    moved = build.build(values).with_values({("Shown", name): x for name, x in new.items()})
    size = probes.SIZE
    (by_fit,) = moved.shader_values("Shown", "Camera", size, size)
    before = write_back.write(
        bpy.context.scene, values.owners, {("Shown", name): x for name, x in new.items()}
    )
    np.testing.assert_allclose(before["Shown", "Color Ramp.color[1]"], (0.6, 0.1, 0.1), rtol=1e-6)
    np.testing.assert_allclose(node.color_ramp.elements[1].color, (0.2, 0.7, 0.3, 1), rtol=1e-6)
    np.testing.assert_allclose(rgb.outputs[0].default_value, (0.9, 0.2, 0.4, 1), rtol=1e-6)
    written = build.build(_read()[0])
    (by_scene,) = written.shader_values("Shown", "Camera", size, size)
    colors = [np.nan_to_num(item["inputs"]["color"]) for item in (by_fit, by_scene)]
    np.testing.assert_allclose(*colors, atol=1e-6)
    assert np.ptp(colors[0], axis=(0, 1)).min() > 0.05


def test_an_animated_stop_is_fixed() -> None:
    graph, output = _graph()
    node = _ramp(graph)
    graph.put(output, "Surface", graph.node("BsdfDiffuse", {"Color": node.outputs[0]}).outputs[0])
    node.color_ramp.elements[1].keyframe_insert("color", frame=1)
    fixed = _read()[1].fixed
    assert "keyframes" in fixed["Color Ramp.color[1]"]
    assert "Color Ramp.color[0]" not in fixed


def _mixed(factor: float, *, second: str = "BsdfAnisotropic") -> bpy.types.Node:
    graph, output = _graph()
    one = graph.node("BsdfDiffuse", {"Color": (0.7, 0.3, 0.1)})
    mixed = graph.node("MixShader", {0: factor, 1: one.outputs[0]})
    graph.put(mixed, 2, graph.node(second).outputs[0])
    graph.put(output, "Surface", mixed.outputs[0])
    return mixed


@pytest.mark.parametrize("factor", [0.0, 1.0])
def test_a_side_without_share_is_there_for_a_fit_of_the_factor(factor: float) -> None:
    _mixed(factor)
    values, _ = _read()
    shader = next(item for item in values.materials if item.name == "Shown").shader
    assert shader is not None
    kinds = [item.kind for item in shader.closures]
    assert sorted(kinds) == ["diffuse", "glossy"]
    assert kinds[0] == ("glossy" if factor else "diffuse")
    trimmed = values.without_shut({("Shown", "Glossy BSDF.Color")}).materials
    shown = next(item.shader for item in trimmed if item.name == "Shown")
    assert shown is not None
    assert [item.kind for item in shown.closures] == kinds[:1]
    assert len(shown.code) <= len(shader.code)
    whole = values.without_shut({("Shown", "Mix Shader.Fac")}).materials
    assert next(item.shader for item in whole if item.name == "Shown") is shader


def test_the_slope_by_a_factor_of_0_is_what_the_other_side_adds() -> None:
    """One bounce of light is linear in the factor."""
    _mixed(0.0)
    lamp = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    lamp.rotation_euler = (0.4, 0.0, 0.0)
    bpy.context.collection.objects.link(lamp)
    scene = build.build(_read()[0])
    key = ("Shown", "Mix Shader.Fac")
    core = native.core()
    options = {"seed": 1, "depth": 2}
    film = core.render(scene, "Camera", 8, 8, 256, parameters=[key], **options)
    ends = [core.render(scene.with_values({key: [x]}), "Camera", 8, 8, 256, **options).image
            for x in (0.0, 1.0)]  # fmt: skip
    wanted = np.mean(ends[1] - ends[0], axis=(0, 1))
    np.testing.assert_allclose(np.mean(film.jacobian[0], axis=(0, 1)), wanted, rtol=0.05)


def test_what_cannot_be_rendered_on_a_side_without_share_only_fixes_the_factor() -> None:
    _mixed(0.0, second="BsdfToon")
    values, owner = _read()
    assert "between 0 and 1" in owner.fixed["Mix Shader.Fac"]
    assert "Toon BSDF.Color" not in owner.values
    assert "Diffuse BSDF.Color" in owner.values
    scene = build.build(values)
    (found,) = scene.shader_values("Shown", "Camera", 8, 8)
    assert found["kind"] == "diffuse"


def test_usual_are_colours_and_roughnesses_of_closures() -> None:
    graph, output = _graph()
    node = _ramp(graph)
    glossy = graph.node("BsdfAnisotropic", {"Roughness": 0.3, "Color": node.outputs[0]})
    inputs = {0: 0.25, 1: graph.node("BsdfDiffuse").outputs[0], 2: glossy.outputs[0]}
    graph.put(output, "Surface", graph.node("MixShader", inputs).outputs[0])
    values, _ = _read()
    found = [(item.owner, item.parameter) for item in usual_requests(values, [])]
    assert found == [
        ("Shown", "Diffuse BSDF.Color"),
        ("Shown", "Color Ramp.color[0]"),
        ("Shown", "Color Ramp.color[1]"),
        ("Shown", "Color Ramp.color[2]"),
        ("Shown", "Glossy BSDF.Roughness"),
    ]
