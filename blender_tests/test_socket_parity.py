# SPDX-License-Identifier: GPL-3.0-or-later
"""What becomes of values on their way through sockets of other types, against Cycles.

Each socket of a group takes a value for its own type: the luminance of a colour, the mean of a
vector, whole numbers cut off towards 0. Rows as in test_texture_parity.
"""

import made_scenes as made
import pytest
from made_images import image
from node_groups import VALUES, group, shown, source, through
from strips import assert_equals_cycles, render_strips, shine, texture

pytestmark = [pytest.mark.blender, pytest.mark.blender34]

KINDS = ("Float", "Int", "Bool", "Vector", "Color")
VARYING = ("Float", "Vector", "Color")
TARGETS = ("emission_color", "emission_strength")
CASES = {}


def case(*arguments):
    """Registers a function (material, folder, *arguments) that makes the strip's material."""

    def register(function):
        for item in arguments or ((),):
            label = "-".join([function.__name__, *map(str, item)])
            CASES[label] = (function, item)
        return function

    return register


@case(*[(a, b, to) for a in KINDS for b in KINDS for to in TARGETS])
def value_on_an_input(material, folder, before, after, target):
    shine(material, through(material.node_tree, None, before, after), target)


@case(*[(a, b, c, to) for a in ("RGB", "Value") for b in KINDS for c in KINDS for to in TARGETS])
def constant_node(material, folder, kind, before, after, target):
    shine(
        material,
        through(material.node_tree, source(material, folder, kind), before, after),
        target,
    )


@case(
    *[
        (a, b, c, to)
        for a in ("Color", "Alpha", "attribute", "vector")
        for b in VARYING
        for c in VARYING
        for to in TARGETS
    ]
)
def varying(material, folder, kind, before, after, target):
    shine(
        material,
        through(material.node_tree, source(material, folder, kind), before, after),
        target,
    )


@case(
    *[
        (space, alpha, way, kind)
        for space in ("sRGB", "Linear")
        for alpha in ("alone", "linked")
        for way in ("Linear", "Closest", "Cubic")
        for kind in ("Color", "Vector")
        if space == "Linear" or way == "Closest"
    ]
)
def grey_image(material, folder, space, alpha, way, kind):
    """A colour, then one number. With its Alpha linked an image is divided by it first."""
    made_of = "generated8" if space == "sRGB" else "generated32"
    node = texture(material, image(folder, made_of, space), interpolation=way)
    tree = material.node_tree
    shine(material, through(tree, node.outputs["Color"], kind, "Float"))
    if alpha == "linked":
        shine(material, node.outputs["Alpha"], "emission_strength")


@case(
    ("RGB", "Color", "Vector", "Float", "Vector", "emission_color"),
    ("RGB", "Vector", "Vector", "Int", "Color", "emission_color"),
    ("Color", "Color", "Vector", "Float", "Vector", "emission_color"),
    ("Color", "Vector", "Color", "Vector", "Vector", "emission_strength"),
)
def several_groups(material, folder, kind, a, b, c, d, target):
    output = source(material, folder, kind)
    shine(material, through(material.node_tree, output, a, b, c, d), target)


@case(("Float", "Vector"), ("Vector", "Color"), ("Int", "Color"), ("Bool", "Float"))
def nested(material, folder, outer, inner):
    """A value that an input of a group inside a group holds, out by the outer one."""
    tree, _, leave = group([], [outer], "Outer")
    tree.links.new(through(tree, None, inner, outer), leave.inputs[0])
    shine(material, shown(material.node_tree, tree).outputs[0])


@case(*[(kind,) for kind in KINDS])
def value_on_an_output(material, folder, kind):
    """Nothing is linked to the Group Output inside."""
    tree, _, leave = group([], [kind])
    leave.inputs[0].default_value = VALUES[kind]
    shine(material, shown(material.node_tree, tree).outputs[0])


@case(("emission_color",), ("emission_strength",))
def group_without_an_output(material, folder, target):
    tree, _, leave = group([], ["Color"])
    node = shown(material.node_tree, tree)
    leave.inputs[0].default_value = VALUES["Color"]
    shine(material, node.outputs[0], target)
    tree.nodes.remove(leave)


@case(("emission_color",), ("emission_strength",))
def reroute_of_nothing(material, folder, target):
    shine(material, material.node_tree.nodes.new("NodeReroute").outputs[0], target)


@case(*[(kind, to) for kind in ("RGB", "Value", "Color") for to in TARGETS])
def reroutes(material, folder, kind, target):
    output = source(material, folder, kind)
    for _ in range(2):
        node = material.node_tree.nodes.new("NodeReroute")
        material.node_tree.links.new(output, node.inputs[0])
        output = node.outputs[0]
    shine(material, output, target)


