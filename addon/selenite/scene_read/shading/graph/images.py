# SPDX-License-Identifier: GPL-3.0-or-later
"""Image Texture, by every projection."""

from __future__ import annotations

import bpy

from ...shaders import Register
from ..nodes import Groups
from .tree import Tree, maker

Node = bpy.types.Node
Socket = bpy.types.NodeSocket


@maker("TexImage")
def _image(tree: Tree, node: Node, output: Socket, groups: Groups) -> Register:
    assert isinstance(node, bpy.types.ShaderNodeTexImage)  # noqa: S101 - registered for it alone
    texture = tree.room.texture_of(node, tree.title, wants_alpha=output.identifier == "Alpha")
    if node.projection == "FLAT" and not tree.is_linked(node, "Vector", groups):
        place = tree.ask("attribute", "uv", tree.shader.name(""))
    else:
        place = tree.place(node, groups)
    item = tree.shader.texture(texture)
    if node.projection != "BOX":
        return tree.emit("image", place, mode=node.projection, item=item)
    blend = tree.shader.literal(node.projection_blend)
    return tree.emit("image", place, blend, mode="BOX", item=item)
