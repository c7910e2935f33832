# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitted values -> sockets, lamps and world. All of them, or none."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import bpy

from .. import parameters
from ..messages import thing
from ..parameters import Parameter, Values
from ..paths import is_there
from ..problems import BadInput, Problem, Reason
from ..scene_read import view_layers
from ..scene_read.blend_file import write_blend_copy
from ..scene_read.lamps import lights
from ..scene_read.shading import materials, volumes, world
from ..scene_read.shading.nodes import Source
from ..scene_read.shading.textures import EmptyRoom
from ..scene_read.values import Owner
from . import world_rotation

Key = tuple[str, str]  # owner, parameter
Block = TypeVar("Block", bound=bpy.types.ID)


@dataclass(frozen=True)
class _Target:
    """A place in the .blend that holds one parameter."""

    get: Callable[[], Values]
    set: Callable[[Values], None]


def write(
    scene: bpy.types.Scene, owners: Mapping[str, Owner], values: Mapping[Key, Values]
) -> dict[Key, Values]:
    """Writes `values` and returns what stood there before.

    Everything is checked first: raises BadInput and changes nothing when one value cannot be
    written (linked, driven, keyframed, library, gone, not finite or out of range). The caller makes
    it one undo step.
    """
    problems: list[Problem] = []
    targets: list[tuple[Key, _Target, Values]] = []
    for (owner_name, name), value in values.items():
        title = thing("Parameter", parameters.join_name(owner_name, name))
        owner = owners.get(owner_name)
        parameter = owner.find(name) if owner is not None else None
        if owner is None or parameter is None:
            problems.append(Problem(title, "the scene has no such parameter", "read it again"))
            continue
        complaint = parameter.complaint(value)
        if complaint:
            problems.append(Problem(title, complaint, "write a value inside the range"))
            continue
        target, reason = _target(scene, owner, parameter)
        if target is None:
            problems.append(reason.after("cannot be written: ").problem(title, "undo the change"))
            continue
        targets.append(((owner_name, name), target, tuple(value)))
    if problems:
        raise BadInput(problems)
    before = {key: target.get() for key, target, _ in targets}
    for _, target, value in targets:
        target.set(value)
    return before


def constants_of(owner: Owner) -> dict[str, Parameter]:
    """The constants of a material's node graph as they are now, by name; none where it is gone or
    has no graph."""
    material = datablock(bpy.data.materials, owner)
    if material is None or not material.use_nodes or material.node_tree is None:
        return {}
    graph = materials.graph_of(material, EmptyRoom()).shader
    return {item.parameter.name: item.parameter for item in graph.constants}


def save_copy(path: str) -> str:
    """Saves the open file under another name; the open file keeps its own. Returns the new name of
    a file that was there, or "". Raises BadInput."""
    with replaced_file_kept(path) as kept:
        write_blend_copy(path, "give another")
    return kept


@contextmanager
def replaced_file_kept(path: str) -> Iterator[str]:
    """While Blender saves to `path`: a file that is there stays beside it as PATH1, as is Blender's
    default, whatever the preferences say. Yields that name, "" where there is no file."""
    preferences = bpy.context.preferences.filepaths
    versions = preferences.save_version
    if not is_there(Path(path)):
        yield ""
        return
    preferences.save_version = max(1, versions)
    try:
        yield f"{path}1"
    finally:
        preferences.save_version = versions


def _target(
    scene: bpy.types.Scene, owner: Owner, parameter: Parameter
) -> tuple[_Target | None, Reason]:
    if owner.kind == "material":
        material = datablock(bpy.data.materials, owner)
        if material is None:
            return None, Reason("the material is gone", "undo its removal")
        if parameter.name in volumes.PARAMETERS:
            return _volume_target(material, parameter)
        return _socket_target(*materials.find_source(material, parameter))
    if owner.kind == "light":
        light = datablock(bpy.data.lights, owner)
        if light is None:
            return None, Reason("the light is gone", "undo its removal")
        reason = lights.why_fixed(light, parameter.name)
        return (None, reason) if reason else (_light_target(light, parameter), Reason())
    rendered = datablock(view_layers.worlds(scene), owner)
    if rendered is None:
        return None, Reason("the world is gone", "choose it again")
    if parameter.name == world.ROTATION:
        return _rotation_target(rendered)
    return _socket_target(*world.find_source(rendered, parameter))


def datablock(blocks: Iterable[Block], owner: Owner) -> Block | None:
    """By name and library: after an undo every pointer is stale."""
    return next(
        (
            block
            for block in blocks
            if block.name == owner.datablock
            and (block.library.filepath if block.library is not None else "") == owner.library
        ),
        None,
    )


def _socket_target(source: Source | None, reason: Reason) -> tuple[_Target | None, Reason]:
    if source is None or reason:
        return None, reason
    holder, name = source.place

    def get() -> Values:
        value = getattr(holder, name)
        return tuple(value[:3]) if hasattr(value, "__len__") else (float(value),)

    def put(values: Values) -> None:
        if len(values) == 1:
            setattr(holder, name, values[0])
        else:  # a colour keeps its fourth channel
            getattr(holder, name)[:3] = values

    return _Target(get, put), Reason()


def _volume_target(
    material: bpy.types.Material, parameter: Parameter
) -> tuple[_Target | None, Reason]:
    source, reason = volumes.find_node(material)
    if source is None:
        return None, reason
    return _Target(
        lambda: volumes.read(source, material.name)[parameter.name],
        lambda values: volumes.write(source, parameter, values),
    ), Reason()


def _rotation_target(found: bpy.types.World) -> tuple[_Target | None, Reason]:
    _, reason = world.find_rotation(found)
    if reason:
        return None, reason
    return _Target(
        lambda: (world_rotation.read(found),),
        lambda values: world_rotation.write(found, values[0]),
    ), Reason()


def _light_target(light: bpy.types.Light, parameter: Parameter) -> _Target:
    if parameter.name == "power":
        return _Target(lambda: (light.energy,), lambda values: setattr(light, "energy", values[0]))
    return _Target(lambda: tuple(light.color), lambda values: setattr(light, "color", values))
