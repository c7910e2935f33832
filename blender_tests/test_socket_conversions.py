# SPDX-License-Identifier: GPL-3.0-or-later
"""Conversions at sockets without a render: numbers on paper, what is refused, what is written."""

import bpy
import made_scenes as made
import pytest
from made_images import image
from node_groups import group, shown, source, through
from strips import shine, texture

from selenite import write_back
from selenite.problems import BadInput
from selenite.scene_read import hosts
from selenite.scene_read.shading import nodes

pytestmark = [pytest.mark.blender, pytest.mark.blender34]


@pytest.mark.parametrize(
    ("value", "kinds", "expected"),
    [
        (-2.7, ("Float", "Int"), (-2.0,)),
        ((-3.0, 1.0, -1.0), ("Vector", "Float"), (-1.0,)),
        ((0.25, 0.5, 0.75), ("Vector", "Int"), (0.0,)),
        ((1.0, 0.0, 0.0, 1.0), ("Color", "Float"), (0.2126729,)),
        ((0.0, 0.0, 1.0, 1.0), ("Color", "Float"), (0.0721750,)),
    ],
)
def test_numbers_of_a_conversion(value, kinds, expected):
    """Cycles' rules on paper, for values that a colour of light cannot have."""
    material = made.studio()
    output = through(material.node_tree, None, *kinds)
    output.node.inputs[0].default_value = value
    shine(material, output, "emission_strength")
    found = nodes.constant(nodes.source_of(made.socket(material, "emission_strength")))
    assert found == pytest.approx(expected, rel=1e-6)


def _operations():
    """Of the program that the material has become."""
    values = made.read()
    assert not values.problems
    (material,) = (item for item in values.materials if item.name == "Body")
    return [code.op for code in material.shader.code]


@pytest.mark.parametrize("kind", ["Int", "Bool"])
@pytest.mark.parametrize("output", ["Color", "Alpha", "attribute"])
def test_what_varies_and_is_cut_to_whole_numbers_is_computed(tmp_path, kind, output):
    if kind == "Bool" and not hosts.cycles_has_booleans():
        pytest.skip("Blender 3 passes over links from booleans")
    material = made.studio()
    end = through(material.node_tree, source(material, tmp_path, output), kind, "Color")
    shine(material, end, "base_color")
    assert "truncate" in _operations()


@pytest.mark.parametrize("way", ["Linear", "Cubic"])
def test_a_smoothed_image_with_code_values_that_becomes_grey_is_computed(tmp_path, way):
    """Cycles makes it grey after it has decoded what lies between texels."""
    material = made.studio()
    node = texture(material, image(tmp_path), interpolation=way)
    shine(
        material, through(material.node_tree, node.outputs["Color"], "Float", "Color"), "base_color"
    )
    assert _operations() == ["attribute", "image", "luminance"]
    shine(material, node.outputs["Color"], "roughness")  # the parameter's own socket may
    shine(
        material,
        through(material.node_tree, node.outputs["Color"], "Vector", "Color"),
        "base_color",
    )
    assert not made.read().problems


@pytest.mark.parametrize("kind", ["Float", "Int"])
def test_an_image_that_is_placed_through_a_number_is_computed(tmp_path, kind):
    material = made.studio()
    tree, node = material.node_tree, texture(material, image(tmp_path))
    where = tree.nodes.new("ShaderNodeUVMap").outputs[0]
    tree.links.new(through(tree, where, kind, "Vector"), node.inputs["Vector"])
    shine(material, node.outputs["Color"], "base_color")
    cut = ["truncate"] if kind == "Int" else []
    assert _operations() == ["attribute", "mean", *cut, "image"]


@pytest.mark.parametrize(
    ("kinds", "target", "is_fixed"),
    [
        (("Color", "Color"), "base_color", False),
        (("Vector", "Color"), "base_color", False),
        (("Float", "Color"), "base_color", True),
        (("Color", "Float"), "base_color", True),
        (("Float", "Float"), "roughness", False),
        (("Int", "Float"), "roughness", True),
        (("Color", "Color"), "roughness", True),
    ],
)
def test_a_value_is_written_back_where_no_socket_converts_it(kinds, target, is_fixed):
    material = made.studio()
    shine(material, through(material.node_tree, None, *kinds), target)
    owner = made.read().owners["Body"]
    assert (target in owner.fixed) == is_fixed
    value = (0.25, 0.5, 0.75) if target == "base_color" else (0.625,)
    if is_fixed:
        with pytest.raises(BadInput) as error:
            write_back.write(bpy.context.scene, {"Body": owner}, {("Body", target): value})
        assert "socket" in str(error.value)
    else:
        write_back.write(bpy.context.scene, {"Body": owner}, {("Body", target): value})
        assert made.read().owners["Body"].values[target] == value


def test_a_group_with_a_fake_user_can_be_written_and_a_shared_one_cannot():
    material = made.studio()
    output = through(material.node_tree, None, "Float", "Float")
    tree = output.node.node_tree
    inner, entry, leave = group([], ["Float"])
    inner.links.new(through(inner, None, "Float", "Float"), leave.inputs[0])
    shine(material, shown(material.node_tree, inner).outputs[0], "roughness")
    inner.use_fake_user = tree.use_fake_user = True
    assert "roughness" not in made.read().owners["Body"].fixed
    shown(material.node_tree, inner)
    assert "2 users" in made.read().owners["Body"].fixed["roughness"]
