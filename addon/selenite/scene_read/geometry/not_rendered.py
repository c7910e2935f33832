# SPDX-License-Identifier: GPL-3.0-or-later
"""Geometry that Cycles renders and Selenite does not: named, and refused."""

from __future__ import annotations

import bpy

from ...messages import remark, thing
from ...problems import Problem
from ..values import SceneValues

_READ = {"MESH", "LIGHT", "VOLUME"}
#: Curves, surfaces, texts and metaballs with a surface come as meshes from the dependency graph.
_AS_MESH = {"CURVE", "SURFACE", "FONT", "META"}
_NO_SURFACE = {"ARMATURE", "CAMERA", "EMPTY", "LATTICE", "LIGHT_PROBE", "SPEAKER", *_AS_MESH}
#: Blender draws them over the picture; Cycles does not render them.
_DRAWN = {"GPENCIL", "GREASEPENCIL"}
_CURES = {
    "CURVES": (
        "it renders as hair curves, which are not read",
        "turn them into a mesh (node Curve to Mesh with a Profile Curve), or hide it from renders",
    ),
    "POINTCLOUD": (
        "it renders as a cloud of points, which is not read",
        "put spheres on the points (node Instance on Points), or hide it from renders",
    ),
}


def is_read(evaluated: bpy.types.Object, original: bpy.types.Object, read: SceneValues) -> bool:
    """Whether an object that renders is one of those that are read; says so if it should be."""
    if evaluated.type in _READ:
        return True
    title = thing("Object", original.name)
    if evaluated.type in _DRAWN:
        read.warn(
            remark(title, "Blender draws its strokes over the picture of Cycles; left out here")
        )
    elif evaluated.type not in _NO_SURFACE and _has_points(evaluated):
        kind = evaluated.type.lower()
        default = f"objects of type {kind} are not read", "hide it from renders"
        _refuse(title, *_CURES.get(evaluated.type, default), read)
    return False


def judge_hair(evaluated: bpy.types.Object, read: SceneValues) -> None:
    """Refuses particle systems that Cycles renders as hair."""
    for modifier in evaluated.modifiers:
        if modifier.type != "PARTICLE_SYSTEM" or not modifier.show_render:
            continue
        system = modifier.particle_system
        settings = system.settings
        if settings.type == "HAIR" and settings.render_type == "PATH" and len(system.particles):
            title = thing("Object", evaluated.original.name)
            cause = f"particle system '{system.name}' renders as hair, which is not read"
            _refuse(title, cause, "set Render As to None or to an object", read)


def judge_simulation(evaluated: bpy.types.Object, frame: int, read: SceneValues) -> None:
    """Refuses particles whose places depend on how their frame was reached: they were not baked.
    Those without physics stay where they are born."""
    for modifier in evaluated.modifiers:
        if modifier.type != "PARTICLE_SYSTEM" or not modifier.show_render:
            continue
        system = modifier.particle_system
        settings, cache = system.settings, system.point_cache
        shown = settings.type == "EMITTER" and settings.render_type in {"OBJECT", "COLLECTION"}
        moves = settings.physics_type != "NO" and frame > cache.frame_start
        if shown and moves and not cache.is_baked:
            title = thing("Object", evaluated.original.name)
            cause = (
                f"particle system '{system.name}' is simulated and not baked: Cycles may show "
                "other places of its particles"
            )
            _refuse(title, cause, "use Bake in its Cache, or make its instances real", read)


def judge_camera_nodes(original: bpy.types.Object, read: SceneValues) -> None:
    """Warns of geometry that Cycles makes anew for each camera: it is read for one."""
    if len(read.cameras) < 2:
        return
    for modifier in original.modifiers:
        tree = getattr(modifier, "node_group", None)
        if tree is not None and _asks_for_camera(tree, set()):
            read.warn(
                remark(
                    thing("Object", original.name),
                    f"modifier '{modifier.name}' depends on the active camera; its geometry "
                    "is that of the scene's camera in every photo",
                )
            )


def is_wire(evaluated: bpy.types.Object) -> bool:
    """Curves, texts and metaballs without a surface render as nothing, in Cycles too."""
    return evaluated.original.type in _AS_MESH


def _asks_for_camera(tree: bpy.types.NodeTree, seen: set[bpy.types.NodeTree]) -> bool:
    seen.add(tree)
    for node in tree.nodes:
        if node.bl_idname == "GeometryNodeInputActiveCamera":
            return True
        inner = getattr(node, "node_tree", None)
        if inner is not None and inner not in seen and _asks_for_camera(inner, seen):
            return True
    return False


def _has_points(evaluated: bpy.types.Object) -> bool:
    points = getattr(evaluated.data, "points", None)
    return points is None or len(points) > 0


def _refuse(title: str, cause: str, cure: str, read: SceneValues) -> None:
    problem = Problem(title, cause, cure)
    if problem not in read.problems:
        read.problems.append(problem)
