# SPDX-License-Identifier: GPL-3.0-or-later
"""Volume nodes -> media -> volume nodes."""

import bpy
import made_scenes as made
import pytest

from selenite import write_back
from selenite.scene_read.shading import volumes

pytestmark = pytest.mark.blender34


def linked(kind, **values):
    """A studio whose Body has one volume node with some inputs set."""
    material = made.studio()
    tree = material.node_tree
    node = tree.nodes.new(kind)
    for name, value in values.items():
        socket = node.inputs[name.replace("_", " ")]
        socket.default_value = (*value, 1.0) if isinstance(value, tuple) else value
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Volume"])
    return material, node


def medium():
    return made.read().owners["Body"].values


def test_principled_volume_by_the_formulas_of_cycles():
    linked(
        "ShaderNodeVolumePrincipled",
        Color=(0.95, 0.8, 0.5),
        Density=3.0,
        Anisotropy=0.4,
        Absorption_Color=(0.25, 0.04, 0.0),
    )
    found = medium()
    scattering = [3 * 0.95, 3 * 0.8, 3 * 0.5]
    absorption = [3 * 0.05 * 0.5, 3 * 0.2 * 0.8, 3 * 0.5]
    extinction = [s + a for s, a in zip(scattering, absorption, strict=True)]
    assert found["extinction"] == pytest.approx(extinction, rel=1e-6)
    albedo = [s / t for s, t in zip(scattering, extinction, strict=True)]
    assert found["albedo"] == pytest.approx(albedo, rel=1e-6)
    assert found["anisotropy"] == pytest.approx((0.4,))


def test_absorption_scatters_nothing_and_scatter_absorbs_nothing():
    linked("ShaderNodeVolumeAbsorption", Color=(0.9, 0.5, 0.0), Density=2.0)
    assert medium()["extinction"] == pytest.approx((0.2, 1.0, 2.0), rel=1e-6)
    assert medium()["albedo"] == (0.0, 0.0, 0.0)
    bpy.data.materials.remove(bpy.data.materials["Body"])
    linked("ShaderNodeVolumeScatter", Color=(0.9, 0.5, 0.1), Density=2.0, Anisotropy=-0.3)
    assert medium()["extinction"] == pytest.approx((1.8, 1.0, 0.2), rel=1e-6)
    assert medium()["albedo"] == pytest.approx((1.0, 1.0, 1.0))


def test_absorption_and_scatter_add():
    material, scatter = linked("ShaderNodeVolumeScatter", Color=(1.0, 1.0, 1.0), Density=1.0)
    tree = material.node_tree
    absorption, both = (
        tree.nodes.new(kind) for kind in ("ShaderNodeVolumeAbsorption", "ShaderNodeAddShader")
    )
    absorption.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    absorption.inputs["Density"].default_value = 3.0
    tree.links.new(scatter.outputs[0], both.inputs[0])
    tree.links.new(absorption.outputs[0], both.inputs[1])
    tree.links.new(both.outputs[0], tree.get_output_node("CYCLES").inputs["Volume"])
    assert medium()["extinction"] == pytest.approx((4.0, 4.0, 4.0))
    assert medium()["albedo"] == pytest.approx((0.25, 0.25, 0.25))
    assert "cannot hold every medium" in made.read().owners["Body"].fixed["extinction"]


