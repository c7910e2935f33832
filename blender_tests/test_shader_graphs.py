# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces of several shaders: what becomes of mixtures and groups, and what is refused."""

from __future__ import annotations

import bpy
import made_scenes as made
import node_probes as probes
import numpy as np
import pytest
from node_probes import Graph

from selenite import write_back
from selenite.cycles_check.render import render
from selenite.scene_read import build
from selenite.scene_read.scene import read_scene
from selenite.scene_read.values import MaterialValues, SceneValues


def _graph(material: bpy.types.Material) -> tuple[Graph, bpy.types.Node]:
    tree = material.node_tree
    tree.nodes.clear()
    return Graph(tree), tree.nodes.new("ShaderNodeOutputMaterial")


def _read() -> tuple[SceneValues, MaterialValues]:
    values = read_scene(bpy.context.scene, surveys=False)
    return values, next(item for item in values.materials if item.name == "Shown")


def _closures() -> list[dict]:
    values, _ = _read()
    assert not values.problems, values.problems
    size = probes.SIZE
    return build.build(values).shader_values("Shown", "Camera", size, size)


def _mixed(graph: Graph, factor: object, *shaders: bpy.types.Node) -> bpy.types.Node:
    inputs = {0: factor, 1: shaders[0].outputs[0], 2: shaders[1].outputs[0]}
    return graph.node("MixShader", inputs)


def test_weights_are_products_down_the_mixture() -> None:
    graph, output = _graph(probes.scene())
    diffuse = graph.node("BsdfDiffuse", {"Color": (0.7, 0.3, 0.1)})
    glossy = graph.node("BsdfAnisotropic", {"Roughness": 0.3})
    glass = graph.node("BsdfGlass")
    inner = _mixed(graph, 0.25, diffuse, glossy)
    graph.put(output, "Surface", _mixed(graph, 0.4, inner, glass).outputs[0])
    found = _closures()
    assert [item["kind"] for item in found] == ["diffuse", "glossy", "glass"]
    weights = [float(np.nanmean(item["weight"])) for item in found]
    np.testing.assert_allclose(weights, (0.6 * 0.75, 0.6 * 0.25, 0.4), rtol=1e-6)
    np.testing.assert_allclose(np.nanmean(found[0]["inputs"]["color"], (0, 1)), (0.7, 0.3, 0.1))


def _fixed() -> dict[str, str]:
    values, _ = _read()
    return next(item for item in values.owners.values() if item.name == "Shown").fixed


def test_what_turns_the_normal_of_a_mirror_is_not_fitted() -> None:
    graph, output = _graph(probes.scene())
    noise = graph.node("TexNoise", {"Scale": 3.0})
    bump = graph.node("Bump", {"Strength": 0.5, "Height": noise.outputs[0]})
    diffuse = graph.node("BsdfDiffuse", {"Normal": bump.outputs[0]})
    glossy = graph.node("BsdfAnisotropic", {"Roughness": 0.01, "Normal": bump.outputs[0]})
    graph.put(output, "Surface", diffuse.outputs[0])
    assert not {"Bump.Strength", "Noise Texture.Scale", "Diffuse BSDF.Color"} & set(_fixed())
    graph.put(output, "Surface", _mixed(graph, 0.4, diffuse, glossy).outputs[0])
    assert "normal of a mirror" in _fixed()["Bump.Strength"]
    assert "normal of a mirror" in _fixed()["Noise Texture.Scale"]
    assert "Diffuse BSDF.Color" not in _fixed()
    glossy.inputs["Roughness"].default_value = 0.3
    assert "Bump.Strength" not in _fixed()


def test_what_turns_a_tangent_can_be_fitted() -> None:
    graph, output = _graph(probes.scene())
    glossy = graph.node("BsdfAnisotropic", {"Roughness": 0.4, "Anisotropy": 0.5, "Rotation": 0.1})
    graph.put(output, "Surface", glossy.outputs[0])
    assert not {"Glossy BSDF.Rotation", "Glossy BSDF.Anisotropy"} & set(_fixed())
    (found,) = _closures()
    tangent = np.nanmean(np.abs(found["tangent"]), (0, 1))
    assert tangent[2] < 1e-6 < tangent[0]


