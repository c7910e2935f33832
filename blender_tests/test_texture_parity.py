# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures and colour attributes against Cycles, texel by texel and without noise.

Every case is a row of a picture: a strip of quads, one per pixel, that shine. All corners of a quad
have the same coordinates (and colours), so that a pixel is one look-up, whoever takes it and
wherever in the pixel. Cycles renders all rows at once, and so do we.
"""

import bpy
import made_scenes as made
import numpy as np
import pytest
from made_images import image
from strips import (
    COLOURS,
    NotHere,
    assert_equals_cycles,
    render_both,
    render_strips,
    shine,
    shining,
    texture,
)

pytestmark = [pytest.mark.blender, pytest.mark.blender34]

KINDS = [f"{where}{bits}" for where in ("file", "packed") for bits in (8, 16, 32)]
KINDS += ["generated8", "generated32"]
CASES = {}


def case(*arguments):
    """Registers a function (material, folder, *arguments) that makes the strip's material.

    It may return what is to be done to the strip's mesh.
    """

    def register(function):
        for item in arguments or ((),):
            item = item if isinstance(item, tuple) else (item,)
            label = "-".join([function.__name__, *(str(part) for part in item)])
            CASES[label] = (function, item)
        return function

    return register


@case("Linear", "Closest", "Cubic", "Smart")
def interpolation(material, folder, way):
    shine(material, texture(material, image(folder), interpolation=way).outputs["Color"])


@case(
    *[
        (rule, way)
        for rule in ("REPEAT", "EXTEND", "CLIP", "MIRROR")
        for way in ("Linear", "Closest", "Cubic")
    ]
)
def extension(material, folder, rule, way):
    node = texture(material, image(folder, "generated32", "Linear", alpha=False))
    node.interpolation = way
    try:
        node.extension = rule
    except TypeError as error:
        raise NotHere("MIRROR came with Blender 3.5") from error
    shine(material, node.outputs["Color"])


@case(
    *[(kind, space) for kind in KINDS for space in ("sRGB", "Non-Color", "Linear")],
)
def colour_space(material, folder, kind, space):
    found = image(folder, kind, space, alpha=False)
    shine(material, texture(material, found).outputs["Color"])


@case(
    *[
        (kind, space, mode, linked)
        for kind in KINDS
        for space in ("sRGB", "Non-Color", "Linear")
        for mode in ("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE")
        for linked in ("alone", "linked")
        # Cycles disregards the mode of these, and we refuse them
        if space == "Non-Color"
        or (kind, mode) not in {("file8", "PREMUL"), ("file16", "PREMUL"), ("file32", "STRAIGHT")}
    ]
)
def alpha(material, folder, kind, space, mode, linked):
    if bpy.app.version < (4, 0, 0) and (kind, space, mode) == ("file32", "sRGB", "PREMUL"):
        raise NotHere("refused in Blender 3")
    node = texture(material, image(folder, kind, space, mode))
    shine(material, node.outputs["Color"])
    if linked == "linked":
        shine(material, node.outputs["Alpha"], "emission_strength")


@case("CLIP", "REPEAT")
def opaque_with_alpha_linked(material, folder, rule):
    node = texture(material, image(folder, alpha=False), extension=rule)
    shine(material, node.outputs["Color"])
    shine(material, node.outputs["Alpha"], "emission_strength")


@case("emission_strength", "alpha")
def number_from_colour(material, folder, parameter):
    shine(material, texture(material, image(folder)).outputs["Color"], parameter)


@case()
def colour_from_alpha(material, folder):
    shine(material, texture(material, image(folder)).outputs["Alpha"])


@case("alpha")
def cut_out(material, folder, parameter):
    node = texture(material, image(folder))
    shine(material, node.outputs["Color"])
    shine(material, node.outputs["Alpha"], parameter)


def mapping(material, kind, vector, location=(0, 0, 0), rotation=(0, 0, 0), scale=(1, 1, 1)):
    """A Mapping node behind the output `vector`."""
    node = material.node_tree.nodes.new("ShaderNodeMapping")
    node.vector_type = kind
    if vector is not None:
        material.node_tree.links.new(vector, node.inputs["Vector"])
    node.inputs["Rotation"].default_value = rotation
    node.inputs["Scale"].default_value = scale
    if kind in {"POINT", "TEXTURE"}:
        node.inputs["Location"].default_value = location
    return node.outputs["Vector"]


def placed(material, folder, vector):
    """A texture that is looked up at an output."""
    node = texture(material, image(folder, "generated32", "Linear", alpha=False))
    material.node_tree.links.new(vector, node.inputs["Vector"])
    shine(material, node.outputs["Color"])


def coordinates(material, output="UV"):
    """An output of a Texture Coordinate node."""
    return material.node_tree.nodes.new("ShaderNodeTexCoord").outputs[output]


@case("POINT", "TEXTURE", "VECTOR")
def one_mapping(material, folder, kind):
    placed(
        material,
        folder,
        mapping(
            material, kind, coordinates(material), (0.3, -0.2, 0.5), (0.4, -0.7, 1.1), (2, -3, 0.5)
        ),
    )


@case()
def mapping_of_mapping(material, folder):
    first = mapping(material, "TEXTURE", coordinates(material), (1, 2, 3), (0.1, 0.2, 0.3))
    placed(material, folder, mapping(material, "POINT", first, (0.1, 0, 0), (1, 2, 3), (1, 2, 3)))


@case("POINT", "TEXTURE")
def mapping_with_scale_0(material, folder, kind):
    vector = mapping(material, kind, coordinates(material), (0.3, 0.6, 0), scale=(0, 2, 1))
    placed(material, folder, vector)


@case()
def mapping_of_nothing(material, folder):
    placed(material, folder, mapping(material, "POINT", None, (0.3, 0.6, 0)))


@case()
def texture_coordinate(material, folder):
    placed(material, folder, coordinates(material))


@case("UVMap", "Second", "")
def uv_map(material, folder, name):
    node = material.node_tree.nodes.new("ShaderNodeUVMap")
    node.uv_map = name
    placed(material, folder, node.outputs["UV"])


@case()
def uv_map_by_attribute(material, folder):
    node = material.node_tree.nodes.new("ShaderNodeAttribute")
    node.attribute_name = "Second"
    placed(material, folder, node.outputs["Vector"])


@case()
def uv_map_that_is_missing(material, folder):
    node = material.node_tree.nodes.new("ShaderNodeUVMap")
    node.uv_map = "Nowhere"
    placed(material, folder, node.outputs["UV"])


@case()
def second_uv_map_renders(material, folder):
    placed(material, folder, coordinates(material))
    return lambda mesh: setattr(mesh.uv_layers["Second"], "active_render", True)


@case(*[name for name, _, _ in COLOURS], "Nowhere", "")
def colour_attribute(material, folder, name):
    node = material.node_tree.nodes.new("ShaderNodeVertexColor")
    node.layer_name = name
    shine(material, node.outputs["Color"])


@case(*[name for name, _, _ in COLOURS])
def colour_attribute_by_name(material, folder, name):
    node = material.node_tree.nodes.new("ShaderNodeAttribute")
    node.attribute_name = name
    shine(material, node.outputs["Color"])


@case()
def number_from_colour_attribute(material, folder):
    node = material.node_tree.nodes.new("ShaderNodeVertexColor")
    node.layer_name = "FloatPoint"
    shine(material, node.outputs["Color"], "emission_strength")


@case()
def third_colour_attribute_renders(material, folder):
    node = material.node_tree.nodes.new("ShaderNodeVertexColor")
    shine(material, node.outputs["Color"])
    return lambda mesh: setattr(mesh.color_attributes, "render_color_index", 2)


@case("RGB", "Value")
def constant(material, folder, kind):
    node = material.node_tree.nodes.new(f"ShaderNode{kind}")
    node.outputs[0].default_value = (0.2, 0.5, 0.7, 1) if kind == "RGB" else 0.6
    shine(material, node.outputs[0], "emission_strength" if kind == "RGB" else "emission_color")


@case()
def grouped(material, folder):
    """A texture inside a group, looked up where an input of the group says, behind reroutes."""
    tree = bpy.data.node_groups.new("Picture", "ShaderNodeTree")
    if hasattr(tree, "interface"):
        tree.interface.new_socket("Where", in_out="INPUT", socket_type="NodeSocketVector")
        tree.interface.new_socket("What", in_out="OUTPUT", socket_type="NodeSocketColor")
    else:
        tree.inputs.new("NodeSocketVector", "Where")
        tree.outputs.new("NodeSocketColor", "What")
    entry, leave = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    inner = tree.nodes.new("ShaderNodeTexImage")
    inner.image = image(folder)
    tree.links.new(entry.outputs[0], inner.inputs["Vector"])
    tree.links.new(inner.outputs["Color"], leave.inputs[0])
    outer = material.node_tree
    node, reroute = outer.nodes.new("ShaderNodeGroup"), outer.nodes.new("NodeReroute")
    node.node_tree = tree
    outer.links.new(mapping(material, "POINT", coordinates(material), (0.2, 0, 0)), node.inputs[0])
    outer.links.new(node.outputs[0], reroute.inputs[0])
    shine(material, reroute.outputs[0])


@pytest.fixture(scope="module")
def pictures(native, tmp_path_factory):
    """Label of a case -> (ours, Cycles'), (COUNT, 3) each, or why there is none."""
    return render_strips(native, tmp_path_factory.mktemp("textures"), CASES)


@pytest.mark.without_scene
@pytest.mark.parametrize("label", CASES)
def test_equals_cycles(pictures, label):
    assert_equals_cycles(pictures[label])


@pytest.mark.parametrize("name", [None, *[name for name, _, _ in COLOURS]])
def test_what_varies_over_a_face_equals_cycles(native, tmp_path, name):
    """UVs and colours between corners; three standard errors of a pixel's mean are below 0.01."""
    material = shining("Body")
    random = np.random.default_rng(3)
    mesh = bpy.data.meshes.new("Body")
    mesh.from_pydata([(0, 0, 0), (8, 1, 0), (7, 8, 0), (0, 6, 0)], [], [(0, 1, 2, 3)])
    mesh.uv_layers.new(name="UVMap").data.foreach_set("uv", random.uniform(0, 1, 8))
    if name is None:
        shine(material, texture(material, image(tmp_path)).outputs["Color"])
    else:
        attribute = mesh.color_attributes.new(*next(row for row in COLOURS if row[0] == name))
        attribute.data.foreach_set("color", random.uniform(0, 1, 16))
        colour_attribute(material, tmp_path, name)
    mesh.materials.append(material)
    made.add("Body", mesh)
    ours, cycles = render_both(native, tmp_path, (8, 8), 1024)
    inside = np.s_[3:6, 2:6]
    np.testing.assert_allclose(ours[inside], cycles[inside], rtol=0, atol=0.01)
