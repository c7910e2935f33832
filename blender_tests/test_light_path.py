# SPDX-License-Identifier: GPL-3.0-or-later
"""Light Path on the ways of a picture, camera and shadow rays, against Cycles."""

import bpy
import made_scenes as made
import numpy as np
import pytest
from strips import render_both

pytestmark = pytest.mark.blender

SIZE = 4


def sheet(name, x, z, kind, output):
    """A large triangle right of x whose colour is 0.1 and a tenth of an output of Light Path."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new(kind)
    if output:
        number = tree.nodes.new("ShaderNodeMath")
        number.operation = "MULTIPLY_ADD"
        number.inputs[1].default_value, number.inputs[2].default_value = 0.1, 0.1
        tree.links.new(tree.nodes.new("ShaderNodeLightPath").outputs[output], number.inputs[0])
        tree.links.new(number.outputs[0], shader.inputs[0])
    end = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(shader.outputs[0], end.inputs["Surface"])
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([(x, -60, z), (x + 90, 0, z), (x, 60, z)], [], [(0, 1, 2)])
    mesh.materials.append(material)
    return made.add(name, mesh)


def compared(native, tmp_path):
    ours, cycles = render_both(native, tmp_path, (SIZE, SIZE), 1)
    assert cycles.max() > 1e-3
    # Lengths differ by where in a pixel the one sample lies.
    np.testing.assert_allclose(ours, cycles, rtol=5e-4, atol=1e-6)
    return cycles


def test_ray_length_starts_at_the_near_clip_plane(native, empty_scene, tmp_path):
    sheet("Clear", -9, 1.0, "ShaderNodeBsdfTransparent", "Ray Length")
    sheet("Light", -9, 0.0, "ShaderNodeEmission", "Ray Length")
    # The camera stands at 5 and its near clip plane is 0.1 before it.
    found = compared(native, tmp_path)
    np.testing.assert_allclose(found, (0.1 + 0.1 * 3.9) * (0.1 + 0.1 * 4.9), rtol=1e-4)


@pytest.mark.parametrize(
    "output",
    ["Ray Depth", "Transparent Depth", "Diffuse Depth", "Ray Length", "Is Shadow Ray"],
)
def test_shadow_rays_know_their_way(native, empty_scene, tmp_path, output):
    """Two sheets between a diffuse ground and a sun, beside what the camera sees."""
    sheet("Ground", -9, 0.0, "ShaderNodeBsdfDiffuse", "")
    for z in (2.0, 2.5):
        sheet(f"Sheet {z}", 4.5, z, "ShaderNodeBsdfTransparent", output)
    made.light("Sun", "SUN", energy=3.0, angle=0.0).rotation_euler = (0.0, 1.2, 0.0)
    compared(native, tmp_path)