@pytest.mark.parametrize("source", ["constant", "image", "noise"])
def test_a_computed_roughness_of_diffuse_is_named(source) -> None:
    """Cycles is black where it is hardly above 0: a computed one may be."""
    graph, output = _graph(probes.scene())
    diffuse = graph.node("BsdfDiffuse", {"Roughness": 0.2})
    if source != "constant":
        node = graph.node("TexImage" if source == "image" else "TexNoise")
        if source == "image":
            node.image = bpy.data.images.new("Rough", 4, 4)
        graph.put(diffuse, "Roughness", node.outputs[0])
    graph.put(output, "Surface", diffuse.outputs[0])
    warnings = made.read().warnings
    assert any("Cycles shows black" in text for text in warnings) is (source == "noise")


def test_cycles_is_black_where_the_roughness_of_diffuse_is_hardly_above_0(tmp_path) -> None:
    """What that warning is for."""
    graph, output = _graph(probes.scene())
    diffuse = graph.node("BsdfDiffuse")
    graph.put(output, "Surface", diffuse.outputs[0])
    made.world()
    light = []
    for roughness in (0, 1e-7, 2e-7):
        diffuse.inputs["Roughness"].default_value = roughness
        picture = render(bpy.context.scene, "Camera", (8, 8), 4, 1, tmp_path / "x.exr")
        light.append(float(picture[3:5, 3:5].mean()))
    assert light[0] > 0.1 and light[1] == 0 and light[2] == pytest.approx(light[0], rel=0.01)


def test_one_shader_on_two_ways_counts_once() -> None:
    graph, output = _graph(probes.scene())
    diffuse, clear = graph.node("BsdfDiffuse"), graph.node("BsdfTransparent")
    both = graph.node("AddShader", {0: _mixed(graph, 0.3, diffuse, clear).outputs[0]})
    graph.put(both, 1, diffuse.outputs[0])
    graph.put(output, "Surface", both.outputs[0])
    found = {item["kind"]: float(np.nanmean(item["weight"])) for item in _closures()}
    assert found.keys() == {"diffuse", "transparent"}
    np.testing.assert_allclose(found["diffuse"], 1.7, rtol=1e-6)
    np.testing.assert_allclose(found["transparent"], 0.3, rtol=1e-6)


def test_factors_are_cut_off_and_an_unlinked_side_is_black() -> None:
    graph, output = _graph(probes.scene())
    large = graph.node("Math", {0: 1.5, 1: 0.2}, operation="ADD").outputs[0]
    mixed = graph.node("MixShader", {0: large, 2: graph.node("BsdfDiffuse").outputs[0]})
    graph.put(output, "Surface", mixed.outputs[0])
    (found,) = _closures()
    np.testing.assert_allclose(np.nanmean(found["weight"]), 1)


def test_groups_and_muted_nodes_are_entered() -> None:
    graph, output = _graph(probes.scene())
    tree = bpy.data.node_groups.new("Inside", "ShaderNodeTree")
    tree.interface.new_socket("Share", in_out="INPUT", socket_type="NodeSocketFloat")
    tree.interface.new_socket("Result", in_out="OUTPUT", socket_type="NodeSocketShader")
    inside = Graph(tree)
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    mixed = _mixed(
        inside, start.outputs[0], inside.node("BsdfDiffuse"), inside.node("BsdfTranslucent")
    )
    tree.links.new(mixed.outputs[0], end.inputs[0])
    group = graph.node("Group")
    group.node_tree = tree
    share = graph.node("Value")
    share.outputs[0].default_value = 0.6
    muted = graph.node("Math", {0: share.outputs[0], 1: 5.0}, operation="MULTIPLY")
    muted.mute = True
    graph.put(group, 0, muted.outputs[0])
    graph.put(output, "Surface", group.outputs[0])
    found = {item["kind"]: float(np.nanmean(item["weight"])) for item in _closures()}
    np.testing.assert_allclose(found["translucent"], 0.6, rtol=1e-6)
    _, material = _read()
    assert material.shader is not None
    names = [item.parameter.name for item in material.shader.constants]
    assert "Group/Diffuse BSDF.Color" in names
    assert "Value.Value" in names


