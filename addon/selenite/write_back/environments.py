# SPDX-License-Identifier: GPL-3.0-or-later
"""A fitted image of the world -> an Environment Texture that Cycles renders.

What stood in the node tree before is noted on the world, for `restore`, by the names of nodes:
after an undo every pointer that Python holds is stale. Each `show` adds a note, `restore` takes the
newest away.
"""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, cast

import bpy
import numpy as np

from .. import native
from ..messages import thing
from ..paths import why_not_file
from ..problems import BadInput, Problem
from ..scene_read import hosts, view_layers
from ..scene_read.shading import nodes, world
from ..scene_read.values import SceneValues
from . import datablock

if TYPE_CHECKING:
    from ..scene_read.hosts import BpyStruct

_BEFORE = "selenite_environment_before"
#: Marks the images that were made here, which go when nobody uses them any more.
_MADE = "selenite_environment"
#: Of an image for Cycles, at least.
_ROWS = 200
_LINEAR = ("Linear Rec.709", "Linear", "Linear BT.709")


def show(scene: bpy.types.Scene, values: SceneValues, path: str, *, is_final: bool = True) -> str:
    """Links the image file at `path` (equirectangular, linear) to the Background of the world that
    `values` have, packed into the .blend. Returns what was done. is_final: for Cycles, in finer
    texels, see `_finer`; else another fit begins with those of the file.

    Its strength stays; what was linked stays in the tree, unlinked. Raises BadInput, and then
    nothing has changed.
    """
    pixels = _read(path)
    return show_pixels(scene, values, _finer(pixels) if is_final else pixels)


def show_pixels(scene: bpy.types.Scene, values: SceneValues, pixels: np.ndarray) -> str:
    """The same of an image that is there: (h, w, 3) float32, linear, row 0 at the top, in the frame
    of the world."""
    found = _world_of(scene, values)
    title = thing("World", found.name)
    inlet, reason = world.find_inlet(found)
    if inlet is None or reason:
        cause = f"it cannot take an image ({reason.cause})"
        raise BadInput(Problem(title, cause, reason.cure or "undo the change"))
    image = _image(f"{found.name} environment", pixels)
    tree, end = cast(bpy.types.NodeTree, inlet.id_data), inlet.node
    before = nodes.link_of(inlet)
    note: dict[str, object] = {
        "group": "" if tree == found.node_tree else tree.name,
        "inlet": [end.name, inlet.identifier],
        "link": None if before is None else [before.from_node.name, before.from_socket.identifier],
        # Linking removes every other link.
        "muted": [
            [item.from_node.name, item.from_socket.identifier]
            for item in inlet.links
            if item.is_muted
        ],
    }
    node = cast(bpy.types.ShaderNodeTexEnvironment, tree.nodes.new("ShaderNodeTexEnvironment"))
    node.select = False
    node.parent = end.parent  # before the location, which is relative to it
    node.location = end.location[0] - 300, end.location[1]
    node.image, node.projection, node.interpolation = image, "EQUIRECTANGULAR", "Linear"
    tree.links.new(node.outputs["Color"], inlet)
    notes = json.loads(found.get(_BEFORE, "[]"))
    found[_BEFORE] = json.dumps([*notes, note | {"node": node.name}])
    return f"{title} now takes its light from image '{image.name}' (node '{node.name}', a new one)"


def _world_of(scene: bpy.types.Scene, values: SceneValues) -> bpy.types.World:
    """That which was read. Raises BadInput."""
    owner = values.owners.get(world.WORLD)
    found = datablock(view_layers.worlds(scene), owner) if owner is not None else None
    if found is None:
        raise BadInput(Problem("World", "it is gone", "choose it again"))
    return found


def restore(scene: bpy.types.Scene) -> None:
    """Undoes the newest `show` for the scene's worlds; what is gone meanwhile is passed over."""
    for item in dict.fromkeys(view_layers.worlds(scene)):
        if _BEFORE in item.keys() and hosts.is_editable(item):  # noqa: SIM118 - an ID is no dict
            _undo(item)
    for image in [item for item in bpy.data.images if item.get(_MADE) and not item.users]:
        bpy.data.images.remove(image)


def _read(path: str) -> np.ndarray:
    """(h, w, 3) float32, linear. Raises BadInput."""
    title, cure = thing("Image", path), "put it back or run the fit again"
    if why := why_not_file(path):
        raise BadInput(Problem(title, f"it cannot be read ({why})", cure))
    try:
        return np.asarray(native.image().read(path)[0], np.float32)
    except (OSError, ValueError, MemoryError) as error:
        raise BadInput(Problem(title, f"it cannot be read ({error})", cure)) from error


def _finer(pixels: np.ndarray) -> np.ndarray:
    """The same light in so many rows that half of one is next to nothing: so far from a pole Cycles
    takes in the row at the other pole. An odd factor keeps every texel, and what bilinear lookups
    find between."""
    height, width = pixels.shape[:2]
    factor = 2 * math.ceil((_ROWS / height - 1) / 2) + 1
    if factor <= 1:
        return pixels
    places = [(np.arange(side * factor) + 0.5) / factor - 0.5 for side in (height, width)]
    below, left = (np.floor(place).astype(int) for place in places)
    down = (places[0] - below)[:, None, None]
    across = (places[1] - left)[None, :, None]
    rows = pixels[below.clip(0)] * (1 - down) + pixels[(below + 1).clip(max=height - 1)] * down
    found = rows[:, left % width] * (1 - across) + rows[:, (left + 1) % width] * across
    return found.astype(np.float32)


def _image(name: str, pixels: np.ndarray) -> bpy.types.Image:
    """A packed float image of linear colours."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.new(name, width, height, alpha=False, float_buffer=True)
    image[_MADE] = True
    settings = cast("BpyStruct", image.colorspace_settings)
    known = [item.identifier for item in settings.bl_rna.properties["name"].enum_items]
    settings.name = next((item for item in _LINEAR if item in known), settings.name)
    stored = np.ones((height, width, 4), np.float32)
    stored[..., :3] = pixels[::-1]  # Blender's first row is the lowest
    cast("BpyStruct", image.pixels).foreach_set(stored.ravel())
    image.update()
    image.pack()
    return image


def _undo(found: bpy.types.World) -> None:
    *earlier, note = json.loads(found[_BEFORE])
    if earlier:
        found[_BEFORE] = json.dumps(earlier)
    else:
        del found[_BEFORE]
    tree: bpy.types.NodeTree | None = found.node_tree
    if note["group"]:
        groups = (item for item in bpy.data.node_groups if hosts.is_editable(item))
        tree = next((item for item in groups if item.name == note["group"]), None)
    if tree is None:
        return
    node: bpy.types.Node | None = tree.nodes.get(note["node"])
    if node is not None:
        tree.nodes.remove(node)
    inlet = _socket(tree, "inputs", *note["inlet"])
    if inlet is None or inlet.is_linked:  # somebody has linked something since
        return
    for start, muted in [
        *((item, True) for item in note["muted"]),
        *([(note["link"], False)] if note["link"] is not None else []),
    ]:
        outlet = _socket(tree, "outputs", *start)
        if outlet is not None:
            tree.links.new(outlet, inlet).is_muted = muted


def _socket(
    tree: bpy.types.NodeTree, side: str, node: str, identifier: str
) -> bpy.types.NodeSocket | None:
    found: bpy.types.Node | None = tree.nodes.get(node)
    if found is None:
        return None
    sockets = getattr(found, side)
    return next((item for item in sockets if item.identifier == identifier), None)
