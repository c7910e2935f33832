# SPDX-License-Identifier: GPL-3.0-or-later
"""The material of a photographed body as another model: opaque, with subsurface scattering, or
rough glass over a medium; and the material of another file in its place."""

from __future__ import annotations

from pathlib import Path

import bpy

from .. import parameters
from ..messages import thing
from ..parameters import Parameter, Values
from ..problems import BadInput, Problem
from ..scene_read import hosts
from ..scene_read.shading import nodes, volumes
from ..scene_read.shading.materials import principled_of
from . import grids

#: What a body of each model has, where the fit begins.
_OPAQUE: dict[str, Values] = {"transmission": (0.0,), "subsurface_weight": (0.0,)}
_GLASS: dict[str, Values] = {
    "base_color": (1.0, 1.0, 1.0), "metallic": (0.0,), "subsurface_weight": (0.0,),
    "transmission": (1.0,), "roughness": (0.3,),
}  # fmt: skip
_SUBSURFACE: dict[str, Values] = {
    "transmission": (0.0,), "subsurface_weight": (0.9,), "subsurface_radius": (1.0, 1.0, 1.0),
}  # fmt: skip
#: Of the body's size, how far light goes under the surface at first.
_REACH = 0.1
#: On a material from another file: the name of the one in whose place it is.
_BEFORE = "selenite_material_before"
#: Albedo of the medium that a fit begins with, and the body's size in mean free paths.
_ALBEDO, _FREE_PATHS = 0.9, 3.0


def make_opaque(material: bpy.types.Material) -> None:
    """Light no longer enters the body. Raises BadInput."""
    node = _principled(material)
    _unlink_volume(material)
    for name, value in _OPAQUE.items():
        _put(node, parameters.table()["material", name], value)


def make_subsurface(material: bpy.types.Material) -> None:
    """Light scatters under the surface, which keeps its colour. Raises BadInput."""
    node = _principled(material)
    size = _size_of(material)
    _unlink_volume(material)
    for name, value in (_SUBSURFACE | {"subsurface_scale": (_REACH * size,)}).items():
        _put(node, parameters.table()["material", name], value)


def make_medium(material: bpy.types.Material) -> None:
    """Rough glass over a medium that scatters, three mean free paths thick. Raises BadInput."""
    node = _principled(material)
    size = _size_of(material)
    for name, value in _GLASS.items():
        _put(node, parameters.table()["material", name], value)
    _unlink_volume(material)
    tree = material.node_tree
    volume = tree.nodes.new("ShaderNodeVolumePrincipled")
    volume.location = (node.location[0], node.location[1] - 700)
    volume.inputs["Color"].default_value = (_ALBEDO, _ALBEDO, _ALBEDO, 1.0)
    volume.inputs["Density"].default_value = _FREE_PATHS / size
    volume.inputs["Anisotropy"].default_value = 0.0
    output = nodes.output_of(tree)
    assert output is not None  # noqa: S101 - the Principled BSDF hangs on it
    tree.links.new(volume.outputs[0], output.node.inputs["Volume"])


def make_grey(material: bpy.types.Material) -> None:
    """The medium thins light of every colour alike, as Cycles demands beside a grid of albedos.
    Raises BadInput."""
    source, reason = volumes.find_node(material)
    title = thing("Material", material.name)
    if source is None:
        raise BadInput(reason.problem(title, "link a Principled Volume"))
    mean = sum(volumes.read(source, title)["extinction"]) / 3
    volumes.write(source, parameters.table()["material", "extinction"], (mean, mean, mean))


def take(scene: bpy.types.Scene, material: bpy.types.Material, file: Path) -> bpy.types.Material:
    """The material of the same name in a file, in place of `material` wherever that is used, with
    the Volume objects that show its grids. Raises BadInput, and then the scene is as before."""
    title, name = thing("Material", material.name), material.name
    if not hosts.is_editable(material):
        cause = "it comes from a library"
        cure = "make it local"
        raise BadInput(Problem(title, cause, cure))
    try:
        library = bpy.data.libraries.load(str(file), link=False)
        with library as (there, loaded):  # type: ignore[attr-defined] # of the context manager
            loaded.materials = [item for item in there.materials if item == name]
            loaded.objects = [item for item in there.objects if grids.may_show(item, name)]
    except OSError as error:
        cause = f"the fitted scene cannot be read: {file}"
        cure = "fit again"
        raise BadInput(Problem(title, cause, cure)) from error
    found = next(iter(loaded.materials), None)
    if found is None:
        cause = f"the fitted scene does not have it: {file}"
        raise BadInput(Problem(title, cause, "fit again"))
    for item in loaded.objects:
        if grids.shows(item, name):
            scene.collection.objects.link(item)
        else:
            bpy.data.objects.remove(item)
    material.name = f"{name} before"
    material.use_fake_user = True
    found.name, found[_BEFORE] = name, material.name
    material.user_remap(found)
    return found


def give_back(scene: bpy.types.Scene, material: bpy.types.Material) -> bpy.types.Material:
    """Undoes `take`. Raises BadInput where the one before is gone."""
    name = material.name
    before: bpy.types.Material | None = bpy.data.materials.get(material.get(_BEFORE, ""))
    if before is None:
        cause = "the material before it is gone"
        cure = "undo its removal"
        raise BadInput(Problem(thing("Material", name), cause, cure))
    grids.restore(scene, name)
    material.user_remap(before)
    bpy.data.materials.remove(material)
    before.name, before.use_fake_user = name, False
    return before


def has_uvs(material: bpy.types.Material) -> bool:
    """Whether every mesh with the material has a UV map, so that an image can be fitted to it."""
    meshes = [item.data for item in _objects(material) if item.type == "MESH"]
    return bool(meshes) and all(mesh.uv_layers for mesh in meshes)


def _principled(material: bpy.types.Material) -> bpy.types.Node:
    found = principled_of(material)
    title = f"Material '{material.name}'"
    if isinstance(found, str):
        cure = "link a Principled BSDF to its Material Output"
        raise BadInput(Problem(title, f"it {found}", cure))
    node, groups = found
    if groups:
        cause = "its Principled BSDF stands in a node group, which other materials may share"
        raise BadInput(Problem(title, cause, "ungroup it"))
    return node


def _unlink_volume(material: bpy.types.Material) -> None:
    tree = material.node_tree
    output = nodes.output_of(tree)
    for link in list(output.node.inputs["Volume"].links) if output is not None else ():
        tree.links.remove(link)


def _put(node: bpy.types.Node, parameter: Parameter, value: Values) -> None:
    """The value in place of what is linked."""
    socket = parameter.find(node)
    if socket is None:  # of another version
        return
    for link in list(socket.links):
        node.id_data.links.remove(link)
    if len(value) == 1:
        socket.default_value = value[0]
    else:
        socket.default_value[:3] = value


def _objects(material: bpy.types.Material) -> list[bpy.types.Object]:
    return [
        item
        for item in bpy.context.scene.objects
        if any(slot.material == material for slot in item.material_slots)
    ]


def _size_of(material: bpy.types.Material) -> float:
    """The shortest side of the largest object with it, in Blender units of the world. Raises
    BadInput where that is 0."""
    sides = [sorted(item.dimensions[axis] for axis in range(3)) for item in _objects(material)]
    size = max(sides, key=lambda side: side[2])[0] if sides else 0.0
    if not size > 0:
        cause = "no object of a size above 0 has it"
        raise BadInput(Problem(f"Material '{material.name}'", cause, "give it to the body"))
    return size
