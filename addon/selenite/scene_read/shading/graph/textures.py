# SPDX-License-Identifier: GPL-3.0-or-later
"""Procedural textures."""

from __future__ import annotations

import bpy

from ... import hosts
from ...shaders import Register
from ..nodes import Groups
from .tree import Tree, maker

Node = bpy.types.Node
Socket = bpy.types.NodeSocket

_NOISES = (
    "FBM",
    "MULTIFRACTAL",
    "HETERO_TERRAIN",
    "HYBRID_MULTIFRACTAL",
    "RIDGED_MULTIFRACTAL",
)
_FEATURES = ("F1", "F2", "SMOOTH_F1", "DISTANCE_TO_EDGE", "N_SPHERE_RADIUS")
_METRICS = ("EUCLIDEAN", "MANHATTAN", "CHEBYCHEV", "MINKOWSKI")
_VORONOI_OUTPUTS = ("Distance", "Color", "Position", "W")
_DIRECTIONS = ("X", "Y", "Z", "DIAGONAL", "SPHERICAL")
_PROFILES = ("SIN", "SAW", "TRI")
#: Earlier versions compute these textures in another way.
_OLDER = "{} is computed in another way by this Blender, which is not modelled"


_KINDS = {
    "ShaderNodeTexNoise": "noise",
    "ShaderNodeTexWhiteNoise": "noise",
    "ShaderNodeTexVoronoi": "voronoi",
}


def _dimensions(node: Node) -> int:
    return int(getattr(node, f"{_KINDS[node.bl_idname]}_dimensions")[0])


def _refused(tree: Tree, node: Node) -> bool:
    if hosts.has_textures_of_4_3():
        return False
    tree.refuse(node, _OLDER, "bake it into an image")
    return True


@maker("TexNoise")
def _noise(tree: Tree, node: Node, output: Socket, groups: Groups) -> Register:
    if _refused(tree, node):
        return tree.shader.literal(0)
    dimensions = _dimensions(node)
    place = tree.shader.literal(0) if dimensions == 1 else tree.place(node, groups)
    numbers = ("W", "Scale", "Detail", "Roughness", "Lacunarity", "Offset", "Gain", "Distortion")
    flags = ("per_channel",) * node.normalize + ("colored",) * (output.identifier == "Color")
    return tree.emit(
        "noise",
        place,
        *(tree.get(node, name, groups) for name in numbers),
        mode=_NOISES.index(node.noise_type) | (dimensions - 1) << 3,
        flags=flags,
    )


@maker("TexWhiteNoise")
def _white_noise(tree: Tree, node: Node, output: Socket, groups: Groups) -> Register:
    inputs = [tree.get(node, name, groups) for name in ("Vector", "W")]
    flags = ("colored",) * (output.identifier == "Color")
    return tree.emit("white_noise", *inputs, mode=_dimensions(node) - 1 << 3, flags=flags)


@maker("TexVoronoi")
def _voronoi(tree: Tree, node: Node, output: Socket, groups: Groups) -> Register:
    if _refused(tree, node):
        return tree.shader.literal(0)
    dimensions = _dimensions(node)
    place = tree.shader.literal(0) if dimensions == 1 else tree.place(node, groups)
    names = ("W", "Scale", "Detail", "Roughness", "Lacunarity", "Smoothness", "Exponent")
    numbers = [tree.get(node, name, groups) for name in (*names, "Randomness")]
    mode = _FEATURES.index(node.feature) | (dimensions - 1) << 3
    radius = output.identifier == "Radius"
    item = 0 if radius else _VORONOI_OUTPUTS.index(output.identifier)
    return tree.emit(
        "voronoi",
        place,
        *numbers,
        mode=mode | _METRICS.index(node.distance) << 5 | hosts.has_cells_of_5() << 7,
        flags=("per_channel",) * node.normalize,
        item=item,
    )


@maker("TexWave")
def _wave(tree: Tree, node: Node, output: Socket, groups: Groups) -> Register:
    rings = node.wave_type == "RINGS"
    direction = node.rings_direction if rings else node.bands_direction
    mode = min(_DIRECTIONS.index(direction), 3) | rings << 2
    names = ("Scale", "Distortion", "Detail", "Detail Scale", "Detail Roughness", "Phase Offset")
    return tree.emit(
        "wave",
        tree.place(node, groups),
        *(tree.get(node, name, groups) for name in names),
        mode=mode | _PROFILES.index(node.wave_profile) << 3,
    )


@maker("TexMagic")
def _magic(tree: Tree, node: Node, output: Socket, groups: Groups) -> Register:
    inputs = (tree.get(node, name, groups) for name in ("Scale", "Distortion"))
    color = tree.emit("magic", tree.place(node, groups), *inputs, mode=node.turbulence_depth)
    return color if output.identifier == "Color" else tree.emit("mean", color)


@maker("TexGradient")
def _gradient(tree: Tree, node: Node, output: Socket, groups: Groups) -> Register:
    return tree.emit("gradient", tree.place(node, groups), mode=node.gradient_type)


@maker("TexChecker")
def _checker(tree: Tree, node: Node, output: Socket, groups: Groups) -> Register:
    share = tree.emit("checker", tree.place(node, groups), tree.get(node, "Scale", groups))
    if output.identifier != "Color":
        return share
    first, second = (tree.get(node, name, groups) for name in ("Color1", "Color2"))
    return tree.emit("mix", share, second, first, mode="MIX")


@maker("TexBrick")
def _brick(tree: Tree, node: Node, output: Socket, groups: Groups) -> Register:
    names = ("Scale", "Mortar Size", "Mortar Smooth", "Bias", "Brick Width", "Row Height")
    settings = (node.offset, node.offset_frequency, node.squash, node.squash_frequency)
    inputs = (
        tree.place(node, groups),
        *(tree.get(node, name, groups) for name in names),
        *(tree.shader.literal(number) for number in settings),
    )
    mortar = tree.emit("brick", *inputs, mode=0)
    if output.identifier != "Color":
        return mortar
    tint = tree.emit("brick", *inputs, mode=1)
    first, second, joint = (tree.get(node, name, groups) for name in ("Color1", "Color2", "Mortar"))
    brick = tree.emit("mix", tint, first, second, mode="MIX")
    return tree.emit("mix", mortar, brick, joint, mode="MIX")
