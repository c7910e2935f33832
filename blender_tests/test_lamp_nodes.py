# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps that use nodes: an Emission node multiplies the lamp, whatever else is named."""

import bpy
import made_scenes as made
import pytest

pytestmark = [pytest.mark.blender, pytest.mark.blender34]


@pytest.fixture
def lamp():
    """A lamp of 40 W in (0.5, 0.8, 1) with an Emission node of its own: (1, 0.5, 0.25) times 3."""
    made.studio()
    made.light(energy=40, color=(0.5, 0.8, 1.0))
    data = bpy.data.lights["Key"]
    data.use_nodes = True
    node = emission(data)
    node.inputs["Color"].default_value = (1.0, 0.5, 0.25, 1.0)
    node.inputs["Strength"].default_value = 3.0
    return data


def emission(data):
    return next(n for n in data.node_tree.nodes if n.bl_idname == "ShaderNodeEmission")


def output(data):
    return next(n for n in data.node_tree.nodes if n.bl_idname == "ShaderNodeOutputLight")


def read():
    values = made.read()
    (light,) = values.lights
    return values, light


def test_an_emission_node_multiplies_colour_and_strength(lamp):
    values, light = read()
    assert not values.problems
    assert light.power == pytest.approx(40)
    assert light.color == pytest.approx((0.5, 0.4, 0.25))
    assert light.radiance_scale == pytest.approx(3)
    assert values.owners["Key"].values["color"] == pytest.approx((0.5, 0.4, 0.25))
    assert "nodes" in values.owners["Key"].fixed["color"]


def test_without_nodes_the_lamp_alone_counts(lamp):
    lamp.use_nodes = False
    values, light = read()
    assert not values.problems
    assert light.color == pytest.approx((0.5, 0.8, 1.0))
    assert light.radiance_scale == pytest.approx(1)
    assert "color" not in values.owners["Key"].fixed


def test_a_constant_node_is_looked_through(lamp):
    tree = lamp.node_tree
    value = tree.nodes.new("ShaderNodeValue")
    value.outputs[0].default_value = 7.0
    tree.links.new(value.outputs[0], emission(lamp).inputs["Strength"])
    assert read()[1].radiance_scale == pytest.approx(7)


def test_nodes_that_compute_with_constants_are_folded(lamp):
    tree = lamp.node_tree
    warm, twice = tree.nodes.new("ShaderNodeBlackbody"), tree.nodes.new("ShaderNodeMath")
    warm.inputs[0].default_value = 3000.0
    tree.links.new(warm.outputs[0], emission(lamp).inputs["Color"])
    twice.operation = "MULTIPLY"
    twice.inputs[0].default_value, twice.inputs[1].default_value = 3.0, 2.5
    tree.links.new(twice.outputs[0], emission(lamp).inputs["Strength"])
    values, light = read()
    assert not values.problems
    assert light.radiance_scale == pytest.approx(7.5)
    # Of the blackbody as Cycles has it: 1.77, 0.80, 0.22 at 3000 K, times the lamp's colour.
    red, green, blue = (a / b for a, b in zip(light.color, (0.5, 0.8, 1.0), strict=True))
    assert red > 1.5 > 1.0 > green > 0.5 > 0.4 > blue > 0


def test_what_is_not_an_emission_of_constants_is_named(lamp):
    tree = lamp.node_tree
    noise = tree.nodes.new("ShaderNodeTexNoise")
    link = tree.links.new(noise.outputs[0], emission(lamp).inputs["Strength"])

    def complaint():
        problems = [item.line() for item in read()[0].problems]
        return next((text for text in problems if "Light 'Key'" in text), "")

    assert complaint()
    tree.links.remove(link)
    assert not complaint()
    emission(lamp).mute = True
    assert complaint()
    emission(lamp).mute = False
    assert not complaint()
    for item in list(output(lamp).inputs["Surface"].links):
        tree.links.remove(item)
    assert complaint()
