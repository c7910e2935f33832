# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitted vertices as a shape key of a mesh: at 0 the mesh is as it was."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, cast

import bpy
import numpy as np

from ..messages import thing
from ..problems import BadInput, Problem
from ..scene_read import hosts, mesh_colors
from ..scene_read.shading import nodes
from ..scene_read.values import SceneValues

if TYPE_CHECKING:
    from ..scene_read.hosts import BpyStruct

#: The name of the shape key.
KEY = "Selenite"


def show(values: SceneValues, name: str, path: str) -> str:
    """Gives object `name` the vertices of a .npy file, (n, 3) in its own space, by a shape key on
    top of those that it has. Returns what was done. Raises BadInput, and then nothing has
    changed."""
    title = thing("Object", name)
    item, mesh = _mesh(name, title)
    wanted = _positions(path, title, len(mesh.vertices))
    owner = mesh_colors.object_of(values, name, title)
    before = values.meshes[owner.mesh].positions
    if len(before) != len(wanted):
        cause = f"its mesh had {len(before)} vertices when the scene was read, not {len(wanted)}"
        raise BadInput(Problem(title, cause, "undo what has changed the mesh since the fit"))
    restore(name)
    if mesh.shape_keys is None:
        item.shape_key_add(name="Basis", from_mix=False)
    key = item.shape_key_add(name=KEY, from_mix=False)
    # Other keys go on moving it: what counts is the way from where they have put it.
    rest = hosts.floats(key.data, "co", 3)
    key.data.foreach_set("co", (rest + (wanted - before)).astype(np.float32).ravel())
    key.value = 1
    mesh.update()
    return f"{title} now has the shape of {Path(path).absolute()} as shape key '{KEY}'"


def restore(name: str) -> None:
    """Undoes `show`; what is gone meanwhile is passed over."""
    item: bpy.types.Object | None = bpy.data.objects.get(name)
    keys = getattr(item.data, "shape_keys", None) if item is not None else None
    if item is None or keys is None:
        return
    blocks = cast("BpyStruct", keys.key_blocks)
    own = blocks.get(KEY)
    if own is None:
        return
    item.shape_key_remove(own)
    if len(blocks) == 1:  # the basis that `show` has added, or one that shows nothing
        item.shape_key_remove(blocks[0])


def _mesh(name: str, title: str) -> tuple[bpy.types.Object, bpy.types.Mesh]:
    """Raises BadInput."""
    item: bpy.types.Object | None = bpy.data.objects.get(name)
    mesh = item.data if item is not None else None
    if item is None or not isinstance(mesh, bpy.types.Mesh):
        raise BadInput(Problem(title, "it is gone", "undo its removal"))
    if why := nodes.why_owner_fixed(mesh):
        raise BadInput(Problem(title, f"its mesh is {why}", "make it local"))
    return item, mesh


def _positions(path: str, title: str, count: int) -> np.ndarray:
    """(count, 3). Raises BadInput."""
    try:
        found = np.load(path, allow_pickle=False)
    except (OSError, ValueError) as error:
        cause = f"cannot be read ({error})"
        cure = "put it back or run the fit again"
        raise BadInput(Problem(thing("File", path), cause, cure)) from error
    if found.shape != (count, 3) or not np.isfinite(found).all():
        cause = f"its mesh has {count} vertices, and the file none or others"
        raise BadInput(Problem(title, cause, "undo what has changed the mesh since the fit"))
    return np.asarray(found, np.float64)
