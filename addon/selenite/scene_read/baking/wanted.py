# SPDX-License-Identifier: GPL-3.0-or-later
"""What is to be baked of a scene: noted while its materials are read, filled in afterwards."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, replace

import bpy
import numpy as np

from ...messages import thing
from ...problems import Problem
from ..shaders import Shader
from ..shading import nodes
from ..shading.nodes import Groups
from ..texture_values import TextureValues
from ..values import MeshValues, SceneValues
from . import dependence

#: UV maps of baked images, which no mesh of Blender has: this and the name of the material.
UV_NAME = ".baked "


@dataclass(frozen=True, eq=False)
class WantedOutput:
    """The output of a node that is to be baked; `texture` holds its place in the shader."""

    groups: tuple[str, ...]
    node: str
    socket: str
    said: str
    fingerprint: str
    of_instance: bool
    sees_others: bool
    of_chance: bool
    texture: TextureValues


@dataclass(eq=False)
class WantedMaterial:
    """A material with such outputs. `users`: (name, library) of an object -> whether each of its
    slots has the material; `places`: numbers of its objects in the scene's list."""

    name: str
    datablock: str
    library: str
    shader: Shader
    outputs: list[WantedOutput]
    users: dict[tuple[str, str], tuple[bool, ...]] = field(default_factory=dict)
    places: dict[tuple[str, str], list[int]] = field(default_factory=dict)
    instanced: set[tuple[str, str]] = field(default_factory=set)

    @property
    def uv_name(self) -> str:
        return UV_NAME + self.name


class Baker:
    """Collects what is to be baked, in one pass over a scene."""

    def __init__(self) -> None:
        self.materials: list[WantedMaterial] = []

    def output(
        self, node: bpy.types.Node, output: bpy.types.NodeSocket, groups: Groups
    ) -> WantedOutput:
        """A placeholder for the image of an output; see `dependence.can_be_baked`."""
        title = f"{nodes.describe(node)}, output '{output.name}'"
        # Any one pixel will do: the true ones take its place.
        pixels = np.zeros((1, 1, 3), np.float32)
        return WantedOutput(
            tuple(group.name for group in groups),
            node.name,
            output.identifier,
            title,
            dependence.fingerprint(node, output, groups),
            dependence.is_of_instance(node, output, groups),
            dependence.sees_others(node, output, groups),
            dependence.is_of_chance(node, output, groups),
            TextureValues(f"baked {title}", pixels, False, "EXTEND", "Linear"),
        )

    def used(
        self,
        item: bpy.types.Object,
        place: int,
        materials: tuple[str, ...],
        *,
        is_instance: bool,
    ) -> None:
        """An object of the scene's list has these materials in its slots."""
        library = item.library.filepath if item.library is not None else ""
        key = (item.name, library)
        for wanted in self.materials:
            if wanted.name in materials:
                wanted.users[key] = tuple(name == wanted.name for name in materials)
                wanted.places.setdefault(key, []).append(place)
                if is_instance:
                    wanted.instanced.add(key)

    def problems(self) -> list[Problem]:
        """Why some of it cannot be baked."""
        found = []
        for wanted in self.materials:
            for output in wanted.outputs:
                if output.of_instance and wanted.instanced:
                    name = min(wanted.instanced)[0]
                    cause = f"{output.said} differs between the instances of object '{name}'"
                    cure = "make the instances real (Object > Apply)"
                    found.append(Problem(thing("Material", wanted.datablock), cause, cure))
        return found


def key_of(wanted: WantedMaterial, read: SceneValues, size: int, version: str) -> str:
    """Names the images of a material: changes with all that they depend on."""
    found = hashlib.sha256(f"1 {version} {size}".encode())
    for output in wanted.outputs:
        found.update(output.fingerprint.encode())
    for user, slots in wanted.users.items():
        found.update(repr((user, slots)).encode())
        for place in wanted.places[user][:1]:
            _add_object(found, read, place)
    if any(output.sees_others for output in wanted.outputs):
        for place in range(len(read.objects)):
            _add_object(found, read, place)
    return found.hexdigest()[:32]


def _add_object(found: hashlib._Hash, read: SceneValues, place: int) -> None:
    item = read.objects[place]
    mesh = read.meshes[item.mesh]
    found.update(repr(item.facts).encode())
    found.update(np.ascontiguousarray(item.matrix).tobytes())
    lists = [(name, values) for name, values in mesh.uv_maps if not name.startswith(UV_NAME)]
    for name, values in (*lists, *mesh.colors):
        found.update(name.encode() + np.ascontiguousarray(values).tobytes())
    for array in (mesh.positions, mesh.triangles, mesh.corner_normals, mesh.material_slots):
        found.update(np.ascontiguousarray(array).tobytes())


def fill_in(
    wanted: WantedMaterial,
    read: SceneValues,
    pictures: list[np.ndarray],
    maps: dict[tuple[str, str], np.ndarray],
) -> None:
    """Puts pictures (h, w, 3), row 0 at the top, and UV maps (3m, 2) in the placeholders' place."""
    shader = wanted.shader
    for output, pixels in zip(wanted.outputs, pictures, strict=True):
        at = shader.textures.index(output.texture)
        shader.textures[at] = replace(output.texture, pixels=pixels)
    for user, places in wanted.places.items():
        made: dict[int, int] = {}
        for place in places:
            item = read.objects[place]
            if item.mesh not in made:
                made[item.mesh] = _with_map(read, item.mesh, places, (wanted.uv_name, maps[user]))
            read.objects[place] = replace(item, mesh=made[item.mesh])


def _with_map(
    read: SceneValues, mesh: int, places: list[int], found: tuple[str, np.ndarray]
) -> int:
    """The number of the mesh with one more UV map: of a copy, where others have the mesh too."""
    values: MeshValues = read.meshes[mesh]
    values = replace(values, uv_maps=(*values.uv_maps, found))
    others = any(
        item.mesh == mesh for place, item in enumerate(read.objects) if place not in places
    )
    if others:
        read.meshes.append(values)
        return len(read.meshes) - 1
    read.meshes[mesh] = values
    return mesh
