# SPDX-License-Identifier: GPL-3.0-or-later
"""A hash of all that the picture of a world depends on, so that it is evaluated once."""

from __future__ import annotations

import hashlib

import bpy

from ..node_settings import plain, settings_of


def of_world(world: bpy.types.World, scene: bpy.types.Scene) -> str:
    """Of its nodes with their values and links, of images, and of the frame if it matters."""
    found = hashlib.sha256()
    trees: list[bpy.types.NodeTree] = [world.node_tree]
    done = set()
    moves = world.animation_data is not None
    while trees:
        tree = trees.pop()
        if tree in done:
            continue
        done.add(tree)
        moves = moves or tree.animation_data is not None
        _add(found, tree.name, [_end(link) for link in tree.links])
        for node in tree.nodes:
            _add(found, node.bl_idname, node.name, settings_of(node), _sockets(node))
            inner = getattr(node, "node_tree", None)
            if inner is not None:
                trees.append(inner)
                _add(found, inner.name)
            image = getattr(node, "image", None)
            if image is not None:
                moves = moves or image.source in {"MOVIE", "SEQUENCE"}
    if moves:
        _add(found, scene.frame_current, scene.frame_subframe)
    return found.hexdigest()


def _add(found: hashlib._Hash, *items: object) -> None:
    for item in items:
        found.update(repr(item).encode() + b"\0")


def _end(link: bpy.types.NodeLink) -> tuple[str, str, str, str, bool, bool]:
    return (
        link.from_node.name,
        link.from_socket.identifier,
        link.to_node.name,
        link.to_socket.identifier,
        link.is_muted,
        link.is_valid,
    )


def _sockets(node: bpy.types.Node) -> list[object]:
    # The RGB and Value nodes have theirs at an output.
    return [
        (item.identifier, item.enabled, plain(getattr(item, "default_value", None)))
        for item in (*node.inputs, *node.outputs)
    ]
