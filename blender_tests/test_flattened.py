# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects with a scale of 0, which Cycles renders where they are flat anyway."""

import math

import bpy
import made_scenes as made
import pytest

from selenite import native
from selenite.cycles_check.render import render
from selenite.scene_read.build import build
from selenite.scene_read.scene import read_scene

pytestmark = pytest.mark.blender


@pytest.mark.parametrize("turned", [(0, 0, 0), (0.5, 0.3, 0.2), (math.pi, 0, 0)])
def test_a_plane_whose_scale_is_0_across_it_renders_as_in_cycles(turned, tmp_path) -> None:
    """Its other side shines, so that both sides have to be the same."""
    plane = flat_plane(turned)
    read = read_scene(bpy.context.scene)
    assert [*read.warnings, *read.problems] == []
    ours = native.core().render(build(read), "Camera", 32, 32, 64).image.mean()
    cycles = render(bpy.context.scene, "Camera", (32, 32), 64, 1, tmp_path / "x.exr").mean()
    assert ours == pytest.approx(cycles, rel=0.01)
    plane.scale.z = 1
    alike = render(bpy.context.scene, "Camera", (32, 32), 64, 1, tmp_path / "x.exr").mean()
    assert alike == pytest.approx(cycles, rel=0.01)


@pytest.mark.parametrize("kind", ["shared", "line", "body"])
def test_what_is_flattened_to_nothing_is_left_out_as_in_cycles(kind) -> None:
    plane = flat_plane((0, 0, 0))
    if kind == "shared":
        made.add("Other", plane.data).location.x = 50
    elif kind == "line":
        plane.scale.x = 0
    else:
        plane.data.vertices[0].co.z = 1
    read = read_scene(bpy.context.scene)
    found = [item.name for item in read.objects]
    assert found == ["Other"] * (kind == "shared")
    assert any("flattened to nothing" in text for text in read.warnings)


def flat_plane(turned):
    """A plane with a scale of 0 along its normal that shines on one side, seen from above."""
    made.camera(distance=5)
    made.world((0.2, 0.2, 0.2))
    bpy.ops.mesh.primitive_plane_add(size=2, rotation=turned)
    plane = bpy.context.object
    plane.scale.z = 0
    material = made.material("Plane")
    plane.data.materials.append(material)
    tree = material.node_tree
    side = tree.nodes.new("ShaderNodeNewGeometry")
    shader = made.principled(material)
    shader.inputs["Emission Color"].default_value = (1, 1, 1, 1)
    tree.links.new(side.outputs["Backfacing"], shader.inputs["Emission Strength"])
    return plane
