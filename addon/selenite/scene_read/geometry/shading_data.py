# SPDX-License-Identifier: GPL-3.0-or-later
"""What materials look up on meshes and objects, and whether it is there."""

from __future__ import annotations

from dataclasses import replace

import bpy

from ... import parameters
from ...messages import remark
from ...problems import Problem
from ..baking.wanted import UV_NAME
from ..shaders import ISLAND
from ..values import MaterialValues, MeshValues, ObjectFacts, SceneValues
from . import corner_vectors, mesh


def add_vectors(evaluated: bpy.types.Object, index: int, material: str, read: SceneValues) -> None:
    """What a material asks for at the corners of a mesh, if it is not there yet: what its shader
    does, and attributes that are neither colours nor UV maps."""
    found = next(item for item in read.materials if item.name == material)
    values = read.meshes[index]
    shader = found.shader
    asked = shader.attributes("vector") if shader is not None else set()
    names = asked - {name for name, _ in values.vectors}
    lookups = [item for item in found.maps.values() if item.attribute]
    colors = {item.attribute for item in lookups if item.texture is None}
    uv_maps = {item.attribute for item in lookups if item.texture is not None}
    colors -= {name for name, _ in values.colors}
    uv_maps -= {name for name, _ in values.uv_maps}
    if not names | colors | uv_maps:
        return
    islands: corner_vectors.MeshVectors = ()
    if ISLAND in names and (split := corner_vectors.islands_of_split(evaluated, values)):
        islands = split
        names.discard(ISLAND)
    groups = corner_vectors.vertex_groups(evaluated)
    with mesh.mesh_of(evaluated) as of_blender:
        vectors = islands + corner_vectors.made(of_blender, values, names, groups)
        made = {
            name: corner_vectors.attribute(of_blender, values, name, groups)
            for name in sorted(colors | uv_maps)
        }
    known = {name: item for name, item in made.items() if item is not None}
    read.meshes[index] = replace(
        values,
        vectors=values.vectors + vectors,
        colors=values.colors + tuple((name, known[name]) for name in known if name in colors),
        uv_maps=values.uv_maps
        + tuple((name, known[name][:, :2]) for name in known if name in uv_maps),
    )


def facts(instance: mesh.Instance) -> ObjectFacts:
    """What Object Info gives of an object. The random number of an instance is Blender's own."""
    item = instance.original
    random = corner_vectors.random_of_name(item.name)
    if instance.is_instance:
        random = instance.random_id / 0xFFFFFFFF
    return ObjectFacts(
        location=tuple(float(x) for x in instance.matrix[:3, 3]),
        color=tuple(item.color[:3]),
        alpha=float(item.color[3]),
        index=float(item.pass_index),
        random=random,
    )


def judge_attributes(title: str, shape: MeshValues, material: str, read: SceneValues) -> None:
    """Whether a mesh has the UV maps and colour attributes that a material of it looks up."""
    values = next(item for item in read.materials if item.name == material)
    _judge_excess(title, shape, values, read)
    asked = [
        ("UV map" if found.texture is not None else "colour attribute", found.attribute)
        for found in values.maps.values()
        if found.uv[:, :2].any()
    ]
    if values.shader is not None:
        both = values.shader.attributes("uv") & values.shader.attributes("color")
        uv_maps = {name for name in values.shader.attributes("uv") if not name.startswith(UV_NAME)}
        asked += [("UV map", name) for name in uv_maps - both]
        asked += [("colour attribute", name) for name in values.shader.attributes("color") - both]
    for kind, name in asked:
        _judge_attribute(title, shape, material, (kind, name), read)


def _judge_excess(
    title: str, shape: MeshValues, material: MaterialValues, read: SceneValues
) -> None:
    """Whether colours that materials look up without a graph reach beyond their parameters."""
    limits = {item.name: max(item.upper, 1.0) for item in parameters.of("material")}
    for name, found in material.maps.items():
        shown = [item for item in shape.colors if not found.attribute or item[0] == found.attribute]
        if found.texture is not None or not shown:
            continue
        attribute, colors = shown[0]
        if (colors > limits[name]).any():
            cause = f"values of colour attribute '{attribute}' above {limits[name]:g} are cut off"
            read.warn(remark(title, cause))


def _judge_attribute(
    title: str, shape: MeshValues, material: str, asked: tuple[str, str], read: SceneValues
) -> None:
    kind, name = asked
    names = [item for item, _ in (shape.uv_maps if kind == "UV map" else shape.colors)]
    if name in names or (names and not name):
        return
    called = f"{kind} '{name}'" if name else kind
    asks = f"it has no {called}, which material '{material}' asks for"
    known = {*shape.other_attributes, *(item[0] for item in shape.uv_maps + shape.colors)}
    if name and name in known:
        cause = f"{asks}, but another kind of attribute of that name"
        cure = f"name a {kind} in the material's node, or add one"
        problem = Problem(title, cause, cure)
        if problem not in read.problems:
            read.problems.append(problem)
    else:
        read.warn(remark(title, f"{asks}; it is taken as 0, as in Cycles"))
