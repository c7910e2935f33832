# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitted colours in the colour attribute of a mesh.

What stood there before is kept on the mesh, for `restore`: as a hidden attribute, which Blender
saves, copies and brings back with an undo.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, cast

import bpy
import numpy as np

from ..messages import thing
from ..problems import BadInput, Problem
from ..scene_read import hosts, mesh_colors
from ..scene_read.shading import nodes
from ..scene_read.values import ObjectValues, SceneValues
from . import images

if TYPE_CHECKING:
    from ..scene_read.hosts import BpyStruct

#: On a mesh: the name of the attribute that was changed.
_CHANGED = "selenite_vertex_colors"
#: Likewise of the attribute that was made, and the materials that were linked to it.
_MADE, _LINKED = "selenite_new_colors", "selenite_new_colors_materials"
#: The attribute that holds what it was.
_BEFORE = ".selenite_vertex_colors"


def show(values: SceneValues, name: str, path: str) -> str:
    """Gives the colour attribute that the materials of object `name` show the colours of a .npy
    file, (n, 3) linear, one for each of its values; their alpha stays. Returns what was done.
    Raises BadInput, and then nothing has changed."""
    title = thing("Object", name)
    mesh = _mesh(name, title)
    owner = mesh_colors.object_of(values, name, title)
    try:
        attribute = mesh_colors.shown_colors(values, owner, title)[0]
    except BadInput as error:
        return _show_new(values, owner, mesh, path, error)
    target = hosts.color_attribute(mesh, attribute)
    if target is None:
        raise BadInput(Problem(title, f"its colour attribute '{attribute}' is gone", "undo that"))
    colors = _colors(path)
    stored = _values(target)
    if len(colors) != len(stored):
        cause = f"its colour attribute '{attribute}' has {len(stored)} values, not {len(colors)}"
        raise BadInput(Problem(title, cause, "undo what has changed the mesh since the fit"))
    if _CHANGED not in list(mesh.keys()):
        kept = _attributes(mesh).new(_BEFORE, target.data_type, target.domain)
        # A new attribute moves those that were found before.
        target = cast("BpyStruct", hosts.color_attribute(mesh, attribute))
        kept.data.foreach_set("color", stored.ravel())
        mesh[_CHANGED] = attribute
    target.data.foreach_set("color", np.column_stack([colors, stored[:, 3]]).ravel())
    mesh.update()
    return f"{title} now has the colours of {Path(path).absolute()} as '{attribute}'"


def _show_new(
    values: SceneValues, owner: ObjectValues, mesh: bpy.types.Mesh, path: str, why: BadInput
) -> str:
    """The same by an attribute that the mesh lacks. Raises BadInput: `why` where it is none."""
    title = thing("Object", owner.name)
    colors = _colors(path)
    try:
        new = mesh_colors.new_colors(values, owner, title)
    except BadInput:
        raise why from None
    if len(colors) != len(mesh.vertices):
        cause = f"its mesh has {len(mesh.vertices)} vertices, not {len(colors)}"
        raise BadInput(Problem(title, cause, "undo what has changed the mesh since the fit"))
    linked: list[str] = []
    try:
        for material in new.materials:
            images.show_colors(values, material, new.attribute)
            linked.append(material)
    except BadInput:
        for material in linked:
            images.restore(material)
        raise
    made = cast("BpyStruct", mesh.color_attributes).new(new.attribute, "FLOAT_COLOR", "POINT")
    made.data.foreach_set("color", np.column_stack([colors, np.ones(len(colors))]).ravel())
    mesh[_MADE], mesh[_LINKED] = made.name, json.dumps(linked)
    mesh.update()
    return f"{title} now has the colours of {Path(path).absolute()} as '{made.name}', a new one"


def restore(name: str) -> None:
    """Undoes `show`; what is gone meanwhile is passed over."""
    mesh = _mesh_of(name)
    if mesh is not None and _MADE in list(mesh.keys()):
        for material in json.loads(mesh[_LINKED]):
            images.restore(material)
        made = hosts.color_attribute(mesh, mesh[_MADE])
        if made is not None:
            cast("BpyStruct", mesh.color_attributes).remove(made)
        del mesh[_MADE], mesh[_LINKED]
    if mesh is None or _CHANGED not in list(mesh.keys()):
        return
    target = hosts.color_attribute(mesh, mesh[_CHANGED])
    kept = _attributes(mesh).get(_BEFORE)
    del mesh[_CHANGED]
    if kept is None:
        return
    if target is not None and len(target.data) == len(kept.data):
        target.data.foreach_set("color", _values(kept).ravel())
        mesh.update()
    _attributes(mesh).remove(_attributes(mesh)[_BEFORE])


def _mesh(name: str, title: str) -> bpy.types.Mesh:
    """Raises BadInput."""
    mesh = _mesh_of(name)
    if mesh is None:
        raise BadInput(Problem(title, "it is gone", "undo its removal"))
    if why := nodes.why_owner_fixed(mesh):
        raise BadInput(Problem(title, f"its mesh is {why}", "make it local"))
    return mesh


def _mesh_of(name: str) -> bpy.types.Mesh | None:
    item: bpy.types.Object | None = bpy.data.objects.get(name)
    mesh = item.data if item is not None else None
    return mesh if isinstance(mesh, bpy.types.Mesh) else None


def _attributes(mesh: bpy.types.Mesh) -> BpyStruct:
    return cast("BpyStruct", mesh.attributes)


def _values(attribute: BpyStruct) -> np.ndarray:
    """(n, 4), linear."""
    found: np.ndarray = hosts.floats(attribute.data, "color", 4)
    return found


def _colors(path: str) -> np.ndarray:
    """(n, 3). Raises BadInput."""
    title = thing("File", path)
    try:
        colors = np.load(path, allow_pickle=False)
    except (OSError, ValueError) as error:
        cause = f"cannot be read ({error})"
        raise BadInput(Problem(title, cause, "put it back or run the fit again")) from error
    if colors.ndim != 2 or colors.shape[1] != 3 or not np.isfinite(colors).all():  # noqa: PLR2004
        raise BadInput(Problem(title, "it holds no colours (n, 3)", "run the fit again"))
    return np.asarray(colors, np.float32)
