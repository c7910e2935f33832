# SPDX-License-Identifier: GPL-3.0-or-later
"""Walks through a scene and names every value that the renderer does not take as it is."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy

from ...problems import Problem, listed
from ..shading import nodes
from .conditions import Scope
from .inputs import INPUTS
from .rows import Effect, Row, Value, same
from .tables import RnaProperty, chain_of, default_of, rows_of, unknown_properties

if TYPE_CHECKING:
    from ..hosts import BpyStruct

_MOST_LINES = 4  # of datablocks with the same fault; more of them share a line


@dataclass(frozen=True)
class Place:
    """A datablock, or a part of one: `title` names the former, `part` the latter."""

    kind: str
    name: str
    block: BpyStruct
    part: str = ""


@dataclass(frozen=True)
class Finding:
    """A value that is not modelled: a problem (refused) or a warning (warned of)."""

    effect: Effect
    kind: str
    name: str
    cause: str
    cure: str


def judge(
    scope: Scope, modelled_inputs: frozenset[str] = frozenset()
) -> tuple[list[Problem], list[str]]:
    """Problems and warnings of a scene. Cheap: it reads settings, no geometry and no pixels.

    modelled_inputs: names of the inputs of a Principled BSDF that the renderer has.
    """
    found = list(dict.fromkeys(findings(scope, modelled_inputs)))
    return (
        _lines(item for item in found if item.effect is Effect.REFUSED),
        [item.line() for item in _lines(i for i in found if i.effect is Effect.WARNED)],
    )


def instancers_of(
    layer: bpy.types.ViewLayer, rendered: Iterable[bpy.types.Object]
) -> tuple[bpy.types.Object, ...]:
    """Objects of a view layer that are not rendered themselves but may stand for others that are,
    to which their ray visibility applies."""
    known = set(rendered)
    return tuple(
        item
        for item in layer.objects
        if item not in known
        and not item.hide_render
        and (item.instance_type != "NONE" or item.particle_systems or item.modifiers)
    )


def findings(scope: Scope, modelled_inputs: frozenset[str] = frozenset()) -> Iterator[Finding]:
    """Everything that is not modelled, in the order of the walk; some of it more than once."""
    unknown: dict[str, list[RnaProperty]] = {}
    for place in places(scope):
        yield from _of_block(place, scope)
        for struct in chain_of(place.block.bl_rna):
            if struct.identifier not in unknown:
                unknown[struct.identifier] = unknown_properties(struct)
            for item in unknown[struct.identifier]:
                yield from _of_unknown(place, item)
        if isinstance(place.block, bpy.types.Node):
            yield from _of_inputs(place, modelled_inputs)


def _lines(found: Iterable[Finding]) -> list[Problem]:
    alike: dict[tuple[str, str, str], list[str]] = {}
    for item in found:
        alike.setdefault((item.kind, item.cause, item.cure), []).append(item.name)
    lines = []
    for (kind, cause, cure), names in alike.items():
        if len(names) <= _MOST_LINES:
            lines += [Problem(f"{kind} '{name}'", cause, cure) for name in names]
        else:
            rest = f"{listed(names[:_MOST_LINES])} and {len(names) - _MOST_LINES} more"
            lines.append(Problem(f"{kind}s {rest}", cause, cure))
    return lines


def places(scope: Scope) -> Iterator[Place]:
    """All blocks whose values matter."""
    scene, layer = scope.scene, scope.view_layer
    for block in (scene, scene.render, scene.cycles, scene.unit_settings):
        yield Place("Scene", scene.name, block)
    for block in (layer, layer.cycles):
        yield Place("View layer", layer.name, block)
    yield from _collections(layer.layer_collection)
    for item in (*scope.objects, *scope.instancers):
        yield from _of_object(item)
    for item in scope.cameras:
        yield Place("Camera", item.name, item.data)
        yield Place("Camera", item.name, item.data.dof)
    for material in scope.materials:
        yield Place("Material", material.name, material)
        yield Place("Material", material.name, material.cycles)
        yield from _of_nodes("Material", material)
    if scope.world is not None:
        world: BpyStruct = scope.world
        for block in (world, world.cycles, world.cycles_visibility):
            yield Place("World", world.name, block)
        yield from _of_nodes("World", world)


def _collections(layer: bpy.types.LayerCollection) -> Iterator[Place]:
    """Collections that take part in a render."""
    if layer.exclude or layer.collection.hide_render:
        return
    yield Place("Collection", layer.name, layer)
    for child in layer.children:
        yield from _collections(child)


def _of_object(item: bpy.types.Object) -> Iterator[Place]:
    yield Place("Object", item.name, item)
    yield Place("Object", item.name, item.cycles)
    for modifier in item.modifiers:
        yield Place("Object", item.name, modifier, modifier.name)
    data: BpyStruct = item.data
    if isinstance(data, bpy.types.Light):
        yield Place("Light", data.name, data)
        yield Place("Light", data.name, data.cycles)
        yield from _of_nodes("Light", data)
        return
    if data is not None:
        yield Place("Object", item.name, data)
    if isinstance(data, bpy.types.Volume):
        yield Place("Object", item.name, data.render)


def _of_nodes(kind: str, owner: BpyStruct) -> Iterator[Place]:
    """The nodes that Cycles evaluates, and the images that they use."""
    if not owner.use_nodes or owner.node_tree is None:
        return
    output = nodes.output_of(owner.node_tree)
    if output is None:
        return
    ends = {node for node, _ in output.ends}
    pending: list[tuple[bpy.types.Node, nodes.Groups]] = [*output.ends]
    seen = set()
    while pending:
        node, groups = pending.pop()
        key = (node.as_pointer(), *(item.as_pointer() for item in groups))
        if key in seen:
            continue
        seen.add(key)
        yield NodePlace(kind, owner.name, node, nodes.describe(node), groups)
        yield from _of_image(kind, owner.name, node)
        for socket in node.inputs:
            if node in ends and socket.name not in {"Surface", "Volume"}:
                continue  # a Displacement is refused as a whole
            source = nodes.source_of(socket, groups)
            if source.node is not None and not source.node.mute:
                pending.append((source.node, source.groups))


@dataclass(frozen=True)
class NodePlace(Place):
    """A node, and the groups around it."""

    groups: nodes.Groups = ()


def _of_image(kind: str, name: str, node: BpyStruct) -> Iterator[Place]:
    if hasattr(node, "texture_mapping"):
        yield Place(kind, name, node.texture_mapping, nodes.describe(node))
    image = getattr(node, "image", None)
    if image is not None:
        yield Place("Image", image.name, image)


def _of_block(place: Place, scope: Scope) -> Iterator[Finding]:
    block = place.block
    for row in rows_of(block):
        for name in row.names:
            if not hasattr(block, name):
                continue
            value = getattr(block, name)
            if row.is_neutral(value) or (row.acts is not None and not row.acts(block, scope)):
                continue
            shown = block.bl_rna.properties[name]
            text, usual = (_shown(shown, item) for item in (value, _usual(row)))
            yield _finding(row, place, shown.name, text, usual)


def _of_unknown(place: Place, item: RnaProperty) -> Iterator[Finding]:
    """A property that came with a newer Blender. Nothing may be made in the user's file, so its
    default in RNA is what it is compared with, though a fresh datablock may have another one."""
    if item.is_readonly and item.type not in {"POINTER", "COLLECTION"}:
        return
    value, default = getattr(place.block, item.identifier), default_of(item)
    if item.type == "POINTER" and not isinstance(value, bpy.types.ID):
        return
    if item.type == "COLLECTION" and not len(value):
        return
    if same(value, default):
        return
    yield Finding(
        Effect.WARNED,
        place.kind,
        place.name,
        f"'{item.name}' ({item.identifier}) is {text_of(value)}, and this version of Selenite does "
        "not know what it does",
        f"set it to {text_of(default)}, or compare a render with Cycles",
    )


def _of_inputs(place: Place, modelled_inputs: frozenset[str]) -> Iterator[Finding]:
    node = place.block
    table = INPUTS.get(node.bl_idname)
    if table is None or not isinstance(place, NodePlace):
        return
    for socket in node.inputs:
        row = table.by_name.get(socket.name)
        if socket.name in modelled_inputs and node.bl_idname == "ShaderNodeBsdfPrincipled":
            continue
        source = nodes.source_of(socket, place.groups)
        if row is not None and (
            row not in table.named or (row.covers and socket.name in row.covers)
        ):
            continue
        number = nodes.constant(source)
        acts, value = number is None or any(number), text_of(number)
        if not acts or (source.node is None and socket.hide_value):
            continue
        if row is not None:
            yield _finding(row, place, socket.name, value, "0")
        elif socket.enabled:
            yield Finding(
                Effect.WARNED,
                place.kind,
                place.name,
                f"input '{socket.name}' of {place.part} is not known to this version of Selenite",
                "set it to 0 and unlink it, or compare a render with Cycles",
            )


def _finding(row: Row, place: Place, label: str, value: str, neutral: str) -> Finding:
    words = {"label": label, "value": value, "neutral": neutral, "part": place.part}
    return Finding(
        Effect.REFUSED if row.effect is Effect.MODELLED else row.effect,
        place.kind,
        place.name,
        row.cause.format(**words),
        row.cure.format(**words),
    )


def _usual(row: Row) -> Value:
    values = getattr(row.neutral, "values", None)
    return row.neutral if values is None else next(iter(values), None)


def _shown(item: RnaProperty, value: Value) -> str:
    """As the interface shows it."""
    if item.type == "ENUM" and isinstance(value, str) and value in item.enum_items:
        return str(item.enum_items[value].name)
    return text_of(value)


def text_of(value: Value) -> str:
    """A value for a message."""
    if isinstance(value, bpy.types.ID):
        return f"'{value.name}'"
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, (int, float)):
        return f"{value:g}"
    if value is None:
        return "none"
    if isinstance(value, str):
        return value.replace("_", " ").title() if value.isupper() else f"'{value}'"
    if hasattr(value, "__len__") and not isinstance(value, set):
        return f"({', '.join(text_of(item) for item in value)})" if len(value) < 5 else "set"
    return str(value)
