# SPDX-License-Identifier: GPL-3.0-or-later
"""What becomes of values on their way through sockets of other types, against Cycles.

Each socket of a group takes a value for its own type: the luminance of a colour, the mean of a
vector, whole numbers cut off towards 0. Rows as in test_texture_parity.
"""

import bpy
import made_scenes as made
import numpy as np
import pytest
from made_images import image
from strips import render_strips, shine, texture

from selenite import write_back
from selenite.problems import BadInput
from selenite.scene_read import hosts, nodes

pytestmark = [pytest.mark.blender, pytest.mark.blender34]

KINDS = ("Float", "Int", "Bool", "Vector", "Color")
VARYING = ("Float", "Vector", "Color")
TARGETS = ("emission_color", "emission_strength")
#: Other whole numbers by luminance, by mean and by channel.
VALUES = {
    "Float": 2.7,
    "Int": 3,
    "Bool": True,
    "Vector": (3.9, 0.4, 1.1),
    "Color": (3.9, 0.4, 1.1, 1.0),
}
CASES = {}


def case(*arguments):
    """Registers a function (material, folder, *arguments) that makes the strip's material."""

    def register(function):
        for item in arguments or ((),):
            label = "-".join([function.__name__, *map(str, item)])
            CASES[label] = (function, item)
        return function

    return register


def group(ins, outs, name="Pass"):
    """A node group with sockets of some types, its Group Input and its Group Output."""
    tree = bpy.data.node_groups.new(name, "ShaderNodeTree")
    for way, kinds in (("INPUT", ins), ("OUTPUT", outs)):
        for number, kind in enumerate(kinds):
            socket = f"NodeSocket{kind}"
            if hasattr(tree, "interface"):
                tree.interface.new_socket(f"{kind} {number}", in_out=way, socket_type=socket)
            else:
                sockets = tree.inputs if way == "INPUT" else tree.outputs
                sockets.new(socket, f"{kind} {number}")
    return tree, tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")


def shown(tree, group_tree):
    """A node of a group."""
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group_tree
    return node


def through(tree, output, *kinds):
    """The output behind groups that pass on what comes from `output`: each has an input of one
    type, an output of the next. None: nothing is linked."""
    for before, after in zip(kinds[::2], kinds[1::2], strict=True):
        inner, entry, leave = group([before], [after])
        inner.links.new(entry.outputs[0], leave.inputs[0])
        node = shown(tree, inner)
        if output is not None:
            tree.links.new(output, node.inputs[0])
        else:
            node.inputs[0].default_value = VALUES[before]
        output = node.outputs[0]
    return output


def source(material, folder, kind):
    """An output with a value that no type leaves as it is."""
    tree = material.node_tree
    if kind in {"RGB", "Value"}:
        output = tree.nodes.new(f"ShaderNode{kind}").outputs[0]
        output.default_value = VALUES["Color" if kind == "RGB" else "Float"]
        return output
    if kind == "attribute":
        node = tree.nodes.new("ShaderNodeVertexColor")
        node.layer_name = "FloatPoint"
        return node.outputs["Color"]
    if kind == "vector":
        node = tree.nodes.new("ShaderNodeAttribute")
        node.attribute_name = "FloatCorner"
        return node.outputs["Vector"]
    # A smoothed image with code values cannot be made grey, see below.
    return texture(material, image(folder), interpolation="Closest").outputs[kind]


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


@pytest.mark.parametrize("label", CASES)
def test_equals_cycles(pictures, label):
    result = pictures[label]
    if isinstance(result, str):
        pytest.skip(result)
    ours, cycles = result
    np.testing.assert_allclose(ours, cycles, rtol=1e-4, atol=2e-5)


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


@pytest.mark.parametrize("kind", ["Int", "Bool"])
@pytest.mark.parametrize("output", ["Color", "Alpha", "attribute"])
def test_what_varies_and_is_cut_to_whole_numbers_is_refused_by_name(tmp_path, kind, output):
    if kind == "Bool" and not hosts.cycles_has_booleans():
        pytest.skip("Blender 3 passes over links from booleans")
    material = made.studio()
    end = through(material.node_tree, source(material, tmp_path, output), kind, "Color")
    shine(material, end, "base_color")
    (problem,) = made.read().problems
    assert problem.object == "Material 'Body'" and "Base Color" in problem.cause
    assert kind in problem.cause and problem.cure


@pytest.mark.parametrize("way", ["Linear", "Cubic"])
def test_a_smoothed_image_with_code_values_that_becomes_grey_is_refused_by_name(tmp_path, way):
    """Cycles makes it grey after it has decoded what lies between texels."""
    material = made.studio()
    node = texture(material, image(tmp_path), interpolation=way)
    shine(
        material, through(material.node_tree, node.outputs["Color"], "Float", "Color"), "base_color"
    )
    (problem,) = made.read().problems
    assert problem.object == "Material 'Body'" and "Base Color" in problem.cause
    assert "Float" in problem.cause and "Closest" in problem.cure
    shine(material, node.outputs["Color"], "roughness")  # the parameter's own socket may
    shine(
        material,
        through(material.node_tree, node.outputs["Color"], "Vector", "Color"),
        "base_color",
    )
    assert not made.read().problems


@pytest.mark.parametrize("kind", ["Float", "Int"])
def test_an_image_that_is_placed_through_a_number_is_refused_by_name(tmp_path, kind):
    material = made.studio()
    tree, node = material.node_tree, texture(material, image(tmp_path))
    where = tree.nodes.new("ShaderNodeUVMap").outputs[0]
    tree.links.new(through(tree, where, kind, "Vector"), node.inputs["Vector"])
    shine(material, node.outputs["Color"], "base_color")
    (problem,) = made.read().problems
    assert "UV Map" in problem.cause and kind in problem.cause


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
