# SPDX-License-Identifier: GPL-3.0-or-later
"""Constants of a node graph in the list of parameters: labels, swatches, ticks."""

import bpy
from _driving import in_window, made, photographed, picture, run

from selenite.interface import panels


def prepare():
    """A ball of a ramp over noise under some gloss, and a grey photo."""
    material = made.studio()
    tree = material.node_tree
    tree.nodes.remove(made.principled(material))
    make, link = tree.nodes.new, tree.links.new
    ramp, noise = make("ShaderNodeValToRGB"), make("ShaderNodeTexWhiteNoise")
    diffuse, glossy = make("ShaderNodeBsdfDiffuse"), make("ShaderNodeBsdfGlossy")
    mix = make("ShaderNodeMixShader")
    ramp.color_ramp.elements[0].color = (0.1, 0.2, 0.6, 1)
    ramp.color_ramp.elements[1].color = (0.8, 0.5, 0.15, 1)
    link(noise.outputs["Value"], ramp.inputs["Fac"])
    link(ramp.outputs["Color"], diffuse.inputs["Color"])
    link(diffuse.outputs[0], mix.inputs[1])
    link(glossy.outputs[0], mix.inputs[2])
    link(mix.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    return photographed(0.4)


def steps():
    """See `_driving.run`."""
    settings = prepare()
    in_window(bpy.ops.selenite.tick_usual)
    names = [row.label for row in settings.rows if row.owner == "Body" and not row.reason]
    assert {"Mix Shader: Fac", "ColorRamp: Color [0]", "ColorRamp: Color [1]"} < set(names), names
    ticked = {row.label for row in settings.rows if row.enabled}
    assert "ColorRamp: Color [1]" in ticked and "Glossy BSDF: Roughness" in ticked, ticked
    settings.active_row = names.index("ColorRamp: Color [1]")
    yield 1.0
    picture("graph")


run(steps, panels, {panels.SELENITE_PT_parameters})
