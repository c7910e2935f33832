# SPDX-License-Identifier: GPL-3.0-or-later
"""Node groups whose sockets convert what passes, and outputs to link to them."""

import bpy
from made_images import image
from strips import texture

#: Other whole numbers by luminance, by mean and by channel.
VALUES = {
    "Float": 2.7,
    "Int": 3,
    "Bool": True,
    "Vector": (3.9, 0.4, 1.1),
    "Color": (3.9, 0.4, 1.1, 1.0),
}


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
