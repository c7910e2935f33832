# SPDX-License-Identifier: GPL-3.0-or-later
"""Image Texture, by every projection."""

from __future__ import annotations

import bpy

from ...shaders import Register, ShaderImage
from ..coordinates import read_coordinates
from ..nodes import Groups, Unreadable
from .tree import Tree, maker, parted

Node = bpy.types.Node
Socket = bpy.types.NodeSocket


@maker("TexImage")
def _image(tree: Tree, node: Node, output: Socket, groups: Groups) -> Register:
    assert isinstance(node, bpy.types.ShaderNodeTexImage)  # noqa: S101 - registered for it alone
    texture = tree.room.texture_of(node, tree.title, wants_alpha=output.identifier == "Alpha")
    if tree.is_linked(node, "Vector", groups):
        place = tree.place(node, groups)
    else:  # by the UV map, whatever the projection
        place = tree.ask("attribute", "uv", tree.shader.name(""))
    item = tree.shader.texture(texture)
    if node.projection == "FLAT" and output.identifier == "Color":
        _note(tree, node, output, groups, item)
    if node.projection != "BOX":
        return tree.emit("image", place, mode=node.projection, item=item)
    blend = tree.shader.literal(node.projection_blend)
    return tree.emit("image", place, blend, mode="BOX", item=item)


def _note(
    tree: Tree, node: bpy.types.ShaderNodeTexImage, output: Socket, groups: Groups, item: int
) -> None:
    """Makes it an image that can be unknown, where a UV map alone places it and nothing is divided
    by its alpha."""
    try:
        place = read_coordinates(node, groups, tree.title)
    except Unreadable:
        return
    if place.kind != "uv" or tree.shader.textures[item].pixels.shape[-1:] == (4,):
        return
    links = [link for link in output.links if not link.is_muted]
    is_number = all(link.to_socket.type == "VALUE" for link in links)
    name = parted(f"{''.join(f'{group.name}/' for group in groups)}{node.name}.image")
    if name in {known.name for known in tree.shader.images}:
        return
    matrix = place.matrix[:2][:, [0, 1, 3]].astype("float32")
    tree.shader.images.append(
        ShaderImage(name, item, place.attribute, matrix, 1 if is_number else 3)
    )