@case(*[(kind, to) for kind in ("RGB", "Value", "Color", "vector") for to in TARGETS])
def muted_node(material, folder, kind, target):
    """A muted node hands its first input of the output's type on."""
    node = material.node_tree.nodes.new("ShaderNodeInvert")
    node.mute = True
    node.inputs["Color"].default_value = (0.7, 0.2, 0.1, 1.0)
    output = source(material, folder, kind)
    material.node_tree.links.new(output, node.inputs["Color"])
    shine(material, node.outputs[0], target)


@case(*[(node,) for node in ("ShaderNodeInvert", "ShaderNodeMath", "ShaderNodeMapping")])
def muted_node_of_nothing(material, folder, kind):
    node = material.node_tree.nodes.new(kind)
    node.mute = True
    shine(material, node.outputs[0])


@case(("ShaderNodeVectorMath",), ("ShaderNodeSeparateXYZ",), ("ShaderNodeRGBToBW",))
def muted_node_of_two_types(material, folder, kind):
    node = material.node_tree.nodes.new(kind)
    node.mute = True
    material.node_tree.links.new(source(material, folder, "RGB"), node.inputs[0])
    end = node.outputs["Value"] if "Value" in node.outputs else node.outputs[0]
    shine(material, end)


@case(("RGB",), ("Value",), ("TexImage",), ("VertexColor",))
def muted_node_without_an_input(material, folder, kind):
    """The socket behind it then keeps its own value."""
    node = material.node_tree.nodes.new(f"ShaderNode{kind}")
    node.mute = True
    made.socket(material, "emission_color").default_value = (0.3, 0.6, 0.1, 1.0)
    shine(material, node.outputs[0])


@case(("Color", "Color"), ("Float", "Color"), ("Color", "Float"))
def muted_group(material, folder, before, after):
    inner, entry, leave = group([before], [after])
    leave.inputs[0].default_value = VALUES[after]
    node = shown(material.node_tree, inner)
    node.mute = True
    material.node_tree.links.new(source(material, folder, "RGB"), node.inputs[0])
    shine(material, node.outputs[0])


@case(())
def muted_link(material, folder):
    made.socket(material, "emission_color").default_value = (0.3, 0.6, 0.1, 1.0)
    shine(material, source(material, folder, "RGB"))
    made.socket(material, "emission_color").links[0].is_muted = True


@case(())
def muted_link_inside(material, folder):
    inner, entry, leave = group(["Color"], ["Color"])
    leave.inputs[0].default_value = (0.3, 0.6, 0.1, 1.0)
    inner.links.new(entry.outputs[0], leave.inputs[0]).is_muted = True
    node = shown(material.node_tree, inner)
    node.inputs[0].default_value = VALUES["Color"]
    shine(material, node.outputs[0])


@case(("Vector",), ("Color",), ("Float",))
def place_of_an_image_on_an_input(material, folder, kind):
    """An input of a group that nothing is linked to does not place an image."""
    inner, entry, leave = group([kind], ["Color"])
    node = inner.nodes.new("ShaderNodeTexImage")
    node.image = image(folder)
    inner.links.new(entry.outputs[0], node.inputs["Vector"])
    inner.links.new(node.outputs["Color"], leave.inputs[0])
    outer = shown(material.node_tree, inner)
    outer.inputs[0].default_value = VALUES[kind]
    shine(material, outer.outputs[0])


@case(("Color",), ("Vector",))
def place_of_an_image_through(material, folder, kind):
    tree = material.node_tree
    node = texture(material, image(folder))
    where = tree.nodes.new("ShaderNodeUVMap").outputs[0]
    tree.links.new(through(tree, where, "Vector", kind), node.inputs["Vector"])
    shine(material, node.outputs["Color"])


@case(("muted",), ("muted without a vector",))
def place_of_an_image_by_a_muted_mapping(material, folder, state):
    tree = material.node_tree
    node, mapping = texture(material, image(folder)), tree.nodes.new("ShaderNodeMapping")
    mapping.inputs["Location"].default_value = (0.3, 0.2, 0.1)
    mapping.inputs["Vector"].default_value = (0.3, 0.2, 0.1)
    mapping.mute = True
    if state == "muted":
        tree.links.new(tree.nodes.new("ShaderNodeUVMap").outputs[0], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], node.inputs["Vector"])
    shine(material, node.outputs["Color"])


@pytest.fixture(scope="module")
def pictures(native, tmp_path_factory):
    """Label of a case -> (ours, Cycles'), or why there is none."""
    return render_strips(native, tmp_path_factory.mktemp("sockets"), CASES)


@pytest.mark.without_scene
@pytest.mark.parametrize("label", CASES)
def test_equals_cycles(pictures, label):
    assert_equals_cycles(pictures[label])
