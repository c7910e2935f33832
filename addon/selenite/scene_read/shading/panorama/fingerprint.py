# SPDX-License-Identifier: GPL-3.0-or-later
"""A hash of all that the picture of a world depends on, so that it is evaluated once."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import bpy
import numpy as np

#: What a node has for the editor alone, or what is hashed by other means.
_NOT_HASHED = {
    "rna_type", "location", "location_absolute", "width", "width_hidden", "height", "dimensions",
    "parent", "select", "show_options", "show_preview", "hide", "show_texture", "color",
    "use_custom_color", "label", "inputs", "outputs", "internal_links", "node_tree", "interface",
    "warning_propagation", "color_tag", "panel_states",
}  # fmt: skip
_DEPTH = 3  # a curve's points are that deep below the node


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
            _add(found, node.bl_idname, node.name, _values(node), _sockets(node))
            inner = getattr(node, "node_tree", None)
            if inner is not None:
                trees.append(inner)
                _add(found, inner.name)
            image = getattr(node, "image", None)
            if image is not None:
                moves = moves or image.source in {"MOVIE", "SEQUENCE"}
                _add(found, *_image(image))
    if moves:
        _add(found, scene.frame_current, scene.frame_subframe)
    return found.hexdigest()


def _add(found: Any, *items: object) -> None:  # noqa: ANN401 - hashlib has no name for it
    for item in items:
        found.update(item if isinstance(item, bytes) else repr(item).encode())
        found.update(b"\0")


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
        (item.identifier, item.enabled, _plain(getattr(item, "default_value", None)))
        for item in (*node.inputs, *node.outputs)
    ]


def _values(struct: Any, depth: int = _DEPTH) -> list[object]:  # noqa: ANN401 - any bpy struct
    """Properties of a node, and of ramps and curves that it holds."""
    found: list[object] = []
    for item in struct.bl_rna.properties:
        name = item.identifier
        # The elements of a ramp have names that a node has for the editor.
        of_node = depth == _DEPTH and (name in _NOT_HASHED or name.startswith("bl_"))
        if of_node or name == "rna_type":
            continue
        value = getattr(struct, name, None)
        if item.type == "COLLECTION":
            found.append((name, [_values(one, depth - 1) for one in value] if depth else None))
        elif item.type == "POINTER":
            if isinstance(value, bpy.types.Object):
                found.append((name, value.name, np.array(value.matrix_world).tolist()))
            elif value is None or isinstance(value, bpy.types.ID):
                found.append((name, getattr(value, "name", None)))
            elif depth:
                found.append((name, _values(value, depth - 1)))
        else:
            found.append((name, _plain(value)))
    return found


def _plain(value: Any) -> object:  # noqa: ANN401 - the value of any property
    if hasattr(value, "__len__") and not isinstance(value, (str, set, frozenset)):
        return [_plain(item) for item in value]
    if isinstance(value, (set, frozenset)):
        return sorted(value)
    return value if isinstance(value, (bool, int, float, str)) or value is None else str(value)


def _image(image: bpy.types.Image) -> list[object]:
    """The file with its size and time, or the pixels of what is packed, made or painted."""
    settings = [image.name, image.source, image.colorspace_settings.name, image.alpha_mode]
    path = Path(bpy.path.abspath(image.filepath, library=image.library))
    if image.source != "GENERATED" and not image.packed_file and not image.is_dirty:
        try:
            found = path.stat()
        except OSError:
            return [*settings, str(path)]
        return [*settings, str(path), found.st_size, found.st_mtime_ns]
    stored: Any = image.pixels
    pixels = np.empty(len(stored), np.float32)
    stored.foreach_get(pixels)
    return [*settings, tuple(image.size), hashlib.sha256(pixels.tobytes()).digest()]
