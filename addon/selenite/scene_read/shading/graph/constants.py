# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that compute with constants alone: the value that they give."""

from __future__ import annotations

import bpy
import numpy as np

from ....parameters import Values
from ...build import build
from ...shaders import Closure
from ...values import CameraValues, MaterialValues, MeshValues, ObjectValues, SceneValues
from .. import nodes
from ..nodes import Groups
from ..panorama.rays import reached
from ..textures import TextureRoom
from . import arithmetic, colors, vectors
from .tree import MAKERS, Tree

_MODULES = {module.__name__ for module in (arithmetic, colors, vectors)}
_OF_A_PLACE = {"ShaderNodeVectorTransform"}
_CONSTANTS = {"ShaderNodeRGB", "ShaderNodeValue"}
_NAME = "Constant"


def fold(socket: bpy.types.NodeSocket, groups: Groups, title: str) -> Values | None:
    """The number or colour that arrives at an input; None if it is no constant."""
    value = nodes.constant(nodes.source_of(socket, groups))
    if value is not None:
        return value
    if not all(_is_arithmetic(source.node) for source in reached(nodes.source_of(socket, groups))):
        return None
    tree = Tree(title, TextureRoom())
    result = tree.value(socket, groups)
    if tree.problems:
        return None
    one = tree.shader.literal(1)
    tree.shader.closures.append(Closure("emission", {"color": result, "strength": one}))
    material = MaterialValues(_NAME, {}, multi_ggx=False, flavour="v2", shader=tree.shader)
    (closure,) = build(_scene(material)).shader_values(_NAME, _NAME, 1, 1)
    found = tuple(float(number) for number in closure["inputs"]["color"][0, 0])
    return found if socket.type in {"RGBA", "VECTOR"} else found[:1]


def _is_arithmetic(node: bpy.types.Node) -> bool:
    make = MAKERS.get(node.bl_idname)
    if node.bl_idname in _CONSTANTS:
        return True
    return make is not None and make.__module__ in _MODULES and node.bl_idname not in _OF_A_PLACE


def _scene(material: MaterialValues) -> SceneValues:
    """A triangle that fills the one pixel of a camera."""
    points = np.array([(-9, -9, 0), (9, -9, 0), (0, 9, 0)], np.float32)
    facing = np.tile(np.array([(0, 0, 1)], np.float32), (3, 1))
    mesh = MeshValues(_NAME, points, np.array([(0, 1, 2)], np.int32), facing, np.zeros(1, np.int32))
    above = np.eye(4)
    above[2, 3] = 5
    camera = CameraValues(
        name=_NAME, matrix=above, kind="ORTHO", lens_mm=50, sensor_width=36, sensor_height=24,
        sensor_fit="AUTO", shift_x=0, shift_y=0, ortho_scale=1, clip_start=0.1, clip_end=10,
        pixel_aspect_x=1, pixel_aspect_y=1, width=1, height=1,
    )  # fmt: skip
    values = SceneValues()
    values.materials.append(material)
    values.meshes.append(mesh)
    values.objects.append(ObjectValues(_NAME, 0, np.eye(4), (_NAME,)))
    values.cameras.append(camera)
    return values