def test_a_lone_principled_bsdf_stays_as_it_is() -> None:
    graph, output = _graph(probes.scene())
    principled = graph.node("BsdfPrincipled", {"Roughness": 0.3})
    graph.put(output, "Surface", principled.outputs[0])
    _, material = _read()
    assert material.shader is None
    graph.put(principled, "Roughness", graph.node("Math", {0: 0.2, 1: 0.1}).outputs[0])
    _, material = _read()
    assert material.shader is not None
    (found,) = _closures()
    np.testing.assert_allclose(np.nanmean(found["inputs"]["roughness"]), 0.3, rtol=1e-6)


def test_all_that_is_not_read_is_told_at_once() -> None:
    graph, output = _graph(probes.scene())
    toon, hair = graph.node("BsdfToon"), graph.node("BsdfHair")
    ashikhmin = graph.node("BsdfSheen", distribution="ASHIKHMIN")
    sky = graph.node("AmbientOcclusion")
    graph.put(ashikhmin, "Color", sky.outputs[0])
    inner = _mixed(graph, 0.5, toon, hair)
    graph.put(output, "Surface", _mixed(graph, 0.5, inner, ashikhmin).outputs[0])
    values, _ = _read()
    causes = sorted(item.cause for item in values.problems if item.object == "Material 'Shown'")
    assert causes == [
        "node 'Ambient Occlusion' (Ambient Occlusion) cannot be evaluated",
        "node 'Hair BSDF' (Hair BSDF) is a shader that is not modelled",
        "node 'Sheen BSDF' (Sheen BSDF) has the distribution ASHIKHMIN",
        "node 'Toon BSDF' (Toon BSDF) is a shader that is not modelled",
    ]
    assert all(item.cure for item in values.problems)


def test_constants_are_parameters_and_are_written_back() -> None:
    graph, output = _graph(probes.scene())
    glossy = graph.node("BsdfAnisotropic", {"Roughness": 0.3, "Color": (0.2, 0.3, 0.4)})
    mixed = _mixed(graph, 0.25, graph.node("BsdfDiffuse"), glossy)
    graph.put(output, "Surface", mixed.outputs[0])
    values, material = _read()
    owner = values.owners["Shown"]
    assert owner.values["Glossy BSDF.Roughness"] == (np.float32(0.3),)
    assert owner.parameters["Glossy BSDF.Roughness"].scale == "roughness"
    assert owner.parameters["Mix Shader.Fac"].fit_upper == 1
    assert "Glossy BSDF.Roughness" not in owner.fixed
    native = build.build(values)
    changed = native.with_values({("Shown", "Glossy BSDF.Roughness"): [0.5]})
    np.testing.assert_allclose(changed.get("Shown", "Glossy BSDF.Roughness"), 0.5)
    new = {
        ("Shown", "Glossy BSDF.Roughness"): (0.45,),
        ("Shown", "Glossy BSDF.Color"): (0.5, 0.6, 0.7),
        ("Shown", "Mix Shader.Fac"): (0.75,),
    }
    before = write_back.write(bpy.context.scene, values.owners, new)
    np.testing.assert_allclose(before["Shown", "Glossy BSDF.Color"], (0.2, 0.3, 0.4), rtol=1e-6)
    np.testing.assert_allclose(glossy.inputs["Roughness"].default_value, 0.45, rtol=1e-6)
    np.testing.assert_allclose(mixed.inputs[0].default_value, 0.75, rtol=1e-6)
    assert material.shader is not None