@pytest.mark.parametrize("kind", ["ShaderNodeVolumePrincipled", "ShaderNodeVolumeCoefficients"])
@pytest.mark.parametrize(
    "wanted",
    [
        {"extinction": (5.0, 2.0, 0.5), "albedo": (0.9, 0.5, 0.1), "anisotropy": (0.6,)},
        {"extinction": (3.0, 3.0, 3.0), "albedo": (1.0, 0.0, 0.5), "anisotropy": (-0.5,)},
        {"extinction": (100.0, 0.1, 1.0), "albedo": (0.999, 0.2, 0.8), "anisotropy": (0.0,)},
    ],
)
def test_what_is_written_is_read_again(kind, wanted):
    if not hasattr(bpy.types, kind):
        pytest.skip(f"this Blender has no {kind}")
    linked(kind, Anisotropy=0.1)
    owners = made.read().owners
    write_back.write(
        bpy.context.scene, owners, {("Body", name): value for name, value in wanted.items()}
    )
    for name, value in wanted.items():
        # The absorption colour is a square near 1 where little is absorbed, in float32.
        assert medium()[name] == pytest.approx(value, rel=2e-4, abs=1e-6), name


def test_undoing_a_write_brings_the_numbers_back():
    linked("ShaderNodeVolumePrincipled", Color=(0.9, 0.6, 0.3), Density=2.0)
    owners, before = made.read().owners, medium()
    back = write_back.write(bpy.context.scene, owners, {("Body", "extinction"): (7.0, 8.0, 9.0)})
    write_back.write(bpy.context.scene, owners, back)
    for name in volumes.PARAMETERS:
        assert medium()[name] == pytest.approx(before[name], rel=1e-5)


def test_volume_without_surface_is_invisible_but_for_its_medium():
    material, _ = linked("ShaderNodeVolumeScatter", Density=1.0)
    tree = material.node_tree
    tree.nodes.remove(made.principled(material))
    read = made.read()
    assert not read.problems
    values = read.materials[0]
    assert values.values["alpha"] == (0.0,)
    assert "extinction" in values.values


def mixed(tree, *kinds):
    """A mixture of new nodes."""
    mixture = tree.nodes.new("ShaderNodeMixShader")
    for kind, socket in zip(kinds, mixture.inputs[1:], strict=True):
        tree.links.new(tree.nodes.new(kind).outputs[0], socket)
    return mixture


@pytest.mark.parametrize("surface", [True, False], ids=["with surface", "alone"])
@pytest.mark.parametrize("mixture", [True, False], ids=["mixed", "one"])
def test_shaders_of_surfaces_make_no_medium(surface, mixture):
    """Cycles passes over them: its picture is that without them."""
    material, node = linked("ShaderNodeBsdfGlass")
    tree = material.node_tree
    if mixture:
        node = mixed(tree, "ShaderNodeBsdfGlass", "ShaderNodeBsdfPrincipled")
        tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Volume"])
    if not surface:
        tree.nodes.remove(made.principled(material))
    read = made.read()
    assert [item.line() for item in read.problems] == []
    assert "extinction" not in read.materials[0].values
    assert (read.materials[0].values["alpha"] == (0.0,)) is not surface


def test_a_volume_mixed_with_a_surface_is_refused():
    material, _ = linked("ShaderNodeVolumeScatter")
    tree = material.node_tree
    node = mixed(tree, "ShaderNodeBsdfGlass", "ShaderNodeVolumeScatter")
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Volume"])
    assert any("its Volume is" in item.line() for item in made.read().problems)


@pytest.mark.parametrize(
    ("kind", "values", "words"),
    [
        ("ShaderNodeVolumePrincipled", {"Emission_Strength": 1.0}, ("emits", "Emission Strength")),
        ("ShaderNodeEmission", {}, ("does not render", "Principled Volume")),
    ],
)
def test_what_is_not_rendered_is_refused_by_name(kind, values, words):
    linked(kind, **values)
    problems = [str(item) for item in made.read().problems]
    assert any(all(word in text for word in words) for text in problems), problems


def test_density_from_a_texture_is_refused():
    material, node = linked("ShaderNodeVolumePrincipled")
    noise = material.node_tree.nodes.new("ShaderNodeTexNoise")
    material.node_tree.links.new(noise.outputs[0], node.inputs["Density"])
    problems = [str(item) for item in made.read().problems]
    assert any("'Density'" in text and "varies" in text for text in problems), problems
