# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitted fields of bodies: images of materials, colours and vertices of meshes."""

from __future__ import annotations

from .. import parameters
from ..scene_read.values import SceneValues
from . import images, vertex_colors, vertex_positions

#: What belongs to a mesh -> the module that shows it there.
_OF_MESH = {"vertex_colors": vertex_colors, "vertex_positions": vertex_positions}
_SUFFIX, _NODE = "_texture", ".image"


def show(values: SceneValues, name: str, path: str) -> str:
    """Puts the file of a field, as in Body:roughness_texture or Ball:vertex_colors, into the scene.
    Returns what was done. Raises BadInput, and then nothing has changed."""
    owner, parameter = parameters.split_name(name)
    if parameter in _OF_MESH:
        return _OF_MESH[parameter].show(values, owner, path)
    if parameter.endswith(_NODE):
        return images.show_in_node(values, owner, path, parameter.removesuffix(_NODE))
    return images.show(values, owner, path, parameter.removesuffix(_SUFFIX))


def restore(name: str) -> None:
    """Undoes `show`; what is gone meanwhile is passed over."""
    owner, parameter = parameters.split_name(name)
    _OF_MESH.get(parameter, images).restore(owner)
