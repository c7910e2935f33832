# SPDX-License-Identifier: GPL-3.0-or-later
"""Output nodes in groups, and muted ones: what Cycles takes for the output of a tree."""

import bpy
import made_scenes as made
import numpy as np
import pytest
from node_probes import of_cycles, ours, places, scene

pytestmark = pytest.mark.blender

OWN, INNER, OTHER = (0.7, 0.2, 0.1), (0.1, 0.9, 0.2), (0.3, 0.3, 0.8)


def _emission(tree, color, output="ShaderNodeOutputMaterial"):
    """An Emission linked to a new output of the tree; both nodes."""
    emission, end = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new(output)
    emission.inputs["Color"].default_value = (*color, 1)
    tree.links.new(emission.outputs[0], end.inputs["Surface"])
    return emission, end


def _group(color, inside=None):
    """A group with an output of its own, in another group if `inside` is one."""
    tree = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    if inside is None:
        _emission(tree, color)
    else:
        tree.nodes.new("ShaderNodeGroup").node_tree = inside
    return tree


def _put(material, tree):
    node = material.node_tree.nodes.new("ShaderNodeGroup")
    node.node_tree = tree
    return node


def _muted_inside(material):
    tree = _group(INNER)
    tree.nodes["Material Output"].mute = True
    _put(material, tree)


def _muted_shader_inside(material):
    tree = _group(INNER)
    tree.nodes["Emission"].mute = True
    _put(material, tree)


def _unlinked_inside(material):
    tree = _group(INNER)
    tree.links.clear()
    _put(material, tree)


def _own_is_muted(material):
    _put(material, _group(INNER))
    material.node_tree.nodes["Material Output"].mute = True


CASES = {
    "in a group": (lambda material: _put(material, _group(INNER)), INNER),
    "in a group of a group": (
        lambda material: _put(material, _group(INNER, inside=_group(INNER))),
        INNER,
    ),
    "the first of two": (
        lambda material: (_put(material, _group(INNER)), _put(material, _group(OTHER))),
        INNER,
    ),
    "a muted group": (lambda material: setattr(_put(material, _group(INNER)), "mute", True), OWN),
    "muted in a group": (_muted_inside, OWN),
    "of a muted shader": (_muted_shader_inside, OWN),
    "unlinked in a group": (_unlinked_inside, OWN),
    "its own is muted": (_own_is_muted, INNER),
}


@pytest.mark.parametrize("name", CASES)
def test_outputs_are_those_of_cycles(name, tmp_path):
    material = scene()
    where = places(material, tmp_path)
    material.node_tree.nodes.clear()
    _emission(material.node_tree, OWN)
    make, expected = CASES[name]
    make(material)
    np.testing.assert_allclose(of_cycles(tmp_path).mean(axis=(0, 1)), expected, rtol=1e-4)
    np.testing.assert_allclose(ours(where).mean(axis=(0, 1)), expected, rtol=1e-4)


def test_a_muted_output_of_the_world_lights_nothing():
    made.studio()
    world = bpy.context.scene.world
    world.node_tree.nodes["World Output"].mute = True
    read = made.read()
    assert not read.problems and read.world.strength == 0
    reason = read.owners["World"].fixed["strength"]
    assert reason == "nothing is linked to the Surface of the world's output: link a Background"


def test_a_group_lights_the_world_by_its_output():
    made.studio()
    tree = bpy.data.node_groups.new("Sky", "ShaderNodeTree")
    _emission(tree, INNER, "ShaderNodeOutputWorld")
    bpy.context.scene.world.node_tree.nodes.new("ShaderNodeGroup").node_tree = tree
    read = made.read()
    assert not read.problems
    np.testing.assert_allclose(read.world.color, INNER, rtol=1e-6)


def test_a_lamp_with_a_muted_output_is_refused():
    made.studio()
    lamp = made.light("Muted").data
    lamp.use_nodes = True
    lamp.node_tree.nodes["Light Output"].mute = True
    (problem,) = made.read().problems
    assert problem.object == "Light 'Muted'" and "no output" in problem.cause
